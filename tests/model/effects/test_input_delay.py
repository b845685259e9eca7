"""An input that acts later than its column says, against an integrator with a finer clock."""

from __future__ import annotations

import numpy as np
import pytest
from driven_twin import driven_motion
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.model.oscillator import build_oscillator

VALUES = {"mass": 0.5, "c1": 0.6, "k1": 800.0, "y0": 1e-4, "v0": 0.01}
INTERVAL, FINER, LATE = 2e-3, 5, 2
"""The input acts LATE / FINER intervals late."""
NOISE = 5e-6


def recorded(count: int) -> Campaign:
    white = np.random.default_rng(4).standard_normal(count)
    force = 6.0 * np.convolve(white, np.ones(5) / 5, "same")
    places = np.arange(FINER * (count - 1) + 1) / FINER
    fine = np.interp(places, np.arange(count), force)
    motion, _ = driven_motion(VALUES, fine, INTERVAL / FINER)
    late = np.concatenate([[motion[0]], motion[FINER - LATE :: FINER]])
    return Campaign(
        "rig", 0.5, (Recording("a", "", late, INTERVAL, input=Input(force)),), stop=False
    )


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return recorded(600)


def test_readings_of_a_delayed_input(campaign: Campaign) -> None:
    oscillator = build_oscillator(campaign, (BY_ID["input_delay"],))
    known = {"c1": 0.6, "k1": 800.0, "y0[a]": 1e-4, "v0[a]": 0.01, "offset[a]": 0.0, "sigma": 1.0}
    known["input_delay.time"] = LATE / FINER * INTERVAL
    (read,) = oscillator.predict(np.array([known[n] for n in oscillator.layout.names]))
    measured = campaign.recordings[0].samples
    assert np.abs(read - measured)[1:].max() < 2e-4 * np.ptp(measured)
    without = build_oscillator(campaign)
    (plain,) = without.predict(np.array([known[n] for n in without.layout.names]))
    assert np.abs(plain - measured)[1:].max() > 1e-2 * np.ptp(measured)


def test_a_delay_is_named(campaign: Campaign) -> None:
    (one,) = campaign.recordings
    noise = NOISE * np.random.default_rng(10).standard_normal(one.samples.size)
    noisy = Recording("a", "", one.samples + 2e-4 + noise, INTERVAL, input=one.input)
    rig = Campaign("rig", 0.5, (noisy,), stop=False)
    found = diagnose(rig, rng=np.random.default_rng(0), search=False)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["input_delay"]
    sd = found.after.sd[found.after.names.index("input_delay.time")]
    truth = LATE / FINER * INTERVAL
    assert abs(found.after.value("input_delay.time") - truth) < 4.0 * sd < 0.05 * truth
