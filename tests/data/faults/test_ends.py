"""Readings at an end of a recording, which one side alone could predict."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.faults.ends import missed_ends, unpredicted_ends
from bayesimpact.data.faults.spikes import find_spikes, lone_spikes
from bayesimpact.data.recording import Recording

NOISE = 2.6e-3


def decay(rng: np.random.Generator, *, period: float = 105.0, order: int = 0) -> np.ndarray:
    """A linear decay of amplitude 1 with noise, 600 samples; `order` times differentiated."""
    w = 2 * np.pi / period
    rate = (-0.04 + 1j) * w
    motion = np.real((rate / w) ** order * np.exp(rate * np.arange(600) + 3j))
    return np.asarray(motion + NOISE * rng.standard_normal(600))


@pytest.mark.parametrize("place", [0, 1, 2, 597, 598, 599])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_one_bad_reading_at_an_end_is_told(place: int, sign: float) -> None:
    """Unseen, a first one of 10 deviations was named a second mode, one of 22 a second spring."""
    x = decay(np.random.default_rng(place))
    x[place] += sign * 22 * NOISE
    (fault,) = find_spikes(Recording("a", "", x, 0.01))
    assert fault.spans == ((place, place + 1),)


def test_the_first_two_readings_are_told_as_one_place() -> None:
    x = decay(np.random.default_rng(7))
    x[:2] += np.array([80, 40]) * NOISE
    (fault,) = find_spikes(Recording("a", "", x, 0.01))
    assert fault.spans == ((0, 2),)


@pytest.mark.parametrize("order", [0, 2])
def test_ends_of_good_decays_are_none(order: int) -> None:
    """At any number of samples per period; 0 of 3,000 such draws were."""
    rng = np.random.default_rng(3)
    draws = [decay(rng, period=rng.uniform(8, 120), order=order) for _ in range(100)]
    assert sum(bool(unpredicted_ends(x)) for x in draws) == 0


def test_a_motion_that_begins_with_a_fast_mode_is_none() -> None:
    rng, found = np.random.default_rng(4), 0
    for _ in range(60):
        rate = 2 * np.pi / rng.uniform(8, 15) * (-0.05 + 1j)
        fast = np.real(0.1 * np.exp(rate * np.arange(600) + 1j * rng.uniform(0, 6)))
        found += bool(unpredicted_ends(decay(rng) + fast))
    assert found == 0


def test_bounces_are_none() -> None:
    """A corner that both ends may lie beside, as large as those between them."""
    rng, found = np.random.default_rng(5), 0
    for _ in range(60):
        x = np.abs(decay(rng))[rng.integers(0, 60) :]
        found += bool(unpredicted_ends(x))
    assert found == 0


@pytest.mark.parametrize("place", [0, 2, 599])
def test_one_end_that_a_fit_misses_is_told(place: int) -> None:
    """Ten deviations off, where the readings beside it tell nothing."""
    residual = NOISE * np.random.default_rng(place).standard_normal(600)
    residual[place] += 10 * NOISE
    recording = Recording("a", "", residual, 0.01)
    assert not lone_spikes(recording)
    (fault,) = lone_spikes(recording, residual=True)
    assert fault.spans == ((place, place + 1),)


def test_ends_from_eight_deviations_on_are_told_by_what_a_fit_leaves() -> None:
    """Of 300 white residuals; the readings beside tell next to none of them."""
    rng = np.random.default_rng(7)
    beside = left = 0
    for _ in range(300):
        residual = rng.standard_normal(600)
        residual[0] += 8.0
        beside += bool(unpredicted_ends(residual))
        left += bool(missed_ends(residual))
    assert beside <= 6 and left >= 240


def test_noise_and_what_dies_out_slowly_are_no_ends_that_a_fit_misses() -> None:
    """None of 200 white residuals, with and without what dies out over four readings."""
    rng = np.random.default_rng(6)
    draws = [rng.standard_normal(rng.integers(100, 1500)) for _ in range(200)]
    assert not any(missed_ends(x) for x in draws)
    for x in draws:
        x += rng.choice([-1, 1]) * rng.uniform(10, 60) * np.exp(-np.arange(x.size) / 4.0)
    assert sum(bool(missed_ends(x)) for x in draws) == 0


def test_bad_ends_beside_each_other_are_told_together() -> None:
    residual = np.random.default_rng(8).standard_normal(600)
    residual[[0, 1]] += [14.0, -10.0]
    assert {one.span for one in missed_ends(residual)} == {(0, 1), (1, 2)}
