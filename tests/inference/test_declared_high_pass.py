"""Recordings that came through a high-pass whose corner campaign.toml states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.inference.identify import identify
from bayesimpact.inference.initial.high_pass import campaign_before_high_pass
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

NOISE = {"displacement": 5e-6, "velocity": 2e-4, "acceleration": 2e-2}
FINER = 8


def passed(corner: float, quantity: str = "displacement", share: float = 0.0) -> Campaign:
    """The small rig's recordings after a high-pass that had settled on a `share` of their first
    reading, by exponential steps of the finer motion.
    """
    fine = small_rig.record(
        chain=MeasuringChain(), rate=1000.0 * FINER, duration=1.5, quantity=quantity
    )
    rng, recordings = np.random.default_rng(5), []
    for r in fine.recordings:
        kept = np.exp(-2 * np.pi * corner * r.interval)
        constants = [share * r.samples[0]]
        for middle in 0.5 * (r.samples[1:] + r.samples[:-1]):
            constants.append(middle + kept * (constants[-1] - middle))
        read = (r.samples - constants)[::FINER] + 3 * NOISE[quantity]
        read = read + NOISE[quantity] * rng.standard_normal(read.size)
        recordings.append(replace(r, samples=read, interval=FINER * r.interval, high_pass=corner))
    return replace(fine, recordings=tuple(recordings))


@pytest.mark.parametrize("smoothing", [None, Smoothing("savgol", 11, 2)])
def test_derivatives_are_those_of_the_readings(smoothing: Smoothing | None) -> None:
    campaign = passed(0.7)
    free = tuple(replace(r, free_gain=r.name == "b") for r in campaign.recordings)
    made = build_oscillator(replace(campaign, recordings=free), smoothing=smoothing)
    values = small_rig.true_values() | {"gain[b]": 1.1}
    values |= {f"high_pass_state[{n}]": 1e-3 for n in "abc"}
    theta = small_rig.vector(made.layout, values)
    parts = Likelihood(made, Noise(level=1.0)).linearise(theta)
    for r, part in enumerate(parts):
        assert {f"high_pass_state[{'abc'[r]}]", f"offset[{'abc'[r]}]"} <= {
            made.layout.names[i] for i in part.columns
        }
        for i, found in zip(part.columns, part.jacobian.T, strict=True):
            step = 1e-6 * max(abs(theta[i]), 1e-3)
            points = np.repeat(theta[None], 2, axis=0)
            points[:, i] += [step, -step]
            up, down = made.predict_recording(r, points)
            expected = (up - down) / (2 * step)
            assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max() + 1e-12


@pytest.mark.parametrize(
    ("corner", "quantity", "share"),
    [
        (0.3, "displacement", 1.0),
        (2.0, "displacement", 0.3),
        (1.0, "velocity", 0.0),
        (1.0, "acceleration", 0.0),
    ],
)
def test_a_stated_corner_leaves_nothing(corner: float, quantity: str, share: float) -> None:
    campaign = passed(corner, quantity, share)
    found = identify(campaign, rng=np.random.default_rng(0))
    fit, truth = found.fit, small_rig.true_values()
    assert 0.9 < fit.reduced_chi2 < 1.1
    for name in ("c1", "k1", "c2", "g", "k2[1]", "k2[2]", "y0[a]", "v0[c]"):
        sd = fit.sd[fit.names.index(name)]
        assert abs(fit.value(name) - truth[name]) < 4.0 * sd, name
    unstated = tuple(replace(r, high_pass=0.0) for r in campaign.recordings)
    other = identify(
        replace(campaign, recordings=unstated), rng=np.random.default_rng(0), search=False
    )
    assert other.fit.reduced_chi2 > 4.0


def test_without_a_corner_a_campaign_is_itself() -> None:
    campaign = small_rig.record()
    assert campaign_before_high_pass(campaign) is campaign
    assert not any("high_pass" in n for n in build_oscillator(campaign).layout.names)


def test_what_came_into_a_filter_is_the_motion_up_to_a_constant() -> None:
    campaign, truth = passed(0.3, share=1.0), small_rig.record(chain=MeasuringChain(), duration=1.5)
    for before, true in zip(
        campaign_before_high_pass(campaign).recordings, truth.recordings, strict=True
    ):
        assert before.high_pass == 0.0
        left = before.samples - true.samples
        t = true.times - true.times.mean()
        drift = (t @ left) / (t @ t)  # of the offset, which is a line before the filter
        assert np.std(left - drift * t) < 0.01 * np.ptp(true.samples)
