"""A zero that wanders is told from what motions and readings leave in the mean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bayesimpact as bi
from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.find import set_aside
from bayesimpact.data.faults.wander import without_wander
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording

INTERVAL, NOISE = 1e-3, 0.01
T = np.arange(4000) * INTERVAL


def decay(size: float = 5.0, frequency: float = 90.0, rate: float = 1.2) -> np.ndarray:
    return size * np.exp(-rate * T) * np.sin(2 * np.pi * frequency * T + 0.4)


def wander(seed: int) -> np.ndarray:
    """Slower than a period of the motion by a hundred times."""
    rng = np.random.default_rng(seed)
    parts = (0.6 / k * np.sin(k * np.pi / 3 * T + rng.uniform(0, 6)) for k in (1, 2))
    return sum(parts, 0.1 * T)


def recording(samples: np.ndarray, seed: int = 0, quantity: str = "acceleration") -> Recording:
    noise = NOISE * np.random.default_rng(seed).standard_normal(samples.size)
    return Recording("a", "", samples + noise, INTERVAL, quantity=quantity)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("steady", [False, True])
def test_a_wander_is_taken_off_and_told(seed: int, steady: bool) -> None:
    motion = decay(rate=0.0 if steady else 1.2) + decay(1.0, 251.0, 3.0) + decay(0.1, 15.0, 0.0)
    curve = wander(seed)
    given = recording(motion + curve, seed)
    left, notice = without_wander(given)
    assert notice is not None and notice.action == "notice"
    off = given.samples - left.samples - curve
    assert np.std(off) < 0.2 * np.std(curve)
    assert notice.size == pytest.approx(np.ptp(curve), rel=0.1)


def test_behind_a_stated_high_pass_a_zero_that_settles_stays() -> None:
    settles = 3.0 * np.exp(-2 * np.pi * 0.3 * T)
    given = recording(decay() + settles)
    assert without_wander(given)[1] is not None
    stated = replace(given, high_pass=0.3)
    assert without_wander(stated) == (stated, None)


def test_a_wander_larger_than_the_motion_is_taken_off_too() -> None:
    given = recording(decay() + 40 * wander(1))
    left, notice = without_wander(given)
    assert notice is not None
    assert np.std((left.samples - decay())[100:-100]) < 0.3


@pytest.mark.parametrize("seed", range(20))
def test_what_a_motion_or_its_reading_makes_stays(seed: int) -> None:
    """A curved reading, two near modes that beat, one far below, a drift, decays of all kinds."""
    rng = np.random.default_rng(100 + seed)
    frequency, rate = 10 ** rng.uniform(0.8, 2.2), 10 ** rng.uniform(-1.5, 0.8)
    x = decay(5.0, frequency, rate)
    other = decay(5.0, frequency * (1 + rng.uniform(0.01, 0.1)), rate)
    low = decay(3.0, frequency / rng.uniform(3, 12), rate)
    for samples in (x, x + 0.02 * x**2, x + other, x + low, x + 0.3 * T, x + 0.5 * np.sign(x)):
        for quantity in ("acceleration", "velocity"):
            assert without_wander(recording(samples, seed, quantity))[1] is None


def test_only_where_no_motion_could_make_it() -> None:
    given = recording(decay() + wander(0))
    assert without_wander(given)[1] is not None
    for other in (
        replace(given, quantity="displacement"),
        replace(given, case="1"),
        replace(given, input=Input(np.zeros(T.size))),
    ):
        assert without_wander(other) == (other, None)


def test_it_is_a_notice_and_kept_where_asked() -> None:
    given = recording(decay() + wander(0))
    campaign = Campaign("rig", 1.0, (given,), stop=False)
    cleaned, faults = set_aside(campaign)
    assert [f.id for f in faults] == ["recording_wander"]
    assert "its zero wanders" in cleaned.notes[0]
    same, _ = set_aside(replace(campaign, keep_faults=True))
    assert same.recordings[0] is given


def test_modes_are_told_beneath_a_wander() -> None:
    """A mode that the release excites is named, and nothing else."""
    samples = decay() + decay(1.0, 251.0, 3.0) + wander(2)
    campaign = Campaign("beam", 1.0, (recording(samples),), stop=False)
    found = bi.diagnose(campaign, seed=0, search=False)
    assert (found.verdict, [e.id for e in found.effects]) == ("named", ["released_mode"])
