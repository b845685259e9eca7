"""What remains as a function of time: its likelihood, its size, and what it does to parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from scipy import stats
from scipy.optimize import minimize

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.intervals import intervals
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import base_candidate, fit_from
from bayesimpact.diagnosis.residual_force import discrepancy as module
from bayesimpact.diagnosis.residual_force import marginal
from bayesimpact.diagnosis.residual_force.discrepancy import UNDERRATED, Discrepancy, discrepancy
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_force
from bayesimpact.diagnosis.residual_force.marginal import log_evidence_gain
from bayesimpact.diagnosis.selection.unknown import learn_force
from bayesimpact.diagnosis.thresholds import DECISIVE, EXCESS
from bayesimpact.inference.ascent import Ascent
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.linear_response.free_changes import motions_beside

NOISE = small_rig.NOISE


def left_by(fit) -> Discrepancy:
    found = discrepancy(fit)
    assert found is not None
    return found


def plain_fit(campaign: Campaign):
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def shaken(seed: int, size: float, duration: float = 4.0, effects=None) -> Campaign:
    """A plain decay with a random force, linear between knots an eighth of a period apart, N."""
    clean = small_rig.record(
        seed, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=duration
    )
    fit = plain_fit(clean)
    o, rng = fit.density.oscillator, np.random.default_rng(1000 + seed)
    recordings = []
    for r, recording in enumerate(clean.recordings):
        t = recording.times
        knots = np.linspace(0.0, t[-1], int(8 * t[-1] * 6.38) + 1)
        wave = np.interp(t, knots, size * rng.standard_normal(knots.size))
        q = o.layout.slots(fit.mode)[[r]]
        moved, still = (
            motions_beside(o, r, q, 0, waves=w[None])[0] for w in (wave, np.zeros_like(wave))
        )
        recordings.append(replace(recording, samples=recording.samples + moved - still))
    return replace(clean, recordings=tuple(recordings))


def test_the_likelihood_is_that_of_a_dense_covariance():
    campaign = small_rig.record(
        3, {"spring_cubic": {"stiffness": 1e5}}, rig=small_rig.PLAIN,
        releases=small_rig.PLAIN_RELEASES[:1], duration=1.5,
    )  # fmt: skip
    found = left_by(plain_fit(campaign))
    fit = found.fit
    lin, part = fit.linearisation[0], found.parts[0]
    level = fit.density.likelihood.noise.level
    jacobian, residual = lin.jacobian / level, lin.residual / level

    def value(k: float, level: float) -> float:
        dense = level**2 * (np.eye(residual.size) + k * part.responses @ part.responses.T)
        solve = np.linalg.inv(dense)
        x = np.linalg.solve(jacobian.T @ solve @ jacobian, jacobian.T @ solve @ residual)
        left = residual - jacobian @ x
        return -0.5 * float(left @ solve @ left + np.linalg.slogdet(dense)[1])

    best = value(found.k, found.level)
    for k, w in ((1.3, 1.0), (0.75, 1.0), (1.0, 1.02), (1.0, 0.98)):
        assert value(k * found.k, w * found.level) < best
    other = value(4 * found.k, found.level) - best
    assert other < -1.0


def test_the_gain_is_that_of_a_dense_covariance():
    """Laplace's method with the full covariance of force and noise, their sizes at their best;
    the level is taken where it would be for fixed parameters, which d^2 / N nats may tell.
    """
    fit = plain_fit(shaken(2, 1e-2, duration=1.0))
    found, density = left_by(fit), fit.density
    free = density.oscillator.layout.roles("physical", "effect", "nuisance")
    noise = density.oscillator.layout.roles("noise")
    level = density.likelihood.noise.level
    size = sum(lin.residual.size for lin in fit.linearisation)
    jacobian, residual, first = np.zeros((size, fit.mode.size)), np.zeros(size), 0
    shape = np.zeros((size, size))
    for part, lin in zip(found.parts, fit.linearisation, strict=True):
        rows = slice(first, first := first + lin.residual.size)
        jacobian[rows, lin.columns], residual[rows] = lin.jacobian, lin.residual
        shape[rows, rows] = part.responses @ part.responses.T
    jacobian[:, noise] = 0.0
    information = np.diag(density.priors.information(fit.mode))[np.ix_(free, free)]
    principal, axes = np.linalg.eigh(shape)  # one decomposition inverts all these covariances
    jacobian, residual = axes.T @ jacobian, axes.T @ residual

    def evidence(log_k: float, log_w: float) -> float:
        variance = np.exp(2 * log_w) * level**2 * (1.0 + np.exp(log_k) * principal)
        solved = (jacobian[:, free] / variance[:, None]).T
        precision = solved @ jacobian[:, free] + information
        change = np.zeros(fit.mode.size)
        slope = np.nan_to_num(density.priors.gradient(fit.mode))[free]
        change[free] = np.linalg.solve(precision, solved @ residual + slope)
        left = residual - jacobian @ change
        prior = np.ravel(density.priors.log_density((fit.mode + change)[None]))[0]
        chance = left @ (left / variance) + np.log(2 * np.pi * variance).sum()
        return float(prior - 0.5 * (chance + np.linalg.slogdet(precision)[1]))

    start = np.log([found.k, found.level])
    best = minimize(lambda x: -evidence(*x), start, method="Nelder-Mead")
    alone = fit.log_likelihood + np.ravel(density.priors.log_density(fit.mode[None]))[0]
    alone += 0.5 * np.linalg.slogdet(fit.covariance[np.ix_(free, free)])[1]
    volume = float(np.sum(density.likelihood.log_volume))
    expected = -best.fun + volume - alone
    assert log_evidence_gain(fit, found.parts) == pytest.approx(
        expected, abs=max(0.1, free.size**2 / size)
    )
    assert expected > 100.0


def test_a_law_that_is_there_leads_a_force_of_time_and_a_false_one_does_not():
    """Shaken by a random force, a cubic spring is seen by its own odds beside that force; with no
    such spring the law gains by accident what many samples make of it.
    """
    for stiffness, needed in ((2e6, True), (0.0, False)):
        campaign = shaken(5, 1e-2, effects={"spring_cubic": {"stiffness": stiffness}})
        fit = plain_fit(campaign)
        cubic = next(e for e in EFFECTS if e.id == "spring_cubic")
        with_it = fit_from(fit, (cubic,), {}, campaign_scales(fit))
        beside = left_by(with_it.fit)
        odds = with_it.log_evidence - base_candidate(fit).log_evidence
        odds += log_evidence_gain(with_it.fit, beside.parts) - log_evidence_gain(fit, beside.parts)
        assert (odds > DECISIVE) == needed, (stiffness, odds)


@pytest.mark.parametrize("size", [2e-3, 2e-2])
def test_a_random_force_is_sized_and_the_noise_beside_it_found(size):
    found = left_by(plain_fit(shaken(1, size)))
    knots = sum(part.squares.size for part in found.parts)
    error = 3.0 / np.sqrt(2 * knots)  # of a standard deviation that so many values tell
    assert np.sqrt(found.k) * found.level == pytest.approx(size, rel=error)
    assert found.level == pytest.approx(1.0, abs=0.05)


def test_an_error_of_the_readings_is_no_force():
    """Every tenth reading is off by ten times the noise: no smooth force leaves noise there."""
    campaign = shaken(1, 1e-2, duration=2.0)
    assert left_by(plain_fit(campaign)).leaves_noise
    wrong = []
    for recording in campaign.recordings:
        samples = recording.samples.copy()
        samples[::10] += 10 * NOISE * np.random.default_rng(1).standard_normal(samples[::10].size)
        wrong.append(replace(recording, samples=samples))
    noise = plain_fit(campaign).density.likelihood.noise
    fit = plain_fit(replace(campaign, recordings=tuple(wrong)))
    likelihood = replace(fit.density.likelihood, noise=noise)
    fit = replace(fit, density=replace(fit.density, likelihood=likelihood))
    assert not left_by(fit).leaves_noise


def test_where_nothing_remains_nothing_is_added(small):
    found = left_by(small.fit)
    mean, covariance = found.posterior
    np.testing.assert_allclose(mean, small.fit.mode)
    ratio = np.sqrt(np.diag(covariance)) / small.fit.sd
    assert np.all((ratio > 0.9) & (ratio < 1.3)), ratio


@pytest.mark.long
def test_intervals_hold_the_truth_under_a_random_force():
    """Ordinary intervals do not: they count every sample of what the force left. The mode's own
    scatter is the force's, and the intervals are wider: it may also hide.
    """
    truth = {"c1": small_rig.PLAIN.c1, "k1": small_rig.PLAIN.k1}
    held, naive, z = 0, 0, []
    for seed in range(12):
        fit = plain_fit(shaken(seed, 1e-2, duration=2.0))
        wide, narrow = intervals(fit, remains=True), intervals(fit)
        scatter = np.sqrt(np.diag(left_by(fit).covariance))
        for name, value in truth.items():
            low, middle, high = wide.quantiles(name)
            held += low <= value <= high
            low, _, high = narrow.quantiles(name)
            naive += low <= value <= high
            z.append((middle - value) / scatter[fit.names.index(name)])
    assert stats.binomtest(held, len(z), 0.9, alternative="less").pvalue > 1e-3, held
    assert naive < 0.6 * len(z)
    spread = float(np.mean(np.square(z))) * len(z)
    assert stats.chi2.ppf(1e-3, len(z)) / 2 < spread < 2 * stats.chi2.ppf(1 - 1e-3, len(z)), z


def test_what_a_learned_force_has_of_spring_and_damper_is_given_back():
    """A force -a y - b v within a residual one, against k1 and c1 raised by a and b."""
    campaign = small_rig.record(4, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES)
    base = plain_fit(campaign)
    scales = campaign_scales(base)
    force = missing_force(base, scales, rng=np.random.default_rng(0))
    fit = learn_force(base, force, scales)
    names = fit.names
    moved = fit.mode.copy()
    knots = force.knots
    y = force.low + force.spacing * np.arange(-1, knots - 1)  # Greville points of cubic splines
    for i in range(knots):
        moved[names.index(f"learned_force.a{i + 1}")] -= 20.0 * y[i]
        moved[names.index(f"learned_force.b{i + 1}")] -= 0.05
    moved[names.index("k1")] += 20.0
    moved[names.index("c1")] += 0.05
    shifted = replace(fit, mode=moved)
    before, after = (left_by(f).posterior[0] for f in (fit, shifted))
    for name, scale in (("k1", 20.0), ("c1", 0.05)):
        assert after[names.index(name)] == pytest.approx(
            before[names.index(name)], abs=1e-3 * scale
        )


def test_what_a_remainder_hides_moves_parameters_of_one_kind_together():
    """The mean of two stiffnesses or of a gap's parts is no better known than each of them."""
    campaign = small_rig.record(3, {"spring_cubic": {"stiffness": 1e6}})
    left = left_by(plain_fit(campaign))
    hidden = left.posterior[1] - left.covariance
    names = list(left.fit.names)
    one, other, k1 = names.index("k2[1]"), names.index("k2[2]"), names.index("k1")
    assert hidden[one, one] > left.covariance[one, one] / 100 and hidden[k1, k1] > 0
    assert hidden[one, other] == pytest.approx(np.sqrt(hidden[one, one] * hidden[other, other]))
    assert hidden[one, k1] == pytest.approx(
        0.0, abs=1e-9 * np.sqrt(hidden[one, one] * hidden[k1, k1])
    )


def test_an_effect_that_is_not_there_is_not_apart():
    campaign = shaken(7, 1e-2)
    fit = plain_fit(campaign)
    drift = next(e for e in EFFECTS if e.id == "stiffness_drift")
    scales = campaign_scales(fit)
    false = fit_from(fit, (drift,), {}, scales).fit
    assert left_by(false).apart(drift) < 3.0
    at = false.names.index("stiffness_drift.rate")
    assert abs(false.mode[at]) / false.sd[at] > 3.0  # as far as independent samples tell


def test_a_law_whose_shape_may_be_one_of_the_base_model_is_not_apart():
    """A power of the speed that may be one is a part of c1, however sure its size."""
    fit = plain_fit(shaken(4, 1e-2))
    power = next(e for e in EFFECTS if e.id == "power_damping")
    start = {"power_damping.coefficient": 0.05, "power_damping.exponent": 2.0}
    left = left_by(fit_from(fit, (power,), start, campaign_scales(fit)).fit)
    names = list(left.fit.names)
    at = [names.index(f"power_damping.{name}") for name in ("coefficient", "exponent")]
    known = left.posterior[1][np.ix_(at, at)]
    size, shape = left.fit.mode[at]
    by_shape = abs(shape - 1.0) / known[1, 1] ** 0.5
    assert by_shape < 0.2 * size * np.linalg.inv(known)[0, 0] ** 0.5
    assert left.apart(power) == pytest.approx(by_shape)


def test_a_damper_beside_a_second_spring_is_no_second_spring():
    """Of two sizes the one that it is called by must be apart, however sure the other is."""
    planted = {"stiffness": 0.0, "gap": 3e-3, "damping": 1.0}
    plain = {"rig": small_rig.PLAIN, "releases": small_rig.PLAIN_RELEASES}
    fit = plain_fit(small_rig.record(3, {"spring_piecewise": planted}, **plain))
    effect = next(e for e in EFFECTS if e.id == "spring_piecewise")
    start = {f"spring_piecewise.{name}": value for name, value in planted.items()}
    left = left_by(fit_from(fit, (effect,), start, campaign_scales(fit)).fit)
    names, own = list(left.fit.names), left.posterior[1]
    stiffness, gap, damping = (names.index(f"spring_piecewise.{name}") for name in planted)

    def apart(i: int) -> float:
        known = np.linalg.inv(own[np.ix_([i, gap], [i, gap])])
        return abs(left.fit.mode[i]) * known[0, 0] ** 0.5

    assert apart(damping) > 10.0 > 3.0 > apart(stiffness)
    assert left.apart(effect) == pytest.approx(apart(stiffness))


@pytest.mark.parametrize("below", [4.0, 1.0, -3.0])
def test_what_may_not_ring_is_no_mode_that_is_apart(below: float):
    """However sure its size: below critical damping by less than its own error, or above it."""
    planted = {"frequency": 60.0, "damping": 0.05, "gain": 0.5}
    fit = plain_fit(small_rig.record(3, {"second_mode": planted}, duration=1.0))
    effect = next(e for e in EFFECTS if e.id == "second_mode")
    start = {f"second_mode.{name}": value for name, value in planted.items()}
    left = left_by(fit_from(fit, (effect,), start, campaign_scales(fit)).fit)
    assert left.apart(effect) > 4.0
    mean, covariance = left.posterior
    at = left.fit.names.index("second_mode.damping")
    mode = left.fit.mode.copy()
    mode[at] = 1.0 - below * covariance[at, at] ** 0.5
    damped = replace(left, fit=replace(left.fit, mode=mode))
    damped.__dict__["posterior"] = mean, covariance
    assert damped.apart(effect) == pytest.approx(below)


def test_a_motion_that_ran_away_has_none(small):
    """Intervals are then those of the fit, each independent sample counted once."""
    away = replace(small.fit, mode=np.where(np.isin(small.fit.names, "k1"), -1.0, small.fit.mode))
    assert discrepancy(away) is None
    ratio = np.diag(intervals(away, remains=True).covariance) / np.diag(small.fit.covariance)
    assert np.all(ratio >= 1.0)


def test_a_gain_does_not_depend_on_where_the_fit_ended():
    """Under the force the mode is far from the fit's: odds are those of that mode."""
    campaign = shaken(5, 1e-2, effects={"spring_cubic": {"stiffness": 2e6}})
    fit, cubic = plain_fit(campaign), next(e for e in EFFECTS if e.id == "spring_cubic")
    fit = fit_from(fit, (cubic,), {}, campaign_scales(fit)).fit
    found = left_by(fit)
    ascent, away = Ascent(fit.density, 0.05 * fit.sd, None, ()), fit.mode.copy()
    at = fit.names.index("spring_cubic.stiffness")
    away[at] += 300.0 * fit.sd[at]
    totals = []
    for start in (fit, ascent.fit(ascent.evaluate(away), True)):
        volume = 0.5 * np.linalg.slogdet(start.covariance)[1]
        totals.append(start.log_posterior + volume + log_evidence_gain(start, found.parts))
    assert totals[1] == pytest.approx(totals[0], abs=0.5)


def test_a_model_far_behind_is_weighed_to_first_order(monkeypatch):
    """The mode beside the force is sought where it may come near the likeliest model."""
    campaign = shaken(5, 1e-2, effects={"spring_cubic": {"stiffness": 2e6}})
    fit = plain_fit(campaign)
    cubic = next(e for e in EFFECTS if e.id == "spring_cubic")
    with_it = fit_from(fit, (cubic,), {}, campaign_scales(fit))
    found, alone = left_by(with_it.fit), base_candidate(fit).log_evidence
    whole = log_evidence_gain(fit, found.parts)
    ascended = []
    monkeypatch.setattr(
        marginal, "_ascended", lambda of, start: ascended.append(of) or marginal._stepped(
            of, start, marginal._simulated(of)
        )
    )  # fmt: skip
    leader = found.log_evidence_gain(with_it.fit, with_it.log_evidence) + with_it.log_evidence
    assert ascended == [with_it.fit]
    near = replace(found, _gains={with_it.fit: (alone + whole, 0.0)})
    near.log_evidence_gain(fit, alone)
    assert ascended == [with_it.fit, fit]
    far = replace(found, _gains={with_it.fit: (alone + whole + 2 * UNDERRATED, 0.0)})
    assert far.log_evidence_gain(fit, alone) == pytest.approx(whole, abs=UNDERRATED)
    assert ascended == [with_it.fit, fit] and np.isfinite(leader)


def test_fewer_knots_in_a_period_of_long_decays_follow_what_is_missing_too(monkeypatch):
    """Models are compared with as many knots each: of powers a factor of `EXCESS` counts."""
    decay = {"rig": small_rig.PLAIN, "releases": small_rig.PLAIN_RELEASES, "duration": 8.0}
    campaign = small_rig.record(3, {"quadratic_drag": {"coefficient": 0.5}}, **decay)
    fit = plain_fit(campaign)
    whole = left_by(fit)
    monkeypatch.setattr(module, "QUICK", 1)
    fewer = left_by(fit)
    cycles = 8.0 * np.sqrt(fit.value("k1") / campaign.mass) / (2 * np.pi)
    knots = [one.values[0].size - 1 for one in (whole, fewer)]
    assert knots == [int(np.ceil(8 * cycles)), int(np.ceil(4 * cycles))]
    assert whole.leaves_noise and fewer.leaves_noise
    assert 1 / EXCESS < fewer.power / whole.power < EXCESS


def test_at_a_stop_contacts_need_all_knots(monkeypatch):
    fit = plain_fit(small_rig.record(3, {"contact_power_law": {"exponent": 1.2}}))
    whole = left_by(fit)
    monkeypatch.setattr(module, "QUICK", 1)
    assert left_by(fit).values[0].size == whole.values[0].size > 8 * 2.0 * 6
