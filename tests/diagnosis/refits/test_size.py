"""How large effects are said to be."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, with_effect

from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.size import peak_force, size, size_in_words
from bayesimpact.diagnosis.residual_force.gaussian_process import trajectory_points
from bayesimpact.model.units import two_digits


def test_peak_force_along_the_motion(small):
    fit = with_effect(small, "spring_cubic", stiffness=2e4)
    largest = max(np.abs(y).max() for y, _ in trajectory_points(fit))
    assert peak_force(BY_ID["spring_cubic"], fit) == pytest.approx(2e4 * largest**3, rel=0.01)
    drag = with_effect(small, "quadratic_drag", coefficient=0.3)
    fastest = max(np.abs(v).max() for _, v in trajectory_points(drag))
    found = peak_force(BY_ID["quadratic_drag"], drag)
    assert found == pytest.approx(0.3 * fastest**2, rel=0.02)
    hard = with_effect(small, "contact_hardening", stiffness=1e7)
    gap = small.fit.value("g")
    deepest = max((y - gap).max() for y, _ in trajectory_points(hard))
    found = peak_force(BY_ID["contact_hardening"], hard)
    assert found == pytest.approx(1e7 * deepest**3, rel=0.05)
    lossy = with_effect(small, "structural_damping", loss=0.02)
    found = peak_force(BY_ID["structural_damping"], lossy)
    assert found == pytest.approx(0.02 * small.fit.value("k1") * largest, rel=0.02)
    numbers = {"stiffness": 300.0, "gap": 0.5 * largest, "damping": 2.0}
    bumper = with_effect(small, "spring_piecewise", **numbers)
    motions = [np.stack(m) for m in trajectory_points(bumper)]
    y, v = np.concatenate(motions, axis=1)
    beyond = np.where(y < -0.5 * largest, 300.0 * (y + 0.5 * largest) + 2.0 * v, 0.0)
    found = peak_force(BY_ID["spring_piecewise"], bumper)
    assert found == pytest.approx(np.abs(beyond).max(), rel=0.02)


def test_a_size_is_a_force_and_its_share(small):
    scales = campaign_scales(small.fit)
    fit = with_effect(small, "spring_cubic", stiffness=2e4)
    text, share = size_in_words(BY_ID["spring_cubic"], small.fit, fit, scales)
    peak = peak_force(BY_ID["spring_cubic"], fit)
    assert text == two_digits(peak, "N") and share == pytest.approx(peak / scales.force)
    hard = with_effect(small, "contact_hardening", stiffness=1e7)
    _, share = size_in_words(BY_ID["contact_hardening"], small.fit, hard, scales)
    peak = peak_force(BY_ID["contact_hardening"], hard)
    assert share == pytest.approx(peak / scales.contact_force)
    friction = with_effect(small, "coulomb_friction", force=2e-3)
    text, share = size_in_words(BY_ID["coulomb_friction"], small.fit, friction, scales)
    assert text == "2.0 mN" and share == pytest.approx(2e-3 / scales.force)


@pytest.mark.parametrize("effect_id", BY_ID)
def test_every_effect_has_a_size(small, effect_id):
    effect, scales = BY_ID[effect_id], campaign_scales(small.fit)
    if not effect.admissible(scales):
        pytest.skip("not on this rig")
    value, unit, share = size(effect, small.fit, with_effect(small, effect_id), scales)
    assert np.isfinite([value, share]).all() and unit in ("N", "m", "kg", "N s/m", "s", "Hz", "%")


def test_sizes_that_effects_define(small):
    scales = campaign_scales(small.fit)
    fit = with_effect(small, "gap_wear", step=2e-7)
    value, unit, share = size(BY_ID["gap_wear"], small.fit, fit, scales)
    assert unit == "m" and value == pytest.approx(2e-7 * scales.impacts)
    assert share == pytest.approx(value / scales.indentation)
    name = small.fit.density.oscillator.campaign.recordings[1].name
    fit = with_effect(small, "gap_per_recording", **{f"g[{name}]": small.fit.value("g") + 3e-6})
    value, _, _ = size(BY_ID["gap_per_recording"], small.fit, fit, scales)
    assert value == pytest.approx(3e-6)
    heavy = with_effect(small, "obstacle_mass", mass=0.01)
    assert size(BY_ID["obstacle_mass"], small.fit, heavy, scales)[0] == 0.01


def test_the_measuring_chain_is_told_by_its_change_of_the_readings(small):
    scales = campaign_scales(small.fit)
    bent = with_effect(small, "sensor_quadratic", gain=0.5)
    value, unit, share = size(BY_ID["sensor_quadratic"], small.fit, bent, scales)
    largest = max(np.abs(y).max() for y, _ in trajectory_points(small.fit))
    assert unit == "m" and value == pytest.approx(0.5 * largest**2, rel=0.01)
    assert share == pytest.approx(value / scales.amplitude)
