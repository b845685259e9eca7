"""From recordings to the mode: guess, global search on a short window, growing windows, polish.

Long recordings are phase-locked: the misfit has side minima in k1, one per lost cycle. The global
search (differential evolution with the Metropolis criterion) therefore sees only the first cycles,
where there are few; its winner and the initial guess are then carried to the full length over
windows that double, each a least-squares polish with exact derivatives. Both ends are compared, so
that a search that failed shows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.arviz_groups import arviz_groups, as_arviz, laplace_draws
from bayesimpact.inference.declared import ascended, ascended_from, is_same_mode, search_declared
from bayesimpact.inference.defaults import default_priors
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.initial.estimates import Estimates, estimate
from bayesimpact.inference.initial.from_periods import or_by_periods
from bayesimpact.inference.initial.high_pass import campaign_before_high_pass, of_readings
from bayesimpact.inference.initial.horizon import best_ascent
from bayesimpact.inference.initial.rough import rough_estimates
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.estimate import estimate_noise
from bayesimpact.inference.noise.refined import refined_noise
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.nuisances import nuisance_step
from bayesimpact.inference.onsets import without_onsets
from bayesimpact.inference.priors import Priors
from bayesimpact.inference.randomness import Random, generator
from bayesimpact.inference.search import Generation, SearchResult, metropolis_differential_evolution
from bayesimpact.model.exact.sensitivities.derivatives import grams
from bayesimpact.model.exact.simulate import sums_of_squares
from bayesimpact.model.jit.threads import linear_algebra_alone
from bayesimpact.model.oscillator import Oscillator, build_oscillator
from bayesimpact.model.parameters import BASE_SLOTS
from bayesimpact.model.rounding import scatter

Array = NDArray[np.float64]

SEARCH_CYCLES = 6.0  # length of the window of the global search
SEARCH_SAMPLES = 300  # of each recording in that window; more add nothing but time
BOUND_FACTOR = 3.0  # bounds of the search about the guess
NUISANCE_SLOTS = np.array([BASE_SLOTS.index(s) for s in ("y0", "v0", "offset")])
_RESIDUAL = len(BASE_SLOTS)  # row of the Gram matrix that belongs to the residual


@dataclass(frozen=True, eq=False)
class Identification:
    """The mode of the base model and how it was found.

    Attributes
    ----------
    fit : the better of the two ends, or where both miss by far the one that periods ahead lead to
    estimates : initial estimates from the recordings, the guess
    noise : estimated from the recordings alone
    search : the global search, or None when it was left out
    from_guess, from_search : both ends; they should agree
    """

    fit: Fit
    estimates: Estimates
    noise: Noise
    search: SearchResult | None
    from_guess: Fit
    from_search: Fit | None

    def __repr__(self) -> str:
        """One line."""
        ends = "guess and search agree" if self.agree else "guess and search differ"
        ends = "not searched" if self.from_search is None else ends
        return f"<Identification of {self.fit.words}, {ends}>"

    @property
    def agree(self) -> bool:
        """True when guess and search ended within 0.1 standard deviations of each other."""
        return self.from_search is None or is_same_mode(self.from_search, self.from_guess)

    def to_arviz(
        self, *, lab_units: bool = False, seed: int | None = None, rng: Random = None
    ) -> Any:
        """Draws of the Laplace approximation at the mode, as ArviZ takes them; nothing is sampled.

        Groups and units as of `Posterior.to_arviz`, without sample_stats and predictions.
        """
        draws = laplace_draws(self.fit, generator(seed, rng))
        return as_arviz(arviz_groups(self.fit, draws, lab_units=lab_units))


@linear_algebra_alone()
def identify(
    campaign: Campaign,
    *,
    rng: np.random.Generator,
    noise: Noise | None = None,
    search: bool = True,
    evaluations: int | None = None,
    sigma_per_recording: bool = False,
    callback: Callable[[Generation], None] | None = None,
    known: Mapping[str, float] | None = None,
) -> Identification:
    """Mode of the base model's posterior for a campaign, nothing given.

    Where the campaign declares effects the global search is made even without `search`, unless
    values of parameters are `known`, from which to begin.
    Raises `InputError` when a recording shows no oscillation.
    """
    estimates = first_estimates(campaign)
    given, noise = noise is not None, noise or about_average(estimate_noise(campaign), campaign)
    oscillator = build_oscillator(campaign, sigma_per_recording=sigma_per_recording)
    if oscillator.acting:
        return _with_declared(
            oscillator, estimates, noise, given, rng=rng, evaluations=evaluations,
            callback=callback, known=known,
        )  # fmt: skip
    priors = default_priors(oscillator, estimates, noise)
    guess = initial_theta(oscillator, estimates, noise)
    density = PosteriorDensity(Likelihood(oscillator, noise), priors)
    from_guess = best_ascent(density, guess)
    result = from_search = None
    if search:
        result, start = global_search(
            oscillator, priors, guess, rng=rng, evaluations=evaluations, callback=callback,
            scales=density.likelihood.scales,
        )  # fmt: skip
        from_search = best_ascent(density, start)
    ends = [fit for fit in (from_guess, from_search) if fit is not None]
    best = max(ends, key=lambda fit: fit.log_posterior)
    if (smooth := without_onsets(best)) is not campaign:
        oscillator = replace(oscillator, campaign=smooth)
        density = PosteriorDensity(Likelihood(oscillator, noise), priors)
        ends = [find_mode(density, fit.mode) for fit in ends]
        from_guess, from_search = ends[0], ends[1] if search else None
        best = max(ends, key=lambda fit: fit.log_posterior)
    best = or_by_periods(best)
    refined = noise if given else refined_noise(best)
    if refined is not noise:
        noise = refined
        best = find_mode(PosteriorDensity(Likelihood(oscillator, noise), priors), best.mode)
    return Identification(best, estimates, noise, result, from_guess, from_search)


def first_estimates(campaign: Campaign) -> Estimates:
    """Initial estimates, from what came into a high-pass where the campaign declares one."""
    seen = campaign_before_high_pass(campaign)
    return of_readings(rough_estimates(seen) if seen.declared else estimate(seen), campaign)


def _with_declared(
    oscillator: Oscillator,
    estimates: Estimates,
    noise: Noise,
    given: bool,
    *,
    rng: np.random.Generator,
    evaluations: int | None,
    callback: Callable[[Generation], None] | None,
    known: Mapping[str, float] | None,
) -> Identification:
    """The mode of a base model with declared effects, on which two searches agree; or the nearest
    to `known` values.
    """
    if known:
        result, best = None, ascended_from(oscillator, estimates, noise, known)
        other = best
    else:
        result, (best, other) = search_declared(
            oscillator, estimates, noise, rng=rng, evaluations=evaluations, callback=callback
        )
    if (smooth := without_onsets(best)) is not oscillator.campaign:
        oscillator = replace(oscillator, campaign=smooth)
        density = replace(best.density, likelihood=Likelihood(oscillator, noise))
        best, other = ascended(density, best), ascended(density, other)
    fit = best = or_by_periods(best)
    refined = noise if given else refined_noise(best)
    if refined is not noise:
        fit = ascended(replace(best.density, likelihood=Likelihood(oscillator, refined)), best)
    return Identification(fit, estimates, refined, result, other, best)


def about_average(noise: Noise, campaign: Campaign) -> Noise:
    """Noise about what is read on average, where readings come in coarse steps (`rounding`)."""
    if noise.smoothing is not None:  # behind a filter steps are noise
        return noise
    level = noise.level
    rows = [(r, level * noise.scales[r.order]) for r in campaign.recordings]
    left = [scatter(r, own) / own if own > 0 else 1.0 for r, own in rows]
    return replace(noise, level=level * float(np.sqrt(np.mean(np.square(left)))))


def initial_theta(oscillator: Oscillator, estimates: Estimates, noise: Noise) -> Array:
    """Parameter vector (d,) of the initial estimates."""
    known = [estimates.start(name, noise.level) for name in oscillator.layout.names]
    return np.array(known)


def global_search(
    oscillator: Oscillator,
    priors: Priors,
    guess: Array,
    *,
    rng: np.random.Generator,
    factor: float = BOUND_FACTOR,
    evaluations: int | None = None,
    callback: Callable[[Generation], None] | None = None,
    scales: Array | None = None,
) -> tuple[SearchResult, Array]:
    """Differential evolution on the physical parameters over the first cycles.

    Bounds are the guess divided and multiplied by `factor` (for the gap: the guess plus and minus
    `factor` times its size, at least a tenth of the motion), cut to the priors. Initial conditions
    and rest readings are not searched: for every candidate they take the values of two Gauss-Newton
    steps. `scales` (R,) are the recordings' noise levels over that of the first one's quantity.
    Returns the search and the full parameter vector (d,) of its winner.
    """
    k1 = float(guess[oscillator.layout.index("k1")])
    duration = SEARCH_CYCLES * 2 * np.pi / np.sqrt(k1 / oscillator.campaign.mass)
    profile = _ProfiledObjective(oscillator, guess, duration, scales)
    lower, upper = _within(priors, profile, guess, *profile.bounds(factor))
    result = metropolis_differential_evolution(
        profile,
        lower,
        upper,
        rng=rng,
        evaluations=evaluations or 1000 * lower.size,
        callback=callback,
    )
    winner = profile.complete(result.best[None])[0]
    other = [bool(r.input or r.high_pass) for r in oscillator.campaign.recordings]
    own = profile.columns[other][:, NUISANCE_SLOTS]
    # the excerpt of a driven recording begins somewhere, the rest before a high-pass is another
    winner[own] = guess[own]
    return result, winner


def _within(
    priors: Priors, profile: _ProfiledObjective, guess: Array, lower: Array, upper: Array
) -> tuple[Array, Array]:
    """Bounds cut to the priors' supports; a support beyond them is searched whole."""
    tiny = 1e-12 * np.maximum(np.abs(guess), 1e-30)
    low = profile.encode(np.maximum(priors.lower, tiny), lower)
    high = profile.encode(priors.upper, upper)
    beyond = (low >= upper) | (high <= lower)
    return np.where(beyond, low, np.maximum(low, lower)), np.where(
        beyond, high, np.minimum(high, upper)
    )


class _ProfiledObjective:
    """Profiled objective (N / 2) log S of the physical parameters, nuisances eliminated."""

    def __init__(
        self, oscillator: Oscillator, guess: Array, duration: float, scales: Array | None = None
    ) -> None:
        layout = oscillator.layout
        self.weights = 1.0 / (np.ones(oscillator.counts.size) if scales is None else scales) ** 2
        whole = campaign_before_high_pass(oscillator.campaign)
        short = whole.excerpt(duration).thinned(duration / SEARCH_SAMPLES)
        self.short = Oscillator(short, (), layout, None)
        self.guess = guess
        self.physical = layout.roles("physical")
        self.positive = np.array([layout.parameters[i].lower == 0.0 for i in self.physical])
        rate = np.sqrt(guess[layout.index("k1")] / oscillator.campaign.mass)
        motion = max(r.motion(rate) for r in oscillator.campaign.recordings)
        self.reach = np.maximum(np.abs(guess[self.physical]), 0.1 * motion)
        self.columns = np.ascontiguousarray(layout.columns[:, : len(BASE_SLOTS)])
        self.constants = np.ascontiguousarray(layout.constants[:, : len(BASE_SLOTS)])

    def bounds(self, factor: float) -> tuple[Array, Array]:
        centre = self.guess[self.physical]
        half = np.where(self.positive, np.log(factor), factor * self.reach)
        middle = np.where(self.positive, np.log(np.maximum(centre, 1e-300)), centre)
        return middle - half, middle + half

    def encode(self, theta: Array, otherwise: Array) -> Array:
        """Search coordinates of theta's physical part; `otherwise` where there is no finite one."""
        value = theta[self.physical]
        with np.errstate(invalid="ignore", divide="ignore"):
            coded = np.where(self.positive, np.log(value), value)
        return np.where(np.isfinite(coded), coded, otherwise)

    def complete(self, x: Array) -> Array:
        """Parameter vectors (B, d) for search coordinates (B, p), nuisances at their best."""
        return self._solve(x)[0]

    def __call__(self, x: Array) -> Array:
        sums = self._solve(x)[1]
        n = float(self.short.counts.sum())
        with np.errstate(divide="ignore"):
            value = 0.5 * n * np.log(sums)
        return np.where(np.isfinite(value), value, np.inf)

    def _solve(self, x: Array) -> tuple[Array, Array]:
        theta = np.repeat(self.guess[None], x.shape[0], axis=0)
        coded = np.where(self.positive, x, 0.0)
        theta[:, self.physical] = np.where(self.positive, np.exp(coded), x)
        best, lowest = theta, np.full(x.shape[0], np.inf)
        for last in (False, False, True):
            matrices = None if last else self._grams(theta)
            sums = (
                self._sums(theta)
                if matrices is None
                else matrices[..., _RESIDUAL, _RESIDUAL].sum(axis=1)
            )
            better = sums < lowest
            best = np.where(better[:, None], theta, best)
            lowest = np.where(better, sums, lowest)
            if matrices is not None:
                theta = self._nuisance_step(theta, matrices)
        return best, lowest

    def _sums(self, theta: Array) -> Array:
        s = self.short
        sums, _ = sums_of_squares(
            np.ascontiguousarray(theta), self.columns, self.constants, s.campaign.mass, s.samples,
            s.starts, s.counts, s.intervals, s.orders, s.inputs,
        )  # fmt: skip
        return np.asarray((sums * self.weights).sum(axis=1))

    def _grams(self, theta: Array) -> Array:
        s = self.short
        matrices, codes = grams(
            np.ascontiguousarray(theta), self.columns, self.constants, s.campaign.mass, s.samples,
            s.starts, s.counts, s.intervals, s.orders, s.inputs,
        )  # fmt: skip
        failed = (codes != 0) | ~np.isfinite(matrices).all(axis=(2, 3))
        matrices *= self.weights[:, None, None]
        matrices[failed] = np.eye(matrices.shape[-1]) * 1e300
        return np.asarray(matrices)

    def _nuisance_step(self, theta: Array, matrices: Array) -> Array:
        block = matrices[:, :, NUISANCE_SLOTS[:, None], NUISANCE_SLOTS[None, :]]
        right = matrices[:, :, NUISANCE_SLOTS, _RESIDUAL]
        return nuisance_step(theta, self.columns[:, NUISANCE_SLOTS], block, right)
