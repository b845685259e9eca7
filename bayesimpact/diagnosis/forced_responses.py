"""Whitened responses of a recording to a small harmonic force on the mass.

Simulated frequency by frequency, or, for a scan over many, from the derivative of the motion by its
initial state. That derivative does not tell all where a law has a state of its own, and has no
inverse where the mass sticks: simulations at some frequencies say whether it serves.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.directions import sigma_of
from bayesimpact.diagnosis.force import whitened_one, with_law
from bayesimpact.inference.fit import Fit
from bayesimpact.model.arguments import Inputs
from bayesimpact.model.effects.effect import Scales
from bayesimpact.model.effects.harmonic_forcing import EFFECT as HARMONIC_FORCING
from bayesimpact.model.forced import POINTS, Stretch, wave_responses
from bayesimpact.model.motions import general_motions
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
Laws = NDArray[np.int64]

CHECKED = 5  # frequencies at which a simulation is the judge
AGREE = 0.03  # of a response: a scan's chi-squared then errs by its square, 0.1 %
SIZE = 1e-3  # of the noise: changes so small are linear, and far above rounding
FADED = 1e-2  # of its largest size a change keeps four digits: of the noise, rounding is 1e-9
SHORTEST = POINTS + 2  # samples of a stretch
_Y0, _V0, _GAIN = (SLOTS.index(name) for name in ("y0", "v0", "A"))


def force_responses(fit: Fit, r: int, grid: Array, scales: Scales) -> Callable[[Array], Array]:
    """A function of frequencies (F,) out of `grid`, Hz, that gives `simulated_responses`.

    By superposition where that agrees with the simulation at frequencies all over the grid.
    """

    def simulated(frequencies: Array) -> Array:
        return simulated_responses(fit, r, frequencies, scales)

    if grid.size <= CHECKED:
        return simulated
    oscillator, sigma = fit.target.oscillator, sigma_of(fit)
    mass, order = oscillator.campaign.mass, int(oscillator.orders[r])
    interval = float(oscillator.intervals[r])
    found = stretches(fit, r, scales)

    def superposed(frequencies: Array) -> Array:
        waves = wave_responses(found, mass, interval, order, frequencies)
        return whitened_one(fit, r, waves, sigma)

    some = grid[np.linspace(0, grid.size - 1, CHECKED).astype(int)]
    expected = simulated(some)
    try:
        wrong = np.linalg.norm(superposed(some) - expected, axis=1)
    except np.linalg.LinAlgError:  # the mass sticks: what it did before is forgotten
        return simulated
    return superposed if np.all(wrong < AGREE * np.linalg.norm(expected, axis=1)) else simulated


def simulated_responses(fit: Fit, r: int, frequencies: Array, scales: Scales) -> Array:
    """Whitened response to sine and cosine of one newton at every frequency (F,), Hz: (2 F, n)."""
    size = _small(fit, r, scales) * scales.stiffness
    own = np.zeros((2 * frequencies.size + 1, 3))
    own[1:, 0] = size
    own[1:, 1] = np.repeat(frequencies, 2)
    own[1:, 2] = np.tile([0.0, 0.5 * np.pi], frequencies.size)
    oscillator = fit.target.oscillator
    slots = np.tile(oscillator.layout.slots(fit.mode)[r], (own.shape[0], 1))
    laws = with_law(oscillator, HARMONIC_FORCING)
    motion = _motions(fit, r, np.hstack([slots, own]), laws, int(oscillator.orders[r]))
    return whitened_one(fit, r, motion[1:] - motion[0], sigma_of(fit)) / size


def stretches(fit: Fit, r: int, scales: Scales) -> list[Stretch]:
    """Free changes of recording r's motion: by the initial state, later ones by short pushes."""
    oscillator, small = fit.target.oscillator, _small(fit, r, scales)
    last, rate = int(oscillator.counts[r]) - 1, float(np.sqrt(scales.stiffness / scales.mass))
    apart = max(1, round(0.5 * np.pi / (rate * float(oscillator.intervals[r]))))
    free = np.tile(oscillator.layout.slots(fit.mode)[r], (3, 1))
    pushed = free.copy()
    free[1, _Y0] += small
    free[2, _V0] += small * rate
    q, waves = free, np.zeros((3, last + 1))
    found: list[Stretch] = []
    begin = 0
    while begin < last:
        states = np.stack([_changes(fit, r, q, waves, order) for order in (0, 1)], axis=1)
        end = begin + _fading(states[begin:] * [[1.0], [1 / rate]], 2 * apart + SHORTEST)
        end = end if end + SHORTEST <= last else last
        readings = _changes(fit, r, q, waves, int(oscillator.orders[r]))
        found.append(Stretch(begin, states[begin : end + 1], readings[begin : end + 1]))
        q, waves, begin = pushed, np.zeros_like(waves), end
        waves[[1, 2], [end - apart - 1, end - 1]] = small * scales.stiffness
    return found


def _fading(states: Array, least: int) -> int:
    """Samples until one of two changes (n, 2, 2) falls to `FADED` of its largest size."""
    size = np.sqrt(np.sum(states**2, axis=1)).min(axis=1)
    to_come = np.maximum.accumulate(size[::-1])[::-1]
    faded = np.flatnonzero(to_come < FADED * np.maximum.accumulate(size))
    return max(int(faded[0]), least) if faded.size else states.shape[0] - 1


def _changes(fit: Fit, r: int, q: Array, waves: Array, order: int) -> Array:
    """Changes (n, K - 1) of recording r's motion from the first of the slots (K, Q) and pushes."""
    motion = _motions(fit, r, q, fit.target.oscillator.laws, order, waves)
    return np.asarray((motion[1:] - motion[0]).T)


def _motions(
    fit: Fit, r: int, q: Array, laws: Laws, order: int, waves: Array | None = None
) -> Array:
    """Motions (K, n) of recording r for slots (K, Q), with forces (K, n), N, beside its input."""
    oscillator = fit.target.oscillator
    rows = np.full(q.shape[0], r)
    counts, inputs = oscillator.counts[rows], oscillator.inputs
    if inputs is not None:
        inputs = inputs.of(rows)
    if waves is not None:
        q, waves = q.copy(), waves.copy()
        if inputs is None or inputs.starts[0] < 0:
            q[:, _GAIN] = 1.0
        else:
            first = int(inputs.starts[0])
            waves = waves / q[:, [_GAIN]] + inputs.values[first : first + waves.shape[1]]
        inputs = Inputs(waves.reshape(-1), np.arange(q.shape[0]) * waves.shape[1])
    return general_motions(
        q, oscillator.campaign.mass, counts, oscillator.intervals[rows], laws,
        np.full(q.shape[0], order), inputs,
    )  # fmt: skip


def _small(fit: Fit, r: int, scales: Scales) -> float:
    """A displacement, m, that changes recording r's reading by little."""
    oscillator = fit.target.oscillator
    rate = np.sqrt(scales.stiffness / scales.mass)
    level = float(sigma_of(fit)[r] * fit.target.likelihood.scales[r])
    return float(SIZE * level / rate ** int(oscillator.orders[r]))
