"""The search for the stop under a measured input, against the roots of the motion's polynomial."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from driven_twin import driven_motion
from scipy.linalg import expm
from test_driven import INTERVAL, VALUES, _oscillator, _theta

from bayesimpact.model.exact.driven_events import LONGEST, TERMS, expand, next_rise, terms_needed


@numba.njit
def _search(motion: np.ndarray, level: float, terms: int) -> tuple[float, float, np.ndarray]:
    """First rise of a motion (beta, K, z, v, p, r), the speed there, and the series."""
    path = np.empty(terms)
    beta, K, z, v, p, r = motion
    end, speed, bound = expand(path, beta, K, z, v, p, r)
    x, rise = next_rise(path, level, end, speed, bound)
    return x, rise, path


def _motion(rng: np.random.Generator) -> np.ndarray:
    """A motion from below 0, often back and forth about it within the stretch."""
    rate = LONGEST * 10 ** rng.uniform(-2, 0)
    share = rng.uniform(0, 0.95)
    K, beta = ((1 - share) * rate) ** 2, share * rate
    turn, height = rng.uniform(-0.2, 1.2), 10 ** rng.uniform(-6, 0) * rng.choice([-1, 1])
    bend = 10 ** rng.uniform(-3, 1) * rng.choice([-1, 1])
    # z = height + bend (x - turn)^2 but for beta and K
    z, v = height + bend * turn**2, -2 * bend * turn
    if z > 0:
        z, v, bend = -z, -v, -bend
    p = 2 * bend + beta * v + K * z
    return np.array([beta, K, z, v, p, rng.choice([0.0, 1.0]) * bend * rng.normal()])


def test_the_first_rise_is_the_first_root() -> None:
    rng = np.random.default_rng(3)
    rises = pairs = 0
    for _ in range(3000):
        motion = _motion(rng)
        x, speed, path = _search(motion, 0.0, TERMS)
        series = np.polynomial.Polynomial(path)
        roots = series.roots()
        real = np.sort(roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 1e-12)])
        rising = [root for root in real if root < 1 + 1e-12 and series.deriv()(root) > 0]
        if not rising:
            assert x == np.inf
            continue
        rises += 1
        pairs += bool(np.any((real > rising[0]) & (real < 1)))
        assert x == pytest.approx(rising[0], rel=1e-6)  # eigenvalues of a matrix, near doubled ones
        assert abs(series(x)) < 1e-15 * np.abs(path).max()
        assert speed == pytest.approx(series.deriv()(x), rel=1e-12, abs=1e-14)
    assert rises > 800 and pairs > 100  # rises and falls again before the stretch is over


def test_the_series_is_the_motion() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        motion = np.concatenate([_motion(rng)[:2], rng.standard_normal(4)])
        beta, K = motion[:2]
        terms = terms_needed(np.sqrt(K) + beta)
        _, _, path = _search(motion, np.inf, terms)
        found = path.sum(), path @ np.arange(terms)
        system = np.array([[0, 1, 0, 0], [-K, -beta, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
        exact = (expm(system) @ motion[2:])[:2]  # of z, z', p and r
        np.testing.assert_allclose(found, exact, rtol=0, atol=3e-15 * np.abs(motion[2:]).max())


def test_a_motion_that_starts_at_the_level_rises_later_or_not() -> None:
    thrown = np.array([0.0, 0.01, 0.0, -0.1, 0.5, 0.0])  # comes back at about 0.4
    x, speed, _ = _search(thrown, 0.0, TERMS)
    assert 0.39 < x < 0.41 and speed > 0.0
    falling = np.array([0.0, 0.01, 0.0, -0.1, 0.1, 0.0])
    assert _search(falling, 0.0, TERMS)[0] == np.inf


@pytest.mark.parametrize(("interval", "stiffness"), [(INTERVAL, 4e7), (20 * INTERVAL, 2e5)])
def test_many_short_impacts_of_a_hard_stop(interval: float, stiffness: float) -> None:
    """A bouncing mass, pressed against a stop so hard that an impact lasts a tenth of a sample."""
    force = np.linspace(1.0, 4.0, 40)
    values = {**VALUES, "k2": stiffness, "c2": 60.0, "g": 1e-4, "y0": 0.0, "v0": 0.0}
    exact, events = driven_motion(values, force, interval)
    oscillator = _oscillator(force, stop=True, interval=interval)
    (found,) = oscillator.predict(_theta(oscillator, **values))
    assert events > 8
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10)
