"""The two methods of the general simulator: order conditions and responses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesimpact.model.exact.flow import impulse_response
from bayesimpact.model.general.method import place_stage, quarters, stage

NODES = np.array([0, 1, 1, 2, 3, 4]) / 4


def tableau() -> tuple[np.ndarray, np.ndarray]:
    """Butcher's A and b, read off `stage` by feeding it units (the responses all 1)."""
    rows = []
    for number in range(1, 7):
        rows.append([stage.py_func(number, 0.0, *[1.0] * 5, *unit) for unit in np.eye(6)])
    A = np.zeros((6, 6))
    A[1:] = rows[:5]
    return A, np.array(rows[5])


def test_order_conditions():
    """All seventeen conditions up to order five (Hairer, Norsett and Wanner 1993, table II.2.1)."""
    A, b = tableau()
    c = NODES
    np.testing.assert_allclose(A.sum(axis=1), c, atol=1e-15)
    assert np.all(np.triu(A) == 0)
    u, v = A @ c, A @ c**2
    conditions = {
        1: b.sum(), 2: b @ c, 3: b @ c**2, 6: b @ u, 4: b @ c**3, 8: b @ (c * u), 12: b @ v,
        24: b @ A @ u, 5: b @ c**4, 10: b @ (c**2 * u), 15: b @ (c * v), 30: b @ (c * (A @ u)),
        20: b @ u**2, 40: b @ A @ (c * u), 60: b @ A @ v, 120: b @ A @ A @ u,
    }  # fmt: skip
    assert b @ A @ c**3 == pytest.approx(1 / 20)
    for inverse, found in conditions.items():
        assert found == pytest.approx(1 / inverse, abs=1e-14)
    assert b @ c**5 == pytest.approx(1 / 6, abs=1e-14)  # Boole's rule is of order six


def test_responses_belong_to_the_nodes():
    """Every force reaches a later stage through the response over the time between the two."""
    responses = [0.0, 1.0, 10.0, 100.0, 1000.0]  # c0 to c4
    A, b = tableau()
    for number in range(1, 7):
        here = NODES[number] if number < 6 else 1.0
        for j, unit in enumerate(np.eye(6)):
            weight = A[number, j] if number < 6 else b[j]
            apart = round(4 * (here - NODES[j])) if weight else 0
            found = stage.py_func(number, 0.0, *responses, *unit)
            assert found == pytest.approx(weight * responses[apart], rel=1e-14)


def place_tableau() -> tuple[np.ndarray, np.ndarray]:
    """The Nystroem method's weights of each stage and of the end, before the responses."""
    rows = [
        [place_stage.py_func(number, 0.0, *[1.0] * 5, *unit) for unit in np.eye(5)]
        for number in range(1, 5)
    ]
    A = np.zeros((4, 5))
    A[1:] = rows[:3]
    return A, np.array(rows[3])


def test_order_conditions_where_no_force_depends_on_the_velocity():
    """Order five with any linear flow: S(x) = x + s2 x^2 + s3 x^3 + ... within a step.

    Hairer, Norsett and Wanner (1993, table II.14.3) have those with S(x) = x; the others follow in
    the same way, with a weight for every power of S.
    """
    A, b = place_tableau()
    c = np.arange(5) / 4
    apart = c[:4, None] - c[None, :]
    assert np.all(np.triu(A) == 0)
    for k in range(6):  # Boole's rule
        assert b @ c**k == pytest.approx(1 / (k + 1), abs=1e-14)
    reach = np.zeros((5, 4, 4))  # [i, p, k]: what S^p and forces in c^k do at stage i
    exact = np.zeros((5, 4, 4))
    for p in range(1, 4):
        for k in range(3):
            reach[:4, p, k] = (A * apart**p) @ c**k
            reach[4, p, k] = b @ ((1 - c) ** p * c**k)  # the end: y there is a stage as well
            over = math.factorial(p) * math.factorial(k) / math.factorial(p + k + 1)
            exact[:, p, k] = over * c ** (p + k + 1)
    missing = reach - exact
    for order in range(3, 6):  # of the velocity; those of the displacement have (1 - c) b for b
        for p in range(1, order - 1):
            for k in range(order - 1 - p):
                power = order - 2 - p - k
                assert b @ (c**power * missing[:, p, k]) == pytest.approx(0, abs=1e-15)
                if power > 0 and order < 5:
                    assert b @ ((1 - c) * c ** (power - 1) * missing[:, p, k]) == pytest.approx(
                        0, abs=1e-15
                    )
    np.testing.assert_allclose(missing[:, 1, 0], 0, atol=1e-15)  # so nested trees add nothing


def test_order_of_a_step_where_no_force_depends_on_the_velocity():
    """A pendulum with drag: halving the steps divides the error by 2^5."""
    b, K, end, errors = 0.4, 9.0, 2.0, []

    def added(y: float) -> float:
        return K * (y - math.sin(y))

    def right(_: float, x: np.ndarray) -> list[float]:
        return [x[1], -2 * b * x[1] - K * x[0] + added(x[0])]

    exact = solve_ivp(right, (0, end), [1.2, 0.5], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    for steps in (20, 40):
        at, y, v = quarters(end / steps, b, K, 1.0), 1.2, 0.5
        S = [0.0, at.S1, at.S2, at.S3, at.S4]
        D = [1.0, at.D1, at.D2, at.D3, at.D4]
        F, G = [0.0, at.F1, at.F2, at.F3, at.F4], [at.G0, at.G1, at.G2, at.G3, at.G4]
        for _ in range(steps):
            n = [added(y), 0.0, 0.0, 0.0, 0.0]
            for k in range(1, 5):
                base = D[k] * y + S[k] * (v + 2 * b * y)
                ahead = place_stage.py_func(k, base, *F, *n)
                n[k] = added(ahead)
            v = place_stage.py_func(4, D[4] * v - S[4] * K * y, *G, *n)
            y = ahead
        errors.append(np.abs(np.array([y, v]) - exact).max())
    assert errors[0] < 1e-4
    assert 2**4.6 < errors[0] / errors[1] < 2**6


@pytest.mark.parametrize(("b", "K"), [(0.15, 1600.0), (3.0, 12000.0), (200.0, 1600.0), (0.0, 4.0)])
def test_quarters(b, K):
    h, inverse = 0.8 / np.sqrt(K), 2.0
    at = quarters(h, b, K, inverse)
    for k in range(1, 5):
        S, D = impulse_response(b, K, k * h / 4)
        found = [getattr(at, f"{name}{k}") for name in "SDFG"]
        expected = [S, D, h * inverse * S, h * inverse * D]
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-16)
    assert h * inverse == at.G0
