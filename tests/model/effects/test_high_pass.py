"""The high-pass of the measuring chain against its own equation in fine steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.limits import limits
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.score_test.directions import directions
from bayesimpact.diagnosis.score_test.scan import score_directions
from bayesimpact.inference.identify import Identification
from bayesimpact.model.measurement import high_passed, settling
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

EFFECT = BY_ID["sensor_high_pass"]
CORNER, FINER = 0.7, 16


def stepped(fine: np.ndarray, corner: float, interval: float, state: float) -> np.ndarray:
    """y - z by Heun's steps of z' = w (y - z) from `state`, on the samples themselves."""
    w, z, read = 2 * np.pi * corner, state, []
    for now, later in zip(fine, [*fine[1:], fine[-1]], strict=True):
        read.append(now - z)
        slope = w * (now - z)
        z += 0.5 * interval * (slope + w * (later - z - interval * slope))
    return np.array(read)


def fine_campaign(quantity: str) -> Campaign:
    return small_rig.record(
        chain=MeasuringChain(), rate=1000.0 * FINER, duration=1.5, quantity=quantity
    )


@pytest.mark.parametrize(("quantity", "error"), [("displacement", 2e-9), ("acceleration", 5e-3)])
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_readings_are_those_of_fine_steps(quantity, error, share):
    """Of impacts too: at 1 kHz a jump of an acceleration between samples counts for little."""
    fine = fine_campaign(quantity)
    thin = tuple(
        replace(r, samples=r.samples[::FINER], interval=FINER * r.interval) for r in fine.recordings
    )
    oscillator = build_oscillator(replace(fine, recordings=thin), [EFFECT])
    values = small_rig.true_values(offsets={}) | {"sensor_high_pass.corner": CORNER}
    states = {r.name: share * r.samples[0] for r in thin}
    for name, state in states.items():
        values[f"sensor_high_pass.rate[{name}]"] = 2 * np.pi * CORNER * state
        values[f"offset[{name}]"] = -state
    read = oscillator.predict(small_rig.vector(oscillator.layout, values))
    for one, whole, short in zip(read, fine.recordings, thin, strict=True):
        true = stepped(whole.samples, CORNER, whole.interval, states[whole.name])[::FINER]
        assert np.abs(one - true).max() < error
        assert np.abs(true - short.samples).max() > 0.02 * np.ptp(short.samples)


def test_without_a_corner_a_drift_is_left():
    t = np.arange(400) * 1e-3
    y = np.random.default_rng(1).standard_normal((2, t.size))
    rates = np.array([[0.0, 0.0], [0.0, 0.3]])
    np.testing.assert_allclose(EFFECT.observe(y, t, rates), y + rates[:, 1:] * t, rtol=1e-14)
    nearly = np.where([True, False], 1e-9, rates)
    np.testing.assert_allclose(EFFECT.observe(y, t, nearly), y + rates[:, 1:] * t, atol=1e-6)


def test_every_row_is_filtered_alone_and_a_failed_one_stays_failed():
    x = np.random.default_rng(2).standard_normal((3, 50))
    x[1] = np.nan
    found = high_passed(x, 3.0, 1e-3)
    assert np.isnan(found[1]).all()
    np.testing.assert_array_equal(found[2], high_passed(x[2], 3.0, 1e-3))


def test_a_line_settles_on_its_slope_over_the_corner():
    t = np.arange(4000) * 1e-3
    line = settling(np.array([2.0]), t)
    np.testing.assert_allclose(high_passed(t, 2.0, 1e-3), line, atol=1e-12)
    assert line[-1] == pytest.approx(1 / (4 * np.pi), rel=1e-12)


def test_the_score_knows_what_the_filter_had_settled_on(small: Identification):
    """And the limit of the corner is of corners alone."""
    scales = campaign_scales(small.fit)
    (direction,) = directions(small.fit, [EFFECT], scales)
    names = [r.name for r in small.fit.density.oscillator.campaign.recordings]
    rates = [f"sensor_high_pass.rate[{name}]" for name in names]
    assert direction.names == ("sensor_high_pass.corner", *rates)
    found = score_directions(small.fit, (direction,), rng=np.random.default_rng(0))
    (score,) = found.scores
    sizes = np.array([score.size[0], *[1e3 * score.size_sd[0]] * len(rates)])
    steep = replace(found, scores=(replace(score, size=sizes),))
    (limit,) = limits(small.fit, steep, scales)
    assert (limit.parameter, limit.unit) == ("corner", "Hz")
    assert limit.upper95 < abs(score.size[0]) + 4.0 * score.size_sd[0]


def test_a_state_that_moves_nothing_is_not_scored():
    """That of a law, which has no force at its null."""
    assert [p.name for p in BY_ID["presliding_friction"].scored] == ["force"]
    assert [p.name for p in EFFECT.scored] == ["corner", "rate"]
