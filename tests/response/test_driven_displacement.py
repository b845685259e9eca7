"""Displacements and start values from velocities and accelerations under a measured input."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from driven_rigs import driven_rig

from bayesimpact.inference.initial.driven import estimate_driven
from bayesimpact.inference.initial.estimates import estimate
from bayesimpact.response.driven_displacement import (
    Guess,
    displacement_under,
    seen_displacement,
    trend,
    without_base,
)

pytestmark = pytest.mark.long

QUANTITIES = ("displacement", "velocity", "acceleration")


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("seed", range(10))
def test_start_values_of_random_rigs(seed: int, quantity: Any) -> None:
    rig = driven_rig(seed, quantity)
    found = estimate(rig.campaign).values
    near = {"k1": 0.05, "input_gain": 0.05, "k2[1]": 0.1}
    for name, error in near.items():
        if name in rig.truth:
            assert found[name] == pytest.approx(rig.truth[name], rel=error), name
    assert found["offset[a]"] == pytest.approx(rig.truth["offset[a]"], abs=2.0 * rig.noise)
    moved = estimate_driven(rig.campaign).moved[0]
    assert np.std(moved - rig.displacement) < 0.06 * np.std(rig.displacement)
    if rig.campaign.stop:
        assert found["g"] == pytest.approx(rig.truth["g"], abs=0.03 * np.ptp(rig.displacement))


@pytest.mark.parametrize("quantity", QUANTITIES[1:])
def test_the_displacement_of_a_known_oscillator(quantity: Any) -> None:
    rig = driven_rig(1, quantity)
    known = rig.truth
    guess = Guess(rig.campaign.mass, known["k1"], known["input_gain"], known["g"], known["k2[1]"])
    found = displacement_under(rig.campaign.recordings[0], guess, known["offset[a]"])
    assert found.quantity == "displacement"
    assert np.std(found.samples - rig.displacement) < 0.02 * np.std(rig.displacement)


@pytest.mark.parametrize("quantity", QUANTITIES[1:])
def test_the_displacement_does_not_ask_for_mass_or_gain(quantity: Any) -> None:
    rig = driven_rig(2, quantity)
    (recording,) = rig.campaign.recordings
    seen = seen_displacement(recording).samples
    assert recording.input is not None
    weaker = replace(recording.input, samples=recording.input.samples / 7.0)
    np.testing.assert_allclose(
        seen_displacement(replace(recording, input=weaker)).samples, seen, rtol=1e-6, atol=1e-9
    )
    assert np.corrcoef(seen, rig.displacement)[0, 1] > 0.98


def test_of_a_motion_in_space_the_base_is_taken_off() -> None:
    rig = driven_rig(3, "displacement")
    (recording,) = rig.campaign.recordings
    assert recording.input is not None and recording.input.absolute
    relative = without_base(recording, 1.0)
    np.testing.assert_allclose(
        relative.samples, rig.displacement + rig.truth["offset[a]"], atol=5.0 * rig.noise
    )
    assert np.std(recording.samples - rig.displacement) > 20.0 * rig.noise
    assert relative.is_displacement and without_base(relative, 1.0) is relative


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("corner", [1e-3, 0.02, 0.3])
def test_a_trend_is_what_is_slow(order: int, corner: float) -> None:
    """Against the same minimum from full matrices, without blocks."""
    rng = np.random.default_rng(0)
    n = 600
    values = np.cumsum(rng.standard_normal(n))
    weights = (rng.random(n) < 0.7).astype(np.float64)
    difference = np.diff(np.eye(n), order, axis=0)
    matrix = np.diag(weights) + difference.T @ difference / corner ** (2 * order)
    exact = np.linalg.solve(matrix, weights * values)
    found = trend(values, weights, corner, order)
    assert np.std(found - exact) < 0.02 * np.std(values)
