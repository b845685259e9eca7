"""Drop-outs of a signal: stretches in which it leaves the motion and comes back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import small_rig

from bayesimpact.data.faults import dropouts
from bayesimpact.data.faults.dropouts import find_dropouts
from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.period import crossing_period
from bayesimpact.data.recording import Recording
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Effects

N, PERIOD = 6000, 105.0
SIGMA = 0.002


def decay(seed: int) -> np.ndarray:
    """A velocity that decays, with a hardening spring's harmonics, and noise; one is its first
    amplitude.
    """
    t, rng = np.arange(N), np.random.default_rng(seed)
    size = np.exp(-t / 3000.0)
    turn = 2 * np.pi * t / PERIOD * (1.0 + 0.02 * size**2)
    motion = size * np.cos(turn) + 0.03 * size**3 * np.cos(3 * turn)
    return np.asarray(motion + SIGMA * rng.standard_normal(N))


def found_in(x: np.ndarray, case: str = "") -> list[tuple[int, int]]:
    recording = Recording("a", case, x, 1e-4, quantity="velocity")
    return [one.span for one in find_dropouts(recording, crossing_period(x, 1.0))]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("kind", ["noise", "zeros"])
def test_drop_outs_are_found_from_their_first_to_their_last_sample(seed: int, kind: str) -> None:
    x, rng = decay(seed), np.random.default_rng(100 + seed)
    bad = np.zeros(N, dtype=bool)
    spans = [(400, 418), (1207, 1219), (2010, 2020), (3333, 3336)]  # spikes have five at most
    for a, b in spans:
        bad[a:b] = True
        x[a:b] = (0.3 if kind == "noise" else SIGMA) * rng.standard_normal(b - a)
    found = found_in(x)
    assert len(found) >= 2  # zeros may come where the motion passes through them
    for a, b in found:
        near = [s for s in spans if s[0] - 2 <= a and b <= s[1] + 2]
        assert len(near) == 1 and b - a >= near[0][1] - near[0][0] - 4


def test_coarse_readings_of_a_motion_that_has_died_away_are_no_bad_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """They repeat, so that every step stands out from what most of them leave."""
    asked: list[int] = []
    grown = dropouts._grown

    def counted(x: np.ndarray, used: np.ndarray, first: int, period: float, least: float) -> Any:
        asked.append(first)
        return grown(x, used, first, period, least)

    monkeypatch.setattr(dropouts, "_grown", counted)
    step = 0.02
    coarse = step * np.round(decay(0) * np.exp(-np.arange(N) / 800.0) / step)
    assert found_in(coarse) == [] and len(asked) < 20
    coarse[700:712] += 0.4
    assert len(found_in(coarse)) == 1


@pytest.mark.parametrize("seed", range(5))
def test_what_does_not_come_back_is_none(seed: int) -> None:
    clean = decay(seed)
    assert found_in(clean) == []
    lost = np.concatenate([clean[:2000], clean[2020:]])  # samples lost
    moved = clean + np.where(np.arange(N) > 2500, 0.3, 0.0)  # its zero moved
    knock = clean + np.where(np.arange(N) > 2500, 0.4 * np.sin((np.arange(N) - 2500) / 16.0), 0.0)
    assert found_in(lost) == found_in(moved) == found_in(knock) == []


@pytest.mark.parametrize("length", [16, 20, 26])
def test_what_sets_in_and_ends_smoothly_is_none(length: int) -> None:
    """As a soft stop does. What rises by a third of its height in a sample is as steep as noise."""
    x, k = decay(2), np.arange(length) + 0.5
    for a in (700, 1500, 2600):
        x[a : a + length] += 2.0 * k / length * (1.0 - k / length)
    assert found_in(x) == []


def test_beside_a_stop_none_is_looked_for() -> None:
    x = decay(0)
    x[400:418] = 0.5
    assert found_in(x) and not found_in(x, case="1")


@pytest.mark.parametrize(
    "effects",
    [
        {"coulomb_friction": {"force": 0.2}},
        {"spring_piecewise": {"gap": 2e-3, "stiffness": 2000.0, "damping": 0.0}},
        {"opposite_stop": {"gap": 2e-3, "stiffness": 3000.0}},
        {"hysteresis_bouc_wen": {"stiffness": 200.0, "decay": 500.0}},
    ],
)
def test_friction_and_corners_of_the_motion_are_none(effects: Effects) -> None:
    for quantity, noise in (("displacement", 5e-6), ("velocity", 5e-4), ("acceleration", 0.02)):
        campaign = small_rig.record(
            3, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0,
            quantity=quantity, chain=MeasuringChain(noise=noise),
        )  # fmt: skip
        for r in campaign.recordings:
            assert find_dropouts(r, crossing_period(r.samples, 1.0)) == []


def test_they_are_told_as_spikes_and_no_samples_are_lost_there() -> None:
    x = decay(1)
    for a in (500, 1800, 3000):
        x[a : a + 12] = 0.4 * np.random.default_rng(a).standard_normal(12)
    (fault,) = recording_faults(Recording("a", "", x, 1e-4, quantity="velocity"))
    assert fault.id == "recording_spikes" and "spikes and drop-outs of up to" in fault.statement
    bad = {i for a, b in fault.spans for i in range(a, b)}
    planted = {i for a in (500, 1800, 3000) for i in range(a, a + 12)}
    assert bad <= planted and len(bad) > 30


@pytest.mark.parametrize("lost", [9, 20])
def test_samples_lost_by_an_encoder_are_no_drop_out(lost: int) -> None:
    """Place and slope jump together; on either side the motion goes on in coarse steps."""
    kinds = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        t = np.arange(3000) / 200.0
        x = 80.0 * np.exp(-0.05 * t) * np.cos(2 * np.pi * 0.7 * t) + 0.7
        step = 0.045 * np.round((x + 0.01 * rng.standard_normal(t.size)) / 0.045)
        at = int(rng.integers(500, 2400))
        read = np.radians(np.delete(step, np.s_[at : at + lost]))
        kinds.append([f.id for f in recording_faults(Recording("a", "", read, 5e-3))])
    assert sum("recording_slip" in ids for ids in kinds) >= 4
    assert sum("recording_spikes" in ids for ids in kinds) <= 1
