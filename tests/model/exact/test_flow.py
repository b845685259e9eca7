"""Closed forms of one regime against mpmath, at ordinary places and where formulas cancel."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from bayesimpact.model.exact.flow import (
    advance,
    forced_response,
    impulse_response,
    second_response,
)
from bayesimpact.model.exact.sensitivities import basis
from bayesimpact.model.exact.tables import LENGTH, ROWS, fill

# b, K, w, t
CASES = {
    "ordinary": (0.3, 4.0, 1.3, 1.7),
    "undamped": (0.0, 4.0, 1.3, 2.5),
    "early": (0.3, 4.0, 1.3, 1e-5),
    "late": (0.002, 1.0, 0.7, 30.0),
    "critical": (2.0, 4.0, 1.0, 1.5),
    "hardly under-damped": (2.0, 4.0000000001, 1.0, 1.5),
    "hardly over-damped": (2.0, 3.9999, 1.0, 1.5),
    "over-damped": (5.0, 4.0, 1.0, 1.5),
    "far over-damped": (40.0, 4.0, 1.0, 2.0),
    "resonance": (0.0, 4.0, 2.0, 3.0),
    "almost resonance": (0.0, 4.0, 2.0 + 1e-9, 3.0),
    "near resonance": (1e-3, 4.0, 1.97, 3.0),
    "late resonance": (1e-6, 4.0, 2.0, 12.0),
    "constant force": (0.1, 4.0, 0.0, 2.0),
    "fast force": (0.1, 4.0, 25.0, 2.0),
}


def exact(b, K, w, t):
    """S, D, E, F, G, H by their definitions: roots and convolution integrals."""
    b, K, w, t = (mp.mpf(x) for x in (b, K, w, t))
    root = mp.sqrt(mp.mpc(b * b - K * (1 + mp.mpf(10) ** -17)))

    def S(s):
        return (mp.exp(-b * s) * mp.sinh(root * s) / root).real

    def D(s):
        return (mp.exp(-b * s) * (mp.cosh(root * s) - b * mp.sinh(root * s) / root)).real

    def G(s):  # S*S from the derivative of S with respect to K
        return (
            mp.exp(-b * s) * (s * mp.cosh(root * s) - mp.sinh(root * s) / root) / root**2 / 2
        ).real

    pieces = mp.linspace(0, t, 2 + int(t * (w + mp.sqrt(K) + b) / 3))

    def convolve(f, g):
        return mp.quad(lambda s: f(t - s) * g(s), pieces)

    return {
        "S": S(t),
        "D": D(t),
        "E": convolve(S, lambda s: mp.cos(w * s)),
        "F": convolve(S, lambda s: mp.sin(w * s)),
        "G": G(t),
        "H": convolve(S, D),
    }


@pytest.mark.parametrize("case", CASES)
def test_closed_forms(case):
    b, K, w, t = CASES[case]
    with mp.workdps(36):
        truth = exact(b, K, w, t)
    S, D = impulse_response(b, K, t)
    E, F = forced_response(b, K, w, t, S, D)
    G, H = second_response(b, K, t, S, D)
    found = {"S": S, "D": D, "E": E, "F": F, "G": G, "H": H}
    # scale: an amplitude that the function has had by time t; phases are known to eps * (rate * t)
    w0 = K**0.5
    rate = min(t, 1 / max(w0, 2 * b))
    slow = min(t, max(1, 2 * b / w0) / w0)
    turned = min(1, w * slow)
    largest = {"S": rate, "D": 1.0, "E": rate * slow, "F": rate * slow * turned}
    largest |= {"G": rate * rate * slow, "H": rate * rate}
    for name, value in found.items():
        scale = max(abs(float(truth[name])), 1e-2 * largest[name], 1e-300)
        error = abs(float(value - truth[name])) / scale
        assert error < 2e-13 * max(1.0, (w0 + w) * t / 10), (name, value, float(truth[name]), error)


def test_advance_composes():
    b, K, u, v = 0.2, 3.0, 0.7, -0.4
    two = advance(
        b, K, *advance(b, K, u, v, *impulse_response(b, K, 0.8)), *impulse_response(b, K, 1.1)
    )
    one = advance(b, K, u, v, *impulse_response(b, K, 1.9))
    np.testing.assert_allclose(two, one, rtol=1e-14)


@pytest.mark.parametrize(
    ("b", "K", "w"),
    [
        (0.0, 0.0016, 0.04),
        (0.002, 0.0121, 0.05),
        (0.03, 0.0009, 0.2),
        (0.9, 0.02, 1.0),
        (0.05, 8.0, 3.0),
    ],
)
def test_tables_equal_the_closed_forms_at_every_sample(b, K, w):
    table = np.empty((ROWS, LENGTH + 1))
    fill(table, b, K, w, True)
    wide, value = np.empty((basis.SIZE, LENGTH)), np.empty(basis.SIZE)
    basis.fill_table(wide, value, b, K)
    scale, wide_scale = np.abs(table).max(1), np.abs(wide).max(1)
    for j in range(LENGTH):
        S, D = impulse_response(b, K, float(j))
        E, F = forced_response(b, K, w, float(j), S, D)
        assert np.all(np.abs(table[:, j] - (S, D, E, F)) <= 1e-14 * scale)
        basis.fill_basis(value, b, K, float(j))
        assert np.all(np.abs(wide[:, j] - value) <= 3e-14 * wide_scale)
    S, D = impulse_response(b, K, float(LENGTH))
    assert np.all(np.abs(table[:2, LENGTH] - (S, D)) <= 1e-14 * scale[:2])
