"""Velocities and accelerations under a measured input: noise, mode and intervals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from driven_rigs import driven_rig

from bayesimpact.data.faults.find import find_faults
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise_estimate import estimate_noise

QUANTITIES = ("velocity", "acceleration")
INSIDE = 1.645  # standard deviations, of a 90 % interval


def _errors(seed: int, quantity: Any, *, search: bool = False) -> np.ndarray:
    """Errors of all parameters in their standard deviations."""
    rig = driven_rig(seed, quantity)
    found = identify(rig.campaign, rng=np.random.default_rng(0), search=search, evaluations=3000)
    fit = found.fit
    assert fit.converged and found.agree, (seed, quantity)
    assert fit.rms == pytest.approx(rig.noise, rel=0.1), (seed, quantity)
    return np.array([(fit.value(n) - t) / fit.sd[fit.names.index(n)] for n, t in rig.truth.items()])


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("seed", range(8))
def test_the_mode_holds_the_truth(seed: int, quantity: Any) -> None:
    assert np.abs(_errors(seed, quantity)).max() < 4.0


@pytest.mark.parametrize(("seed", "quantity"), [(0, "velocity"), (3, "acceleration")])
def test_the_search_ends_where_the_guess_does(seed: int, quantity: Any) -> None:
    assert np.abs(_errors(seed, quantity, search=True)).max() < 4.0


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("seed", [*range(8), 9, 17])
def test_the_noise_is_found_before_any_model(seed: int, quantity: Any) -> None:
    """Impacts are no noise, though they fill the spectrum of an acceleration (9, 17)."""
    rig = driven_rig(seed, quantity)
    noise = estimate_noise(rig.campaign)
    assert noise.level == pytest.approx(rig.noise, rel=0.12)
    assert noise.correlation == 0.0


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_impacts_and_steps_of_the_input_are_no_faults(quantity: Any) -> None:
    for seed in range(8):
        assert find_faults(driven_rig(seed, quantity).campaign) == (), seed


@pytest.mark.slow
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_coverage_of_the_intervals(quantity: Any) -> None:
    """Of 20 campaigns: some 145 numbers, correlated within a campaign."""
    z = np.concatenate([_errors(seed, quantity) for seed in range(100, 120)])
    assert 0.84 < np.mean(np.abs(z) < INSIDE) < 0.96
