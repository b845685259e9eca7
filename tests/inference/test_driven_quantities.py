"""Velocities and accelerations under a measured input: noise, mode and intervals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from driven_rigs import driven_rig
from driven_twin import driven_states

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.find import find_faults
from bayesimpact.data.gaps import without
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.estimate import estimate_noise

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


def test_several_quantities_with_and_without_an_input() -> None:
    """One rig: a decay and three driven recordings, each with a noise and an offset of its own."""
    truth = {"mass": 0.5, "c1": 0.6, "k1": 800.0, "c2": 2.0, "g": 1.1e-3, "k2": 5000.0}
    gain, n, interval, rng = 2.5, 1200, 2e-3, np.random.default_rng(8)
    levels = {"displacement": 5e-6, "velocity": 2e-4, "acceleration": 2e-2}
    recordings = []
    for name, quantity, push in (
        ("decay", "velocity", 0.0),
        ("slow", "acceleration", 6.0),
        ("fast", "displacement", 9.0),
        ("gaps", "acceleration", 9.0),
    ):
        white = np.convolve(rng.standard_normal(n), np.ones(5) / 5, "same")
        start = {"y0": 1e-4 if push else -6e-3, "v0": 0.0}
        states, _ = driven_states({**truth, **start}, push * white, interval)
        level = levels[quantity]
        samples = states[list(levels).index(quantity)] + level * (3 + rng.standard_normal(n))
        given = Input(push * white / gain, free=True) if push else None
        own: Any = quantity
        recordings.append(Recording(name, "1", samples, interval, quantity=own, input=given))
    recordings[-1] = without(recordings[-1], [(300, 340), (700, 705)])
    campaign = Campaign("rig", 0.5, tuple(recordings))
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    known = {**truth, "k2[1]": truth["k2"], "input_gain": gain}
    errors = [
        (value - known[name]) / sd
        for name, value, sd in zip(fit.names, fit.mode, fit.sd, strict=True)
        if name in known
    ]
    assert fit.converged and len(errors) == 6 and np.abs(errors).max() < 4.0
    assert fit.reduced_chi2 == pytest.approx(1.0, abs=0.15)
    assert fit.value("offset[slow]") == pytest.approx(0.06, abs=0.004)
    units = {p.name: p.unit for p in fit.density.oscillator.layout.parameters}
    assert [units[f"offset[{r.name}]"] for r in recordings] == ["m/s", "m/s2", "m", "m/s2"]
