"""Fits to readings in coarse steps: what these leave is no line, no mode and no law."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.parametric_bootstrap import simulated
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_force
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.inference import likelihood
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED
from bayesimpact.model.rounding import Rounding
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release

STEP, DITHER = 2e-4, 0.2


def decays(seed: int, effects=None, releases=small_rig.PLAIN_RELEASES) -> Campaign:
    """Plain decays down to a few steps, read by an encoder."""
    chain = MeasuringChain(noise=DITHER * STEP, offsets=small_rig.OFFSETS, rounding=STEP)
    return small_rig.record(
        seed, effects, rig=small_rig.PLAIN, releases=releases, chain=chain,
        duration=30.0, rate=200.0,
    )  # fmt: skip


def fitted(campaign: Campaign):
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_steps_leave_is_told_by_their_average(seed, monkeypatch):
    fit = fitted(decays(seed))
    found = fit.density.likelihood.rounding(0, fit.seen[0])
    assert found is not None and found.noise == pytest.approx(DITHER * STEP, rel=0.1)
    assert fit.reduced_chi2 == pytest.approx(1.0, abs=0.06)
    monkeypatch.setattr(likelihood, "coarse_step", lambda recording, level: 0.0)
    assert fit.log_likelihood > fitted(decays(seed)).log_likelihood + 50.0


def test_the_lines_that_steps_make_of_a_steady_motion_are_no_hum(monkeypatch):
    """A force that moves the mass by some steps to the end of the recordings."""
    shaking = {"amplitude": 0.05, "frequency": 10.0}
    releases = (Release("a", "", -1e-3), Release("b", "", 1.5e-3))
    campaign = decays(4, {"harmonic_forcing": {**shaking, "phase": 1.0}}, releases)
    phases = {f"phase[{r.name}]": 1.0 for r in releases}
    start = {f"harmonic_forcing.{n}": v for n, v in {**shaking, **phases}.items()}

    def left() -> float:
        base = fitted(campaign)
        scales = campaign_scales(base)
        found = fit_from(base, (BY_ID["harmonic_forcing"],), start, scales).fit
        return scan(found, SEARCHED, scales, rng=np.random.default_rng(0)).p_value

    assert left() > 1e-6
    monkeypatch.setattr(likelihood, "coarse_step", lambda recording, level: 0.0)
    assert left() < 1e-12


def test_derivatives_go_through_the_steps():
    """The slope of what an ascent lowers, two standard deviations from the mode."""
    fit = fitted(decays(4))
    own, sign = fit.density.likelihood, np.resize([2.0, -2.0, 2.0], fit.mode.size)
    theta = fit.mode + sign * fit.sd * (fit.sd < 0.5 * np.abs(fit.mode).clip(1e-9))
    assert isinstance(own.rounding(0, fit.seen[0]), Rounding)

    def square(at: np.ndarray) -> float:
        return float(own.misfit(at).sum())

    for name in ("k1", "c1", "y0[a]", "v0[b]", "offset[a]"):
        i = fit.names.index(name)
        step = np.zeros(fit.mode.size)
        step[i] = 0.05 * fit.sd[i]
        slope = (square(theta + step) - square(theta - step)) / (2 * step[i])
        told = sum(
            -2.0 * float(part.jacobian[:, part.columns == i].sum(axis=1) @ part.residual)
            for part in own.linearise(theta)
        )
        assert told == pytest.approx(slope, rel=0.05), name


def test_a_simulated_campaign_comes_in_the_same_steps():
    fit = fitted(decays(5))
    again = simulated(fit, np.random.default_rng(1))
    for recording, seen in zip(again.recordings, fit.seen, strict=True):
        steps = recording.samples / STEP
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
        error = (recording.samples - seen) / STEP
        assert np.std(error) == pytest.approx(np.sqrt(1 / 12 + DITHER**2), rel=0.08)


def encoder(seed: int) -> Campaign:
    """Impacts that pass many steps within a few samples, with a tenth of a step of noise."""
    chain = MeasuringChain(noise=1.2e-6, offsets=small_rig.OFFSETS, rounding=1e-5)
    return small_rig.record(seed, chain=chain)


def test_intervals_of_coarse_readings_hold_the_truth_as_often_as_they_say():
    """Least squares about the average took the readings for twice as telling as they are: squares
    of errors in standard deviations, 1 on average, were 2, and every second control was doubted.
    """
    truth, seeds = small_rig.true_values(), range(12)
    squares, doubted = [], 0
    for seed in seeds:
        fit = fitted(encoder(seed))
        told = [n for n in fit.names if n in truth and n != "sigma"]
        sd = [fit.sd[fit.names.index(n)] for n in told]
        errors = np.array([fit.value(n) - truth[n] for n in told]) / sd
        squares.append(float(np.mean(errors**2)))
        force = missing_force(fit, campaign_scales(fit), rng=np.random.default_rng(seed))
        doubted += force.p_value < 0.02
    assert np.mean(squares) == pytest.approx(1.0, abs=0.5)  # three standard errors of 12 seeds
    assert doubted <= 2  # of 12 at 0.02: three and more have a chance of 0.0015
