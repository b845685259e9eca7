"""The mode of a base model that holds effects of the catalogue: a stop on either side, say.

No initial estimate knows of these effects, so a global search decides where the fit begins: it
runs on the first cycles, with the general simulator, over the physical parameters and those of the
effects. Start values come from the first samples and the tail of every recording. Searches are
repeated until two ends of ascents, the best one among them, agree. Of a driven recording the search
looks at the cycles of its largest motion, and reads their start off the samples.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.channels import keepers
from bayesimpact.data.recording import Recording
from bayesimpact.inference.defaults import default_priors
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.initial.estimates import Estimates
from bayesimpact.inference.initial.horizon import best_ascent
from bayesimpact.inference.initial.rough import first_state
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.search import Generation, SearchResult, metropolis_differential_evolution
from bayesimpact.model.effects.effect import Effect, EffectParameter, Scales
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import is_added
from bayesimpact.response.driven_displacement import seen_displacement
from bayesimpact.response.half_cycles import spectral_period

Array = NDArray[np.float64]

CYCLES = 6.0  # length of the window, in cycles of the initial estimate
SAMPLES = 300  # of each recording in it
EVALUATIONS = 600  # evaluations per parameter
SEARCHES = 5  # at most
MOST = 200  # iterations: where the mass is never free, ridges are long
AGREE = 0.1  # standard deviations between two ascents to one mode
WIDE = 20.0  # a base parameter lies within this factor of its estimate, which knew of no effect
SIZES = (1e-2, 1e4)  # of an effect, in its physical scale
STEP = 1e-6  # of a parameter's reach: first step for differences, refined as errors become known


def campaign_sizes(campaign: Campaign, estimates: Estimates) -> Scales:
    """Physical sizes of a campaign from its initial estimates alone."""
    rate = float(np.sqrt(estimates.k1 / campaign.mass))
    reach = max(float(np.ptp(r.samples)) for r in seen_displacements(campaign))
    stiffness = float(np.mean([*estimates.k2.values()])) if estimates.k2 else 0.0
    gap = estimates.g if campaign.stop else 0.0
    return Scales(
        mass=campaign.mass,
        stiffness=estimates.k1,
        damping=estimates.c1,
        contact_stiffness=stiffness,
        contact_damping=estimates.c2,
        amplitude=reach,
        speed=reach * rate,
        indentation=max(reach - gap, 0.0) if campaign.stop else 0.0,
        impact_speed=reach * rate if campaign.stop else 0.0,
        duration=max(r.duration for r in campaign.recordings),
        interval=min(r.interval for r in campaign.recordings),
        impacts=max(estimates.impacts.values()),
        gap=gap,
        cases=len(campaign.cases),
        recordings=len(campaign.recordings),
        angle=campaign.angular,
        reading=max(float(np.ptp(r.samples)) for r in campaign.recordings),
    )


def search_declared(
    oscillator: Oscillator,
    estimates: Estimates,
    noise: Noise,
    *,
    rng: np.random.Generator,
    evaluations: int | None = None,
    callback: Callable[[Generation], None] | None = None,
) -> tuple[SearchResult, tuple[Fit, Fit]]:
    """The search that leads highest, and the two best ends; they agree, or the budget was spent.

    `evaluations` are those of one search.
    """
    campaign = oscillator.campaign
    scales = campaign_sizes(campaign, estimates)
    density = PosteriorDensity(
        Likelihood(oscillator, noise), default_priors(oscillator, estimates, noise, scales)
    )
    guess, *bounds = _bounds(density, estimates, noise, scales)
    first = FirstCycles(density, guess, *bounds)
    ends: list[tuple[Fit, SearchResult]] = []
    while len(ends) < 2 or not (len(ends) == SEARCHES or is_same_mode(ends[0][0], ends[1][0])):
        result = metropolis_differential_evolution(
            first, first.lower, first.upper, rng=rng,
            evaluations=evaluations or EVALUATIONS * first.lower.size, callback=callback,
        )  # fmt: skip
        start = first.complete(result.best[None])[0]
        start[first.elsewhere] = guess[first.elsewhere]
        ends.append((best_ascent(density, start, steps=first.steps, max_iterations=MOST), result))
        ends.sort(key=lambda end: -np.nan_to_num(end[0].log_posterior, nan=-np.inf))
    (best, result), (second, _) = ends[:2]
    return result, (best, second)


def ascended_from(
    oscillator: Oscillator, estimates: Estimates, noise: Noise, values: Mapping[str, float]
) -> Fit:
    """The mode from known `values` of parameters, those of other recordings of the rig say; what
    has none begins at its estimate.
    """
    scales = campaign_sizes(oscillator.campaign, estimates)
    priors = default_priors(oscillator, estimates, noise, scales)
    density = PosteriorDensity(Likelihood(oscillator, noise), priors)
    guess, *bounds = _bounds(density, estimates, noise, scales)
    first = FirstCycles(density, guess, *bounds)
    layout = oscillator.layout
    shared = {layout.names[i] for i in layout.roles("physical", "effect")}
    start = [
        values[name] if name in shared and name in values else own
        for name, own in zip(layout.names, guess, strict=True)
    ]
    return best_ascent(density, np.array(start), steps=first.steps, max_iterations=MOST)


def is_same_mode(one: Fit, other: Fit) -> bool:
    """True when two ascents ended within a tenth of a standard deviation of each other."""
    return bool(np.all(np.abs(one.mode - other.mode) < AGREE * one.sd))


def ascended(density: PosteriorDensity, fit: Fit) -> Fit:
    """The mode of another posterior of the same parameters, from a fit's."""
    return find_mode(density, fit.mode, steps=np.maximum(0.05 * fit.sd, 1e-300))


class FirstCycles:
    """Objective (N / 2) log S of the physical parameters, for the first cycles.

    Attributes
    ----------
    lower, upper : (p,) bounds; logarithms of positive parameters
    steps : (d,) for differences
    levels : (R,) noise of the recordings over that of the first one's quantity
    elsewhere : places in theta of states in which an excerpt, not its recording, begins
    """

    def __init__(self, density: PosteriorDensity, guess: Array, lower: Array, upper: Array) -> None:
        self.levels = density.likelihood.scales
        layout, campaign = density.oscillator.layout, density.oscillator.campaign
        period = usual_cycle(campaign)
        short = campaign.excerpt(CYCLES * period).thinned(CYCLES * period / SAMPLES)
        self.short = replace(density.oscillator, campaign=short)
        self.guess, self.elsewhere = _at_excerpt(self.short, guess, period)
        refined = {n for e in density.oscillator.acting for n in further_sizes(e)}
        searched = [i for i in layout.roles("physical", "effect") if layout.names[i] not in refined]
        self.physical = np.array(searched, dtype=np.int64)
        self.logarithmic = lower[self.physical] > 0.0
        self.lower, self.upper = self._coded(lower), self._coded(upper)
        self.steps = STEP * np.maximum(np.maximum(np.abs(guess), np.abs(upper) * 1e-3), 1e-12)

    def _coded(self, theta: Array) -> Array:
        values = theta[self.physical]
        return np.where(self.logarithmic, np.log(np.maximum(values, 1e-300)), values)

    def complete(self, x: Array) -> Array:
        """Parameter vectors (B, d) for search coordinates (B, p)."""
        theta = np.repeat(self.guess[None], x.shape[0], axis=0)
        powers = np.exp(np.where(self.logarithmic, x, 0.0))
        theta[:, self.physical] = np.where(self.logarithmic, powers, x)
        return theta

    def __call__(self, x: Array) -> Array:
        """Values (B,) at search coordinates (B, p)."""
        predicted = self.short.predict(self.complete(x))
        total, count = np.zeros(x.shape[0]), 0
        recordings = self.short.campaign.recordings
        for recording, rows, level in zip(recordings, predicted, self.levels, strict=True):
            residual = (recording.samples - rows) / level
            if recording.used is not None:
                residual = residual[:, recording.used]
            total += np.sum(residual**2, axis=1)
            count += residual.shape[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            value = 0.5 * count * np.log(total)
        return np.where(np.isfinite(value), value, np.inf)


def further_sizes(effect: Effect) -> list[str]:
    """Names of an effect's sizes beyond the first, where none is one of several.

    Without them it is a simpler law of the same kind, from which an ascent finds them; a search
    that looks for them too more often ends in a lesser mode.
    """
    sizes = [p for p in effect.parameters if p.is_size and p.null is not None]
    return [f"{effect.id}.{p.name}" for p in sizes[1:]]


def seen_displacements(campaign: Campaign) -> list[Recording]:
    """The displacements behind all recordings. Accelerations are largest in contact, and tell
    nothing of the reach as if they were of the free frequency.
    """
    return [seen_displacement(r, both=True) for r in campaign.recordings]


def usual_cycle(campaign: Campaign) -> float:
    """Duration of a cycle as recordings show it, s; between two stops far shorter than of free
    vibration, and many impacts at once have many side minima.
    """
    seen = seen_displacements(campaign)
    return float(np.median([spectral_period(r.samples) * r.interval for r in seen]))


def _at_excerpt(short: Oscillator, guess: Array, period: float) -> tuple[Array, list[int]]:
    """The guess (d,) with the states in which excerpts of driven recordings begin; their places."""
    moved, places = guess.copy(), []
    index = short.layout.index
    recordings = short.campaign.recordings
    for r, keeper in zip(recordings, keepers(recordings), strict=True):
        if r.input is not None and r.name == keeper:
            own = [index(f"y0[{r.name}]"), index(f"v0[{r.name}]")]
            samples = seen_displacement(r, both=True).samples
            if r.is_displacement:
                samples = samples - guess[index(f"offset[{r.name}]")]
            moved[own] = first_state(samples, r.interval, period / r.interval)
            places += own
    return moved, places


def _bounds(
    density: PosteriorDensity, estimates: Estimates, noise: Noise, scales: Scales
) -> tuple[Array, Array, Array]:
    """Guess and bounds of the search, (d,) each."""
    layout, priors = density.oscillator.layout, density.priors
    effects = density.oscillator.acting
    owners = {f"{e.id}.{p.name}": p for e in effects for p in e.parameters if p.fixed is None}
    refined = {name for effect in effects for name in further_sizes(effect)}
    guess, lower, upper = (np.zeros(layout.size) for _ in range(3))
    for i, parameter in enumerate(layout.parameters):
        bare = parameter.name.split("[")[0]
        if is_added(parameter.name):
            guess[i], lower[i], upper[i] = _range(owners[bare], scales)
            if bare in refined:
                guess[i] = owners[bare].null
        else:
            guess[i] = estimates.start(parameter.name, noise.level)
            lower[i], upper[i] = sorted((guess[i] / WIDE, guess[i] * WIDE))
            if bare == "g":
                lower[i], upper[i] = -0.2 * scales.amplitude, scales.amplitude
    beyond = (lower >= priors.upper) | (upper <= priors.lower)  # a stated prior that knows better
    lower = np.where(beyond, priors.lower, np.maximum(lower, priors.lower))
    upper = np.where(beyond, priors.upper, np.minimum(upper, priors.upper))
    return guess, lower, upper


def _range(parameter: EffectParameter, scales: Scales) -> tuple[float, float, float]:
    """Guess and bounds for an effect's parameter."""
    scale = parameter.scale(scales)
    if parameter.grid is not None:
        grid = parameter.grid(scales)
        return scale, 0.5 * float(grid.min()), float(grid.max())
    if parameter.lower >= 0.0:
        return scale, SIZES[0] * scale, SIZES[1] * scale
    return parameter.null or 0.0, -SIZES[1] * scale, SIZES[1] * scale
