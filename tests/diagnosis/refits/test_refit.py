"""Evidence against numerical integrals and importance sampling; refits recover what was planted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy import integrate, stats
from scipy.special import logsumexp

from bayesimpact.diagnosis.refits import refit as refits
from bayesimpact.diagnosis.refits.evidence import SHARED_SDS, log_evidence, shared_sd_evidence
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer
from bayesimpact.diagnosis.refits.refit import (
    TO_THE_MODE,
    Candidate,
    Enough,
    base_candidate,
    fit_from,
    or_by_stretches,
    refit,
    tempered_evidence,
    without,
)
from bayesimpact.diagnosis.score_test.directions import directions
from bayesimpact.diagnosis.score_test.scan import score_directions
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.identify import identify
from bayesimpact.inference.likelihood import Linearisation
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.prior import HalfNormal, LogNormal, LogUniform, Normal
from bayesimpact.inference.priors import Priors
from bayesimpact.model.parameters import Parameter


@dataclass
class Linear:
    """y = X beta + noise of unknown level, in place of an oscillator."""

    x: np.ndarray
    y: np.ndarray
    log_volume = np.array([0.0])
    steps = (0.0,)

    def __post_init__(self) -> None:
        self.sizes = np.array([float(self.y.size)])
        self.sigma_columns = np.array([self.x.shape[1]])
        kinds = [Parameter(f"b{i}", "", "physical") for i in range(self.x.shape[1])]
        self.parameters = (*kinds, Parameter("sigma", "", "noise", 0.0))

    @property
    def oscillator(self):
        def roles(*wanted: str) -> np.ndarray:
            return np.array([i for i, p in enumerate(self.parameters) if p.role in wanted])

        layout = SimpleNamespace(parameters=self.parameters, roles=roles)
        return SimpleNamespace(layout=layout, campaign=SimpleNamespace(stop=False))

    def residuals(self, theta: np.ndarray) -> tuple[np.ndarray, ...]:
        return (self.y - theta[:, :-1] @ self.x.T,)

    def residuals_and_sums(self, theta: np.ndarray) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
        return self.residuals(theta), self.misfit(theta)

    def misfit(self, theta: np.ndarray) -> np.ndarray:
        return np.sum(self.residuals(np.atleast_2d(theta))[0] ** 2, axis=1)[:, None]

    def linearise(
        self, theta: np.ndarray, steps: object = None, *, roughly: bool = False
    ) -> tuple[Linearisation, ...]:
        return (Linearisation(self.y - self.x @ theta[:-1], self.x, np.arange(theta.size - 1)),)


SIGMA = LogUniform(1e-3, 1e3)


def linear_fit(n: int, d: int, priors: list, seed: int = 0, shift: float = 0.0) -> Fit:
    """Shift moves the last coefficient's estimate by so many of its deviations."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((n, d)) @ (np.eye(d) + 0.3 * rng.standard_normal((d, d)))
    noise = rng.standard_normal(n)
    projector = x @ np.linalg.pinv(x)
    noise -= projector @ noise  # the estimate is the truth exactly
    beta = np.zeros(d)
    beta[-1] = shift * np.sqrt(np.linalg.inv(x.T @ x)[-1, -1]) * np.linalg.norm(noise) / np.sqrt(n)
    density = PosteriorDensity(Linear(x, x @ beta + noise), Priors((*priors, SIGMA)))
    return find_mode(density, np.append(np.zeros(d), 1.0), tolerance=1e-8)


def exact_log_evidence(fit: Fit) -> float:
    """Coefficients in closed form (one of them truncated at zero), the level by quadrature."""
    problem, priors = fit.density.likelihood, fit.density.priors.parameters[:-1]
    x, y = problem.x, problem.y
    mean = np.array([p.mean if isinstance(p, Normal) else 0.0 for p in priors])
    width = np.array([p.sd if isinstance(p, Normal) else p.scale for p in priors])
    half = isinstance(priors[-1], HalfNormal)
    q, r = np.linalg.qr(x)  # what the columns reach, and the rest: noise alone

    def log_density(log_sigma: float) -> float:
        sigma = np.exp(log_sigma)
        covariance = sigma**2 * np.eye(width.size) + (r * width**2) @ r.T
        value = stats.multivariate_normal(r @ mean, covariance).logpdf(q.T @ y)
        value += stats.norm(0, sigma).logpdf(0) * (y.size - width.size)
        value -= 0.5 * (y @ y - np.sum((q.T @ y) ** 2)) / sigma**2
        if half:  # twice the whole normal's, times the posterior mass above zero
            precision = x.T @ x / sigma**2 + np.diag(width**-2.0)
            posterior = np.linalg.inv(precision)
            centre = posterior @ (x.T @ y / sigma**2 + mean / width**2)
            spread = np.sqrt(posterior[-1, -1])
            value += np.log(2) + stats.norm.logcdf(centre[-1] / spread)
        return float(value - np.log(SIGMA._log_width))

    middle = np.log(fit.mode[-1])
    grid = middle + np.linspace(-6, 6, 41) / np.sqrt(2 * y.size)
    values = np.array([log_density(g) for g in grid])
    top = values.max()
    return float(top + np.log(integrate.simpson(np.exp(values - top), x=grid)))


def test_evidence_of_a_linear_model():
    fit = linear_fit(300, 4, [Normal(0.5, 2.0)] * 4)
    # the level's own skewness is of order d^2 / n
    assert log_evidence(fit) == pytest.approx(exact_log_evidence(fit), abs=0.03)


@pytest.mark.parametrize("known", [0.05, 1e3])
def test_evidence_counts_every_repeated_sample_once(known):
    """Likelihoods of samples that come seven times each, to the power 1/7, are those of one each;
    the first coefficient is known beforehand as well as from the samples, or not at all.
    """
    once = linear_fit(400, 2, [Normal(0.0, known), Normal(0.0, 1e3)], shift=3.0)
    x, y = once.density.likelihood.x, once.density.likelihood.y
    density = PosteriorDensity(Linear(np.tile(x, (7, 1)), np.tile(y, 7)), once.density.priors)
    often = find_mode(density, once.mode, tolerance=1e-8)
    tempered = tempered_evidence(Candidate((), often, log_evidence(often)), 7.0)
    assert tempered == pytest.approx(log_evidence(once), abs=0.01)


@pytest.mark.parametrize("shift", [6.0, 2.0, 0.7, 0.0, -0.7, -2.0, -6.0, -20.0])
def test_evidence_with_a_size_that_cannot_be_negative(shift):
    """From well inside over the bound to far beyond it."""
    fit = linear_fit(400, 3, [Normal(0.0, 3.0)] * 2 + [HalfNormal(1.5)], shift=shift)
    assert (fit.mode[2] == 0.0) == (shift < 0.0) or shift == 0.0
    assert log_evidence(fit) == pytest.approx(exact_log_evidence(fit), abs=0.05)


@pytest.mark.parametrize("known", [0.05, 0.3, 1.0, 3.0, 100.0])
def test_evidence_with_a_log_normal_prior(known):
    """A shape parameter, from sharply known to not at all; its density is convex in the tail.

    One coefficient of 2 with a standard error of `known`, its prior about 1 with 1.5 in the log.
    """
    n, rng, prior = 400, np.random.default_rng(3), LogNormal(1.0, 1.5)
    x = rng.standard_normal((n, 1))
    x /= np.linalg.norm(x) * known
    noise = rng.standard_normal(n)
    noise -= x[:, 0] * (x[:, 0] @ noise) / (x[:, 0] @ x[:, 0])
    density = PosteriorDensity(Linear(x, 2.0 * x[:, 0] + noise), Priors((prior, SIGMA)))
    fit = find_mode(density, np.array([1.0, 1.0]), tolerance=1e-8)
    grid = np.exp(np.linspace(-12, 12, 4001))  # the coefficient; the level by its own quadrature
    sums = density.likelihood.misfit(np.column_stack([grid, grid]))[:, 0]
    level = np.exp(np.linspace(-0.3, 0.3, 121)) * fit.mode[1]
    table = -n * np.log(level) - sums[:, None] / (2 * level**2) - 0.5 * n * np.log(2 * np.pi)
    table += prior.log_density(grid)[:, None] + np.log(grid)[:, None] - np.log(SIGMA._log_width)
    inner = integrate.simpson(np.exp(table - table.max()), x=np.log(level), axis=1)
    expected = table.max() + np.log(integrate.simpson(inner, x=np.log(grid)))
    assert log_evidence(fit) == pytest.approx(expected, abs=0.25)


def importance(fit: Fit, count: int, seed: int = 0, freedom: float = 12.0) -> tuple[float, float]:
    """Log evidence and its standard error from a multivariate t about the mode."""
    rng = np.random.default_rng(seed)
    proposal = stats.multivariate_t(np.zeros(fit.mode.size), _unit(fit), df=freedom)
    z = proposal.rvs(count, random_state=rng)
    weights = fit.density(fit.mode + z * fit.sd) - proposal.logpdf(z) + np.log(fit.sd).sum()
    value = logsumexp(weights) - np.log(count)
    relative = np.exp(weights - value)
    return float(value), float(relative.std() / np.sqrt(count))


def _unit(fit: Fit) -> np.ndarray:
    return fit.covariance / np.outer(fit.sd, fit.sd)


def test_evidence_of_the_rig_by_importance_sampling(small):
    value, error = importance(small.fit, 3000)
    assert error < 0.05
    assert log_evidence(small.fit) == pytest.approx(value, abs=0.03 + 4 * error)


@pytest.fixture(scope="module")
def planted():
    """Friction of 0.4 mN, concealed: the base fit, its scores and its scales."""
    campaign = small_rig.record(6, {"coulomb_friction": {"force": 4e-4}}, duration=1.5)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    return fit, campaign_scales(fit)


def score_of(fit, scales, effect_id):
    found = directions(fit, [BY_ID[effect_id]], scales)
    return score_directions(fit, found, rng=np.random.default_rng(0)).best()[0]


def test_a_refit_finds_what_was_planted(planted):
    fit, scales = planted
    score = score_of(fit, scales, "coulomb_friction")
    found = refit(fit, [score], scales)
    assert found.ids == ("coulomb_friction",) and found.fit.converged
    size = found.fit.value("coulomb_friction.force")
    sd = found.fit.sd[found.fit.names.index("coulomb_friction.force")]
    assert abs(size - 4e-4) < 4 * sd
    assert score.z > 6 and abs(score.size[0] - size) < 0.1 * size
    truth = small_rig.true_values()
    for name in ("c1", "k1", "c2", "g", "k2[1]", "k2[2]"):
        i = found.fit.names.index(name)
        assert abs(found.fit.mode[i] - truth[name]) < 4 * found.fit.sd[i]
    # evidence: half of z^2 less Occam's share
    base = base_candidate(fit)
    scale = BY_ID["coulomb_friction"].parameters[0].scale(scales)
    z = size / sd
    occam = np.log(2 / np.sqrt(2 * np.pi) / scale) + np.log(np.sqrt(2 * np.pi) * sd)
    expected = 0.5 * z**2 + occam
    assert found.log_evidence - base.log_evidence == pytest.approx(expected, abs=0.05 * z**2 + 1)


def test_ascents_are_told_when_they_are_near_enough(planted, monkeypatch):
    fit, scales = planted
    scores, asked = [score_of(fit, scales, "coulomb_friction")], []
    found = refit(fit, scores, scales)

    def ascended(density, start, **options):
        asked.append(options["least_gain"])
        return found.fit

    monkeypatch.setattr(refits, "find_mode", ascended)
    for enough, least in ((TO_THE_MODE, 0.0), (Enough(least_gain=2.0), 2.0)):
        refit(fit, scores, scales, enough=enough)
        without(found, BY_ID["coulomb_friction"], scales, enough=enough)
        assert set(asked) == {least}
        asked.clear()


def test_evidence_of_an_added_effect_by_importance_sampling(planted):
    fit, scales = planted
    found = refit(fit, [score_of(fit, scales, "coulomb_friction")], scales)
    value, error = importance(found.fit, 600)
    assert error < 0.15
    assert found.log_evidence == pytest.approx(value, abs=0.05 + 4 * error)


def test_leaving_an_effect_out_returns_to_the_base_model(planted):
    fit, scales = planted
    found = refit(fit, [score_of(fit, scales, "coulomb_friction")], scales)
    back = without(found, BY_ID["coulomb_friction"], scales)
    assert back.ids == ()
    assert back.log_evidence == pytest.approx(base_candidate(fit).log_evidence, abs=0.02)
    np.testing.assert_array_less(np.abs(back.fit.mode - fit.mode) / fit.sd, 0.1)


def off_the_mode(fit, factor):
    """A start with another frequency, and the difference steps of the mode."""
    theta = fit.mode.copy()
    theta[fit.names.index("k1")] *= factor
    return theta, 0.05 * np.where(fit.sd > 0, fit.sd, 1e-9)


def test_no_ascent_follows_stretches_that_come_out_higher(planted, monkeypatch):
    fit, _ = planted
    start, steps = off_the_mode(fit, 1.02)
    ascents = []

    def counted(density, *args, **options):
        ascents.append(density)
        return find_mode(density, *args, **options)

    monkeypatch.setattr(refits, "find_mode", counted)
    assert or_by_stretches(fit, start, steps) is fit
    assert not ascents


def test_an_effect_that_kept_the_motion_bounded_may_be_left_out(planted):
    """A softening spring that a hardening one outweighs: alone it lets the mass run away."""
    fit, scales = planted
    effects = (BY_ID["spring_cubic"], BY_ID["spring_quintic"])
    density = extend(fit, effects, scales)
    theta = transfer(fit, density.oscillator.layout, effects, scales, {})
    names = density.oscillator.layout.names
    k1, reach = fit.value("k1"), scales.amplitude
    theta[names.index("spring_cubic.stiffness")] = 3.0 * k1 / reach**2
    theta[names.index("spring_quintic.stiffness")] = -3.0 * k1 / reach**4
    steps = 1e-6 * np.maximum(np.abs(theta), 1e-6)
    there = find_mode(density, theta, steps=steps, max_iterations=0)
    assert np.isfinite(there.log_posterior)
    alone = without(Candidate(effects, there, 0.0), effects[0], scales)
    assert np.isfinite(alone.log_evidence)
    assert alone.fit.log_likelihood > fit.log_likelihood - 1


def test_what_was_not_fitted_has_no_evidence(small):
    assert log_evidence(replace(small.fit, log_posterior=-np.inf)) == -np.inf
    nan = np.full_like(small.fit.covariance, np.nan)
    assert log_evidence(replace(small.fit, covariance=nan)) == -np.inf


@pytest.mark.parametrize(("spread", "away"), [(0.0, 0.3), (0.02, 0.3), (1.0, 0.3), (0.5, 6.0)])
def test_values_that_share_a_standard_deviation(spread, away):
    """Three gaps, measured to one thousandth of the prior's width: two grids over all three, their
    mean anywhere in an interval of 500.
    """
    width, error, mean = 2.0, 0.002, 5.0
    truth = mean + away + spread * np.array([1.0, -0.4, -0.7])
    precision = np.full((3, 3), -0.3) / error**2 + np.eye(3) * 1.3 / error**2
    posterior = np.linalg.inv(precision + np.eye(3) / width**2)
    mode = posterior @ (precision @ truth + mean / width**2)
    measured = np.linalg.inv(precision)

    def exact(centre: float, prior: np.ndarray) -> float:  # of what was measured under a prior
        return float(stats.multivariate_normal([centre] * 3, prior + measured).logpdf(truth))

    def over_means(tau: float) -> float:
        best, half = float(truth.mean()), 8 * (tau + 2 * error)
        means = np.linspace(best - half, best + half, 301)
        found = [exact(m, tau**2 * np.eye(3)) for m in means]
        return float(logsumexp(found) + np.log(means[1] - means[0]) - np.log(500.0))

    prior = Normal(mean, width)
    found = shared_sd_evidence(mode, posterior, prior, -np.log(500.0))
    shared = [over_means(tau) for tau in SHARED_SDS * width]
    expected = logsumexp(shared) - np.log(SHARED_SDS.size) - exact(mean, width**2 * np.eye(3))
    assert found == pytest.approx(expected, abs=0.02)
    # small differences are not punished, nor values that are all far away
    assert (found > 5) == (spread == 0.0 or away > 1.0), found


def test_the_evidence_of_values_of_one_kind_hardly_depends_on_where_their_priors_were():
    """Two ways to one model begin at base values that differ."""
    error, truth = 1e-3, np.array([0.96, 0.42])
    totals = []
    for mean, width in ((0.14, 5.0), (0.5, 15.0), (0.7, 20.0)):
        precision = np.eye(2) / error**2
        posterior = np.linalg.inv(precision + np.eye(2) / width**2)
        mode = posterior @ (precision @ truth + mean / width**2)
        alone = stats.multivariate_normal([mean] * 2, (width**2 + error**2) * np.eye(2))
        own = shared_sd_evidence(mode, posterior, Normal(mean, width), -np.log(20.0))
        totals.append(alone.logpdf(truth) + own)
    assert np.ptp(totals) < 1.0


def test_dampings_far_from_the_base_fit_s_are_no_less_likely():
    """A base fit with a large misfit has a c2 that means little, and a law that takes a part of
    every c2 upon itself, as a fast relaxation does, gains nothing by bringing them nearer to it.
    """
    planted = {"contact_damping_per_case": {"c2": {"1": 6.0, "2": 4.0}}}
    base = identify(small_rig.record(2, planted), rng=np.random.default_rng(0), search=False).fit
    wrong = base.mode.copy()
    wrong[base.names.index("c2")] *= 0.1
    scales = campaign_scales(replace(base, mode=wrong))
    own = (BY_ID["contact_damping_per_case"],)
    near = fit_from(base, own, {}, scales)
    far = fit_from(replace(base, mode=wrong), own, {}, scales)
    assert far.log_evidence == pytest.approx(near.log_evidence, abs=0.1)
    fast = {"contact_relaxation.stiffness": 3000.0, "contact_relaxation.time": 1e-3}
    relaxed = fit_from(far.fit, (*own, BY_ID["contact_relaxation"]), fast, scales)
    assert relaxed.log_evidence < far.log_evidence


def test_a_value_that_nothing_was_measured_of_changes_nothing():
    """An obstacle that was never touched: its value is its prior."""
    posterior, prior = np.diag([1e-6, 1e-6, 4.0]), Normal(5.0, 2.0)
    with_it = shared_sd_evidence(np.array([5.0, 5.001, 5.0]), posterior, prior, -3.0)
    without_it = shared_sd_evidence(np.array([5.0, 5.001]), posterior[:2, :2], prior, -3.0)
    assert with_it == pytest.approx(without_it, abs=0.02)


@pytest.mark.parametrize("effect_id", ["gap_per_recording", "contact_damping_per_case"])
def test_values_of_their_own_gain_nothing_on_a_control(small, effect_id):
    """Nor does the common mean: it keeps the prior of the parameter that it replaces."""
    scales, base = campaign_scales(small.fit), base_candidate(small.fit)
    found = directions(small.fit, [BY_ID[effect_id]], scales)
    score = score_directions(small.fit, found, rng=np.random.default_rng(0)).best()[0]
    candidate = refit(small.fit, [score], scales)
    assert -4 < candidate.log_evidence - base.log_evidence < 1
    slot = {"gap_per_recording": "g", "contact_damping_per_case": "c2"}[effect_id]
    assert set(candidate.fit.density.replaced) == {slot}
    back = without(candidate, BY_ID[effect_id], scales)
    assert back.log_evidence == pytest.approx(base.log_evidence, abs=1e-3)


def test_an_ascent_from_given_values_ends_where_it_will_not_reach_its_goal(planted):
    fit, scales = planted
    friction, start = (BY_ID["coulomb_friction"],), {"coulomb_friction.force": 4e-3}
    whole = fit_from(fit, friction, start, scales)
    told = fit_from(fit, friction, start, scales, goal=whole.fit.log_likelihood + 1e7)
    assert told.fit.iterations < whole.fit.iterations
    within = fit_from(fit, friction, start, scales, goal=whole.fit.log_likelihood - 10.0)
    assert within.log_evidence == pytest.approx(whole.log_evidence, abs=0.01)
