"""Derivatives through the impacts against differences of the 50-digit twin."""

from __future__ import annotations

import math
from functools import cache

import mpmath as mp
import naive
import numba
import numpy as np
import pytest
import systems
from test_simulate import campaign

from bayesimpact.errors import InputError
from bayesimpact.model.exact.sensitivities import derivatives
from bayesimpact.model.exact.sensitivities.derivatives import grams, trajectories_and_derivatives
from bayesimpact.model.exact.simulate import predictions, sums_of_squares

EVERY = np.array([[0, 1, 2, 3, 4, 5, 6, -1, -1, -1, 10]])  # no harmonic force
BASE = {
    "c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2": 5350.156, "y0": -6.5e-3, "v0": 0.01,
    "A": 0.0, "w": 20.0, "phase": 0.3, "offset": 1e-4,
}  # fmt: skip
W1 = math.sqrt(808.556 / 0.503)
CASES = {
    "rig": {},
    "overdamped contact": {"c2": 300.0},
    "preloaded": {"g": -1e-3},
    "preloaded, over-damped": {"g": -1e-3, "c2": 250.0},
    "gap zero": {"g": 0.0},
    "start in contact": {"y0": 4e-3},
    "start in preloaded contact": {"y0": -5e-4, "g": -1e-3, "v0": -0.2},
    "no contact": {"g": 0.5},
    "no stop": {"g": math.inf, "c2": 0.0, "k2": 0.0},
    "undamped": {"c1": 0.0, "c2": 0.0},
    "overdamped flight": {"c1": 60.0, "v0": 2.0},
    "critical flight": {"c1": 2 * math.sqrt(808.556 * 0.503), "v0": 2.0},
}


def analytic(q, mass, interval, n, order=0):
    values, jacobian, codes = trajectories_and_derivatives(
        q, EVERY, np.zeros((1, 11)), mass, [n], [interval], n, [order]
    )
    assert codes[0] == 0
    return values, jacobian


@cache
def twins(q, mass, interval, n):
    """The twin of q, and the number, step and twins to either side of every finite parameter."""
    sides = []
    for i in range(7):
        if not math.isfinite(q[i]):
            continue
        with mp.workdps(70):
            step = mp.mpf(max(abs(q[i]), 1e-3)) * mp.mpf(10) ** -16
            moved = [[mp.mpf(x) + s * step * (i == j) for j, x in enumerate(q)] for s in (1, -1)]
            sides.append((i, step, [naive.twin(m, mass, interval, n) for m in moved]))
    return naive.twin(q, mass, interval, n), sides


def differences(q, mass, interval, n, order=0):
    """Central differences of the twin, exact to about 20 digits."""
    out = np.zeros((n, 11))
    for i, step, sides in twins(tuple(q), mass, interval, n)[1]:
        pairs = zip(*(side.derivative(order) for side in sides), strict=True)
        with mp.workdps(70):
            out[:, i] = [float((a - b) / (2 * step)) for a, b in pairs]
    out[:, 10] = 1.0
    return out


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("case", CASES)
def test_derivatives(case, order):
    q = np.array(list((BASE | CASES[case]).values()))
    n, interval = 16, 2.1e-2
    values, jacobian = analytic(q, 0.503, interval, n, order)
    exact = differences(q, 0.503, interval, n, order)
    scale = np.abs(exact).max(0)
    # what a column's unit of change moves, relative to what the parameter itself has moved
    errors = np.abs(jacobian - exact).max(0) / np.where(scale > 0, scale, 1.0)
    assert np.all(errors < 1e-11), dict(zip(BASE, errors, strict=True))
    whole = predictions(q[None], EVERY, np.zeros((1, 11)), 0.503, [n], [interval], n, [order])[0][0]
    np.testing.assert_allclose(values, whole, atol=1e-15 * (W1 / interval) ** order)
    twin = np.array(twins(tuple(q), 0.503, interval, n)[0].derivative(order), dtype=float) + q[10]
    np.testing.assert_allclose(whole, twin, rtol=0, atol=1e-12 * np.abs(twin).max())


def test_derivatives_of_random_systems():
    rng = np.random.default_rng(11)
    for _ in range(4):
        system = systems.draw(rng, n=25)
        q = np.where(EVERY[0] >= 0, system.q, 0.0)
        _, jacobian = analytic(q, system.mass, system.interval, system.n)
        exact = differences(q, system.mass, system.interval, system.n)
        scale = np.abs(exact).max(0)
        errors = np.abs(jacobian - exact).max(0) / np.where(scale > 0, scale, 1.0)
        assert np.all(errors < 1e-10), (system, errors)


def test_grams_are_products_of_derivatives_and_residuals():
    theta, columns, constants, mass, samples, starts, counts, intervals = campaign(n=700)
    columns = columns.copy()
    columns[:, 7:10] = -1
    columns[4, [0, 10]] = -1  # not every recording has every column
    constants[4, 0] = 0.2
    found, codes = grams(theta, columns, constants, mass, samples, starts, counts, intervals)
    values, jacobian, _ = trajectories_and_derivatives(
        theta, columns, constants, mass, counts, intervals, counts.sum()
    )
    assert not codes.any() and found.shape == (9, 12, 12)
    assert not jacobian[starts[4] : starts[5], [0, 10]].any()
    for r in range(9):
        here = slice(starts[r], starts[r] + counts[r])
        both = np.column_stack([jacobian[here], samples[here] - values[here]])
        exact = both.T @ both
        scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact))) + 1e-300
        assert np.all(np.abs(found[r] - exact) <= 3e-14 * scale)
    sse, _ = sums_of_squares(
        theta[None], columns, constants, mass, samples, starts, counts, intervals
    )
    np.testing.assert_allclose(found[:, 11, 11], sse[0], rtol=1e-13)
    batch, _ = grams(
        np.tile(theta, (30, 1)), columns, constants, mass, samples, starts, counts, intervals
    )
    np.testing.assert_array_equal(batch[17], found)


@pytest.mark.parametrize("known", [True, False])
def test_a_harmonic_force_has_no_derivatives(known):
    """Not silently none: the effect of that name is a law of the general simulator."""
    columns, constants = EVERY.copy(), np.zeros((1, 11))
    columns[0, 7], constants[0, 7] = (-1, 0.5) if known else (7, 0.0)
    with pytest.raises(InputError, match="harmonic force"):
        trajectories_and_derivatives(
            list(BASE.values()), columns, constants, 0.503, [20], [1e-3], 20
        )


def test_failures_are_codes():
    theta, columns, constants, mass, samples, starts, counts, intervals = campaign()
    columns = columns.copy()
    columns[:, 7:10] = -1
    theta[5] = -1.0
    found, codes = grams(theta, columns, constants, mass, samples, starts, counts, intervals)
    values, jacobian, again = trajectories_and_derivatives(
        theta, columns, constants, mass, counts, intervals, counts.sum()
    )
    np.testing.assert_array_equal(codes, again)
    np.testing.assert_array_equal(codes != 0, np.arange(9) % 3 == 1)
    assert np.isnan(found[1]).all() and np.isfinite(found[0]).all()
    assert (
        np.isnan(jacobian[starts[1] : starts[2]]).all() and np.isfinite(values[: starts[1]]).all()
    )
    with pytest.raises(InputError):
        trajectories_and_derivatives(
            np.tile(theta, (2, 1)), columns, constants, mass, counts, intervals, counts.sum()
        )


@pytest.mark.parametrize(("vectors", "recordings", "n"), [(1, 5, 30_000), (67, 3, 600)])
def test_shares_by_vectors_or_by_recordings_change_nothing(vectors, recordings, n, monkeypatch):
    """One vector of a large campaign is shared out as well, by its recordings."""
    theta, *rest = campaign(count=recordings, n=n)
    rest[0][:, 7:10] = -1
    batch = theta * (1 + 1e-3 * np.random.default_rng(3).standard_normal((vectors, theta.size)))
    threads, sizes, shares = numba.get_num_threads(), [], derivatives.in_shares

    def counted(work, size):
        sizes.append(size)
        shares(work, size)

    monkeypatch.setattr(derivatives, "in_shares", counted)
    try:
        numba.set_num_threads(1)
        alone, _ = grams(batch, *rest)
    finally:
        numba.set_num_threads(threads)
    assert sizes == []
    together, _ = grams(batch, *rest)
    np.testing.assert_array_equal(together, alone)
    if threads > 1:
        assert sizes == [max(vectors, recordings)]
