"""Readings in steps, as of an encoder: what rounding and rest do is no fault."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.faults.slip import find_slips
from bayesimpact.data.recording import Recording


@pytest.mark.parametrize("seed", range(5))
def test_a_mass_that_friction_stops_before_an_encoder_has_no_fault(seed: int) -> None:
    """Its last step into the rest lies within the samples that tell the slope there, and noise
    brings another step now and then, so that no rest reaches to the end. Nor is the motion louder
    than the rest, which nothing rounds.
    """
    rng, step = np.random.default_rng(seed), 6e-4
    t = np.arange(3000) * 1e-2
    free_decay = 0.2 * np.maximum(1.0 - t / 15.0, 0.0) * np.cos(2 * np.pi * 1.1 * t)
    x = np.round(free_decay / step + 0.3 * rng.standard_normal(t.size))
    x[1500:] = -1.0 * (rng.random(1500) < 0.01)
    x[1496:1500] = -1.0, -1.0, 0.0, -1.0
    x[1500:1640] = 0.0
    x[1640:1644] = -1.0, 0.0, 0.0, -1.0
    assert recording_faults(Recording("a", "", x * step, 1e-2)) == []


def test_a_rest_between_two_steps_is_not_written_twice() -> None:
    """An encoder that flickers repeats itself by chance; one that swings does not."""
    rng, step = np.random.default_rng(3), 3e-4
    t = np.arange(2800) * 1e-2
    free_decay = 0.5 * np.maximum(1.0 - t / 20.0, 0.0) * np.cos(2 * np.pi * 0.9 * t)
    x = np.round(free_decay / step + 0.2 * rng.standard_normal(t.size))
    x[2000:] = -4.0
    x[[2703, 2707]] = -3.0
    assert [f.id for f in find_slips(Recording("a", "", x * step, 1e-2))] == []
    twice = np.concatenate([x[:500], x[490:]])
    (found,) = find_slips(Recording("a", "", twice * step, 1e-2))
    assert found.spans[0][0] == 500 or found.spans[0][1] == 500


def test_friction_that_holds_an_encoder_is_no_fault() -> None:
    """A swing that slows down, stops within a step at its last turn and stays there."""
    t = np.arange(0.0, 30.0, 0.01)
    rate, stop = 2 * np.pi * 0.7, 20.0 / 0.7
    amplitude = 0.6 * (1.0 - t / stop) + 0.02
    y = np.where(t < stop, amplitude * np.cos(rate * t), 0.02)
    samples = np.round(y / 7e-4) * 7e-4
    found = recording_faults(Recording("p", "", samples, 0.01, quantity="angle"))
    assert [f.id for f in found if f.action != "notice"] == []


def test_the_step_is_found_where_most_readings_are_several_apart() -> None:
    """A large motion passes 3,000 steps in few samples; twice the step was taken for it."""
    t = np.arange(4658) * 1e-2
    free_decay = np.where(t < 8.0, 0.9 - 0.1 * t, 0.002) * np.cos(2 * np.pi * 1.1 * t)
    counts = np.round(free_decay / 5.33e-4 + 0.2 * np.random.default_rng(0).standard_normal(t.size))
    apart = np.diff(np.unique(counts))
    assert np.median(apart) >= 2.0
    assert reading_step(np.round(counts * 5.33e-4, 7)) == pytest.approx(5.33e-4)
