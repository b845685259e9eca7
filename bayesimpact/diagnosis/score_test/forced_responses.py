"""Whitened responses of a recording to a small harmonic force on the mass.

Simulated frequency by frequency, or, for a scan over many, superposed where simulations at some
frequencies agree with that.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.residual_force.gaussian_process import whitened_one, with_law
from bayesimpact.diagnosis.score_test.directions import sigma_of
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Scales
from bayesimpact.model.effects.harmonic_forcing import EFFECT as HARMONIC_FORCING
from bayesimpact.model.linear_response.forced import wave_responses
from bayesimpact.model.linear_response.free_changes import free_changes, motions_beside

Array = NDArray[np.float64]
Responses = Callable[[Array], Array]
"""Of frequencies (F,), Hz: whitened responses to sine and cosine of one newton, (2 F, n)."""

CHECKED = 5  # frequencies at which a simulation checks the scan
AGREE = 0.03  # of a response: a scan's chi-squared then errs by its square, 0.1 %
SIZE = 1e-3  # of the noise: changes so small are linear, and far above rounding


def force_responses(fit: Fit, r: int, grid: Array, scales: Scales) -> Responses | None:
    """A function of frequencies (F,) out of `grid`, Hz, that gives `simulated_responses` by
    superposition; None where that does not agree with the simulation at frequencies all over the
    grid, as behind a law with a state of its own.
    """
    oscillator, sigma = fit.density.oscillator, sigma_of(fit)
    slots = oscillator.layout.slots(fit.mode)[r]
    changes = free_changes(oscillator, r, slots, _small(fit, r, scales))

    def superposed(frequencies: Array) -> Array:
        return whitened_one(fit, r, wave_responses(changes, frequencies), sigma)

    some = grid[np.linspace(0, grid.size - 1, min(CHECKED, grid.size)).astype(int)]
    expected = simulated_responses(fit, r, some, scales)
    wrong = np.linalg.norm(superposed(some) - expected, axis=1)
    return superposed if np.all(wrong < AGREE * np.linalg.norm(expected, axis=1)) else None


def simulated_responses(fit: Fit, r: int, frequencies: Array, scales: Scales) -> Array:
    """Whitened response to sine and cosine of one newton at every frequency (F,), Hz: (2 F, n)."""
    size = _small(fit, r, scales) * scales.stiffness
    own = np.zeros((2 * frequencies.size + 1, 3))
    own[1:, 0] = size
    own[1:, 1] = np.repeat(frequencies, 2)
    own[1:, 2] = np.tile([0.0, 0.5 * np.pi], frequencies.size)
    oscillator = fit.density.oscillator
    slots = np.tile(oscillator.layout.slots(fit.mode)[r], (own.shape[0], 1))
    laws = with_law(oscillator, HARMONIC_FORCING)
    order = int(oscillator.orders[r])
    motion = motions_beside(oscillator, r, np.hstack([slots, own]), order, laws=laws)
    return whitened_one(fit, r, motion[1:] - motion[0], sigma_of(fit)) / size


def _small(fit: Fit, r: int, scales: Scales) -> float:
    """A displacement, m, that changes recording r's reading by little."""
    oscillator = fit.density.oscillator
    rate = np.sqrt(scales.stiffness / scales.mass)
    level = float(sigma_of(fit)[r] * fit.density.likelihood.scales[r])
    return float(SIZE * level / rate ** int(oscillator.orders[r]))
