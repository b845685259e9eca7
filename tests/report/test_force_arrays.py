"""The unexplained force as arrays: what base parameters imitate is out, a planted force is in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.report.diagnosis.arrays import diagnosis_arrays, spectrum
from bayesimpact.report.diagnosis.force_arrays import POINTS, force_arrays
from bayesimpact.report.results import Array

pytestmark = pytest.mark.long

STIFFNESS = 1.5e7  # N/m3
Z90 = 1.6449


@pytest.fixture(scope="module")
def unknown() -> Diagnosis:
    """A contact that hardens, and a catalogue in which nobody has thought of it."""
    campaign = small_rig.record(
        44,
        {"contact_hardening": {"stiffness": STIFFNESS}},
        duration=1.5,
        releases=small_rig.RELEASES[:2],
    )
    effects = tuple(BY_ID[i] for i in ("coulomb_friction", "sensor_drift"))
    return diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)


@pytest.fixture(scope="module")
def arrays(unknown: Diagnosis) -> dict[str, Array]:
    return diagnosis_arrays(unknown)


def without_imitable(values: Array, y: Array, weight: Array, gap: float) -> Array:
    """The part of a force of y that no 1, y, H, H (y - g) makes up, by weighted least squares."""
    beyond = (y >= gap).astype(float)
    basis = np.stack([np.ones_like(y), y, beyond, beyond * (y - gap)], axis=1)
    root = np.sqrt(weight)
    found = np.linalg.lstsq(basis * root[:, None], values * root, rcond=None)[0]
    return np.asarray(values - basis @ found)


def test_the_band_holds_the_planted_force(unknown: Diagnosis, arrays: dict[str, Array]) -> None:
    y, gap = arrays["force_y"], float(arrays["gap"][0])
    planted = STIFFNESS * np.maximum(y - gap, 0.0) ** 3
    motion = np.concatenate([p for p in unknown.before.predicted])
    weight = np.histogram(motion, bins=POINTS, range=(y[0], y[-1]))[0].astype(float)
    rest = without_imitable(planted, y, weight, gap)
    inside = (y > gap) & (weight > 0)
    found, planted_rest = arrays["force_a"][inside], rest[inside]
    sd = arrays["force_a_sd"][inside]
    assert np.ptp(planted_rest) > 0.02  # N
    assert np.corrcoef(found, planted_rest)[0, 1] > 0.95
    # neighbours share a few knots: far fewer independent points than there are
    assert np.mean(np.abs(found - planted_rest) < 2 * Z90 * sd) > 0.8
    assert np.max(np.abs(found) / sd) > 4
    assert np.abs(arrays["force_b"] * arrays["force_v_high"]).max() < 0.1 * np.ptp(rest)


def test_what_base_parameters_imitate_is_out(unknown: Diagnosis) -> None:
    """Another k2, c2 or g in the place of the unexplained force leaves nothing to see."""
    force, fit = unknown.force, unknown.before
    y = np.linspace(force.low, force.low + force.spacing * (force.knots - 3), force.knots)
    linear = np.linspace(force.low - force.spacing, y[-1] + force.spacing, force.knots)
    coefficients = np.concatenate([1.0 + 3e2 * linear, np.full(force.knots, 0.2)])
    only = replace(unknown, force=replace(force, mean=coefficients))
    found = force_arrays(only)
    assert fit.value("g") == pytest.approx(float(found["gap"][0]))
    assert np.abs(found["force_a"]).max() < 1e-9 and np.abs(found["force_b"]).max() < 1e-9


def test_velocities_are_those_of_the_motion(arrays: dict[str, Array]) -> None:
    low, high = arrays["force_v_low"], arrays["force_v_high"]
    assert np.all(low < high) and low.min() < -0.2 and 0.2 < high.max() < 0.4
    assert high[0] < 0.7 * high.max()  # turning points are slow


def test_gains_agree_with_one_another(unknown: Diagnosis, arrays: dict[str, Array]) -> None:
    total = arrays["gain"].sum(axis=1)
    impacts = np.nansum(arrays["impact_gain"], axis=1)
    assert np.all(impacts < total + 10) and np.all(impacts > 0.3 * total)
    held = unknown.held_out
    assert held is not None
    gains = np.diff(arrays["held_out_recordings"], axis=1)[:, 0]
    assert gains.sum() == pytest.approx(held.gain)
    assert arrays["before_chi2"].mean() == pytest.approx(unknown.before.reduced_chi2, rel=0.02)


def test_spectrum_of_noise_is_flat_and_a_misfit_stands_out(unknown: Diagnosis) -> None:
    frequency, before, after, low, high = spectrum(unknown.before, unknown.after).T
    assert np.all(np.diff(frequency) > 0) and frequency[-1] < 500
    assert np.mean((after > low) & (after < high)) > 0.7
    assert np.max(before / high) > np.max(after / high) > 0.8


def test_a_control_shows_how_large_a_force_could_be() -> None:
    campaign = small_rig.record(41, duration=1.5)
    effects = (BY_ID["coulomb_friction"],)
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)
    assert found.verdict == "adequate"
    arrays = diagnosis_arrays(found)
    assert "before_chi2" not in arrays and "left_a" not in arrays
    inside = np.abs(arrays["force_a"]) < Z90 * arrays["force_a_sd"]
    assert inside.mean() > 0.75 and arrays["force_a_sd"].max() < 0.1
