"""The closed-form backbone against the energy, the period formula and the simulator."""

from __future__ import annotations

import numpy as np
import pytest
from bilinear import bilinear_backbone
from rigs import PAPER, paper_motion

from bayesimpact.response.backbone import backbone

RIG = (PAPER["mass"], PAPER["k1"], PAPER["g"], PAPER["k2"])


def test_energy_is_the_same_on_both_sides() -> None:
    b = bilinear_backbone(*RIG, np.linspace(1e-3, 2e-2, 30))
    deep = np.maximum(b.upper_amplitude - PAPER["g"], 0)
    upper = PAPER["k1"] * b.upper_amplitude**2 + PAPER["k2"] * deep**2
    assert upper == pytest.approx(PAPER["k1"] * b.amplitude**2, rel=1e-12)


def test_period_by_quadrature() -> None:
    """T = 2 integral of dy / v between the turning points; v from the energy."""
    m, k1, g, k2 = RIG
    b = bilinear_backbone(*RIG, 5e-3)
    low, high = -5e-3, b.upper_amplitude[0]
    # y = middle + half * sin(s) takes the square-root ends away.
    s = (np.arange(200_000) + 0.5) / 200_000 * np.pi - np.pi / 2
    y = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(s)
    potential = k1 * y**2 + k2 * np.maximum(y - g, 0) ** 2
    v = np.sqrt(np.maximum(k1 * low**2 - potential, 1e-300) / m)
    period = 2 * np.sum(0.5 * (high - low) * np.cos(s) / v) * np.pi / 200_000
    assert 1 / b.frequency[0] == pytest.approx(period, rel=1e-5)


def test_an_undamped_simulation_swings_at_it() -> None:
    b = backbone(paper_motion(c1=0.0, c2=0.0, y0=-5e-3), 1e-3, rest=0.0, noise=0.0)
    exact = bilinear_backbone(*RIG, 5e-3)
    assert b.upper.frequency == pytest.approx(exact.upper_frequency[0], rel=2e-5)
    assert b.upper.amplitude == pytest.approx(exact.upper_amplitude[0], rel=2e-5)
    assert b.lower.frequency == pytest.approx(exact.lower_frequency, rel=2e-5)


def test_limits() -> None:
    m, k1, g, k2 = RIG
    free = np.sqrt(k1 / m) / (2 * np.pi)
    below = bilinear_backbone(*RIG, [0.3 * g, 0.999 * g])
    assert below.frequency == pytest.approx(free, rel=1e-14)
    assert below.upper_amplitude == pytest.approx(below.amplitude, rel=1e-14)
    # Without a gap, and far beyond one: half a period of each oscillator.
    both = np.sqrt((k1 + k2) / m) / (2 * np.pi)
    halves = 2 / (1 / free + 1 / both)
    assert bilinear_backbone(m, k1, 0.0, k2, 1e-3).frequency == pytest.approx(halves, rel=1e-12)
    assert bilinear_backbone(*RIG, 1e3).frequency == pytest.approx(halves, rel=1e-5)
    assert bilinear_backbone(*RIG, g * (1 + 1e-9)).frequency == pytest.approx(free, rel=1e-4)


def test_a_stiffer_stop_lowers_the_upper_backbone_over_amplitude() -> None:
    """Tian et al., Fig. 7: at equal upper frequency the stiffer stop has the smaller amplitude."""
    curves = [
        bilinear_backbone(*RIG[:3], k2, np.linspace(1.2e-3, 2e-2, 500)) for k2 in (5350.0, 2959.0)
    ]
    at = [np.interp(9.0, c.upper_frequency, c.upper_amplitude) for c in curves]
    assert at[0] < at[1]
