"""The Runge-Kutta method of the general simulator: order conditions and responses."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.model.added.method import quarters, stage
from bayesimpact.model.flow import impulse_response

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
