"""Real powers against mpmath."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from bayesimpact.model.power import power


@pytest.mark.parametrize("largest", [0.5, 2.0, 12.0])
def test_power_is_exact_to_its_claim(largest):
    rng = np.random.default_rng(0)
    x = 10.0 ** rng.uniform(-9.0, 3.0, 3000)
    p = rng.uniform(-largest, largest, 3000)
    for base, exponent in zip(x, p, strict=True):
        expected = mpmath.mpf(base) ** mpmath.mpf(exponent)
        assert abs(power(base, exponent) / expected - 1) < 3e-14 * (1 + abs(exponent))


def test_power_between_the_cells_of_its_tables():
    """Both sides of every border, where neighbouring entries must agree."""
    borders = 1.0 + np.arange(1024) / 1024
    for x in (*np.nextafter(borders, 0.0), *borders):
        assert power(x, 1.5) == pytest.approx(x**1.5, rel=5e-14, abs=0.0)
    halves = (np.arange(-600, 600) + 0.5) / 512
    for z in (*np.nextafter(halves, -9.0), *np.nextafter(halves, 9.0)):
        assert power(2.0, z) == pytest.approx(2.0**z, rel=5e-14, abs=0.0)


@pytest.mark.parametrize(
    ("x", "p"), [(1.0, 0.3), (2.0, 0.0), (1e-300, 8.0), (1e300, 8.0), (1e-200, -5.0), (1e-300, 3.1)]
)
def test_power_beyond_its_tables(x, p):
    with np.errstate(over="ignore", under="ignore"):
        assert power(x, p) == pytest.approx(float(np.float64(x) ** p), rel=3e-14)
