"""A zero that moves in mid-record: a marker found beside itself, a probe that slips."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.faults.slip import find_slips
from bayesimpact.data.recording import Recording

NOISE, CYCLE = 3e-5, 62  # m, samples of a period


def tracked(steps: dict[int, float], *, step: float = 0.0, case: str = "") -> Recording:
    """A pendulum of 40 mm for a little over four periods, read so much off from samples on."""
    n = np.arange(271)
    y = 0.04 * np.exp(-2e-4 * n) * np.cos(2 * np.pi * n / CYCLE)
    y = y + sum(size * (n >= place) for place, size in steps.items())
    y = y + NOISE * np.random.default_rng(0).standard_normal(n.size)
    return Recording("marker", case, np.round(y / step) * step if step else y, 1 / 60)


def test_several_steps_in_a_short_recording_are_told() -> None:
    """Three of them spoil a tenth of it, one by less than the motion goes on in half a sample."""
    (fault,) = find_slips(tracked({22: -1.6e-3, 34: 1.8e-3, 51: 4.7e-3}))
    assert all(f"(sample {place})" in fault.statement for place in (22, 34, 51))
    assert fault.spans == ((0, 51),) and fault.remedy.startswith("start_s")
    assert fault.size == pytest.approx(4.7e-3, rel=0.1)


@pytest.mark.parametrize("size", [0.7e-3, -0.7e-3])
def test_a_step_of_less_than_half_a_samples_way_is_told_without_a_stop_alone(size: float) -> None:
    (fault,) = find_slips(tracked({109: size}))
    assert "(sample 109)" in fault.statement
    assert find_slips(tracked({109: size}, case="1")) == []  # an impact may bend a motion so far


@pytest.mark.parametrize("step", [0.0, 1e-4, 2e-3])
def test_no_step_is_told_where_there_is_none(step: float) -> None:
    assert find_slips(tracked({}, step=step)) == []


def test_a_sparse_motion_and_one_that_ends_at_once_have_none() -> None:
    t = np.arange(360) / 30.0
    moves = np.exp(-1.2 * t) * np.cos(2 * np.pi * t) + 5e-3 * np.random.default_rng(
        6
    ).standard_normal(360)
    sparse = moves[::5]
    for samples, interval in ((moves, 1 / 30), (sparse, 1 / 6)):
        assert find_slips(Recording("short", "", samples, interval)) == []
