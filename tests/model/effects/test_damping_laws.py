"""Damping by a power of the speed, and structural damping: closed forms, and where they are hard.

A root of the speed is not smooth where the motion turns, and a structural force jumps there.
"""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, by_rig, moved
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import gamma

from bayesimpact.formula.grammar import Power, Term
from bayesimpact.formula.law import effect_of, starts_of

FREE = TestRig(mass=0.5, c1=0.0, k1=0.5 * (10 * np.pi) ** 2, k2=(), y0=(-6e-3,), v0=(0.0,))
POWER, STRUCTURAL = BY_ID["power_damping"], BY_ID["structural_damping"]


def power_law(c: float, n: float, rig: TestRig, r: int = 0) -> np.ndarray:
    return moved([POWER], {"power_damping.coefficient": c, "power_damping.exponent": n}, rig, r)


@pytest.mark.parametrize("n", [0.5, 1.5, 3.0])
def test_equivalent_damping(n):
    """a' = -c_eq a / (2 m), c_eq = c (w a)^(n-1) 2 Gamma(n/2+1) / (sqrt(pi) Gamma(n/2+3/2))."""
    w, a = 10 * np.pi, FREE.y0[0]
    c = 0.05 * (w * abs(a)) ** (1 - n)
    amplitudes = np.abs(power_law(c, n, FREE)[::200])
    factor = 2 * gamma(n / 2 + 1) / (np.sqrt(np.pi) * gamma(n / 2 + 1.5))
    rate = c * w ** (n - 1) * factor / (2 * FREE.mass)  # a' = -rate a^n
    t = 0.2 * np.arange(amplitudes.size)
    expected = (abs(a) ** (1 - n) - (1 - n) * rate * t) ** (1 / (1 - n))
    np.testing.assert_allclose(amplitudes, expected, rtol=1e-4)
    assert amplitudes[-1] < 0.9 * abs(a)


@pytest.mark.parametrize("n", [0.25, 0.5, 0.75, 1.5, 2.5, 4.0])
def test_roots_of_the_speed(n):
    """Half the damping force of the paper's rig, at every exponent of the grid, for 3 s."""
    rig = TestRig(duration=3.0)
    c = 0.5 * rig.scales().damping_force / rig.scales().speed ** n
    values = {"power_damping.coefficient": c, "power_damping.exponent": n}
    for r in (0, 1):
        difference = moved([POWER], values, rig, r) - by_rig([POWER], values, rig, r)
        assert np.abs(difference).max() < 1e-9


@pytest.mark.parametrize("n", [0.25, 0.31, 0.5])
def test_creep_to_rest(n):
    """Once inertia is negligible c |v|^n = k |y|: |y|^a grows as -a (k / c)^(1 / n) t, a = 1 - 1/n.

    And the way there changes smoothly with the parameters: no chatter of steps that are too long.
    """
    rig = TestRig(**{**FREE.__dict__, "duration": 10.0})
    c = 0.19 * (3 if n == 0.5 else 1)
    y = power_law(c, n, rig)
    first, a = int(4.0 * rig.rate), 1.0 - 1.0 / n
    gone = (np.arange(rig.count) / rig.rate - 4.0)[first:]
    expected = (np.abs(y[first]) ** a - a * (rig.k1 / c) ** (1 / n) * gone) ** (1 / a)
    assert np.abs(np.abs(y[first:]) - expected).max() < 2e-7
    assert np.ptp(np.sign(y[first:])) == 0.0
    more, most = (power_law(c * (1.0 + k * 1e-4), n, rig) for k in (1, 2))
    assert np.abs(most - 2 * more + y).max() < 0.01 * np.abs(more - y).max()


@pytest.mark.parametrize("c", [40.0, 80.0])
def test_creep_from_the_release_on(c):
    """No inertia: c (v^2 + s^2)^((n - 1) / 2) v = k y is solved for v by itself, s the law's
    slowest speed. The speed settles in microseconds, for which explicit steps would be too many.
    """
    rig = TestRig(**{**FREE.__dict__, "duration": 10.0})

    def speed(t, y):
        force = [lambda v, y=y: c * (v * v + 1e-14) ** -0.375 * v - rig.k1 * y for y in y]
        return [-brentq(f, 0.0, 1.0, xtol=1e-18, rtol=1e-13) for f in force]

    t = np.arange(rig.count) / rig.rate
    crept = solve_ivp(speed, (0.0, t[-1]), [-rig.y0[0]], t_eval=t, rtol=1e-10, atol=1e-15).y[0]
    assert -rig.y0[0] - crept[-1] > 1e-5
    assert np.abs(power_law(c, 0.25, rig) + crept).max() < 2e-9


def test_one_and_two_are_the_simpler_laws():
    rig = TestRig(duration=1.0)
    viscous = TestRig(duration=1.0, c1=rig.c1 + 0.1)
    assert np.abs(power_law(0.1, 1.0, rig) - moved([], {}, viscous)).max() < 1e-10
    drag = moved([BY_ID["quadratic_drag"]], {"quadratic_drag.coefficient": 0.5}, rig)
    assert np.abs(power_law(0.5, 2.0, rig) - drag).max() < 1e-10
    assert POWER.prefer == "quadratic_drag"


def test_ratio_of_half_cycles_under_structural_damping():
    """Between turning points the motion is a free one of k1 (1 +- h), each the same share.

    From rest at -a to y = 0 the spring is k1 (1 - h), from there on k1 (1 + h): the next turning
    point is a sqrt((1 - h) / (1 + h)), and half a period lasts the mean of both.
    """
    h = 0.02
    rig = TestRig(**{**FREE.__dict__, "rate": 2000.0})
    y = moved([STRUCTURAL], {"structural_damping.loss": h}, rig)
    half = 0.05 * (1 / np.sqrt(1 - h) + 1 / np.sqrt(1 + h))
    times = np.arange(rig.count) / rig.rate
    half_cycle = np.floor(times / half)
    ratio = np.sqrt((1 - h) / (1 + h))
    quarter = 0.05 / np.sqrt(1 - h)
    inside = times - half_cycle * half
    start = rig.y0[0] * (-ratio) ** half_cycle
    w = 10 * np.pi
    first = start * np.cos(w * np.sqrt(1 - h) * inside)
    second = -start * ratio * np.sin(w * np.sqrt(1 + h) * (inside - quarter))
    np.testing.assert_allclose(y, np.where(inside < quarter, first, second), rtol=0, atol=5e-11)


def test_structural_damping_adds_to_the_hold_of_dry_friction():
    """At rest at y the mass holds while k1 |y| (1 - h) is below the friction."""
    values = {"coulomb_friction.force": 1.0, "structural_damping.loss": 0.2}
    effects = [BY_ID["coulomb_friction"], STRUCTURAL]
    for share, held in ((0.99, True), (1.01, False)):
        place = share / (0.8 * FREE.k1)
        rig = TestRig(**{**FREE.__dict__, "y0": (place,), "duration": 0.5})
        y = moved(effects, values, rig)
        assert np.all(y == place) == held
        assert np.abs(y - by_rig(effects, values, rig)).max() < 1e-12


@pytest.mark.parametrize(("place", "side"), [(2.5e-3, -1), (1.5e-3, 1)])
def test_dry_friction_of_a_box(place, side):
    """Every pass of a pad of width 2 w takes the energy 2 w F: a_n^2 = a_0^2 - 4 n w F / k."""
    w, a = 0.6e-3, abs(FREE.y0[0])
    force = 0.02 * FREE.k1 * a
    term = Term("box", speed=Power(0.0, True), side=side, place=place, width=w)
    pad = effect_of(term, force, a, 10 * np.pi * a, signed=False)
    values = {f"{pad.id}.size": force} | starts_of(term)
    half_cycles = np.abs(moved([pad], values, FREE, 0)[::100])  # k1 is 10 pi: 0.1 s each
    expected = np.sqrt(a * a - 4 * np.arange(half_cycles.size) * w * force / FREE.k1)
    through = expected > place + w
    assert np.count_nonzero(through) > 8
    np.testing.assert_allclose(half_cycles[through], expected[through], rtol=1e-5)
