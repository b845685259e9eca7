"""Readings of an acceleration beside the begin or the end of a contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import small_rig

from bayesimpact.diagnosis.faults.jumps import jumping_readings, without_readings
from bayesimpact.diagnosis.faults.outliers import refitted
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify

RNG = np.random.default_rng
DAMPED = replace(small_rig.RIG, c2=8.0)


def fitted(quantity: str, noise: float) -> Fit:
    chain = small_rig.Chain(noise=noise, offsets=dict.fromkeys("abc", 0.0))
    campaign = small_rig.record(
        5, rig=DAMPED, chain=chain, quantity=quantity, rate=2000.0, duration=3.0
    )
    return identify(campaign, rng=RNG(0), search=False).fit


def test_readings_that_jump_lie_beside_a_touch_or_a_release() -> None:
    fit = fitted("acceleration", 0.05)
    masks = jumping_readings(fit, RNG(1))
    count = sum(int(m.sum()) for m in masks)
    assert 0 < count < 40
    gap = fit.value("g")
    for mask, y in zip(masks, fit.displacements, strict=True):
        deep = y - gap
        change = np.abs(np.gradient(y))
        assert np.all(np.abs(deep[mask]) < 0.25 * change[mask])  # of the way of a sample


def test_without_them_the_same_mode_is_found_from_either_side() -> None:
    """Steps of the posterior lie between them, which no climb crosses."""
    fit = fitted("acceleration", 0.05)
    campaign = without_readings(fit.target.oscillator.campaign, jumping_readings(fit, RNG(1)))
    assert "beside jumps" in campaign.notes[-1]
    ends = []
    for start in fit.draws(RNG(2), 6):
        ends.append(refitted(fit, campaign, replace(fit, mode=start)).log_posterior)
    assert np.ptp(ends) < 0.01


def test_displacements_have_none() -> None:
    assert jumping_readings(fitted("displacement", 5e-6), RNG(1)) == ()


def test_draws_have_the_spread_of_the_approximation_whatever_the_units() -> None:
    """Of scales ten decades apart; standard errors of 2,000 draws."""
    fit = fitted("displacement", 5e-6)
    units = np.where(np.arange(fit.mode.size) % 2 == 0, 1e6, 1e-6)
    scaled = replace(fit, mode=units * fit.mode, covariance=fit.covariance * np.outer(units, units))
    count = 2000
    draws = scaled.draws(RNG(3), count, 2.0)
    z = (draws - scaled.mode) / scaled.sd
    expected = 4.0 * scaled.covariance / np.outer(scaled.sd, scaled.sd)
    error = np.sqrt((expected**2 + 16.0) / count)
    assert np.abs((z.T @ z / count - expected) / error).max() < 4.5
