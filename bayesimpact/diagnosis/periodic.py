"""Scans over frequency: a harmonic force on the mass, a hum in the probe's signal.

Both have an amplitude and, in every recording, a phase; while the amplitude is zero the phases mean
nothing, so each frequency is tested with a free sine and cosine per recording: 2 R numbers, chi-
squared under the model once the fitted parameters are projected off. The smallest p-value pays for
the number of independent frequencies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.signal import czt

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.directions import is_periodic, sigma_of
from bayesimpact.diagnosis.force import whitened_one
from bayesimpact.diagnosis.scores import LIMIT_SD, Score
from bayesimpact.inference.fit import (
    Fit,
    grams,
    inverse,
    likelihood_information,
    prior_information,
)
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]

RESPONSE_REACH = 2.0  # forcing is looked for up to so many times the natural frequency in contact,
FLIGHT_REACH = 4.0  # or in free flight
HUM_ABOVE = 1.5  # times the natural frequency of free flight
OWN_BAND = 0.1  # of the spectrum's peak
AT_ONCE = 32  # frequencies whose responses fit into a processor's cache
_FORCE, _OMEGA, _PHASE = (SLOTS.index(s) for s in ("A", "w", "phase"))


@dataclass(frozen=True, eq=False)
class Blocks:
    """One recording at F frequencies: m columns (sine and cosine, or several of them) against each
    other, J and the residual.
    """

    own: Array  # (F, m, m)
    absorbed: Array  # (F, k, m)
    score: Array  # (F, m)
    columns: NDArray[np.int64]  # (k,)


def periodic_scores(fit: Fit, effects: Sequence[Effect], scales: Scales) -> tuple[Score, ...]:
    """The best frequency of every periodic effect that the fit's model does not contain.

    Their p-values are corrected for the number of frequencies.
    """
    have = {e.id for e in fit.target.oscillator.effects}
    found = []
    for effect in effects:
        if effect.id in have or not is_periodic(effect) or not effect.admissible(scales):
            continue
        score = _best_frequency(fit, effect, scales)
        if score is not None:
            found.append(score)
    return tuple(found)


def frequencies(fit: Fit, effect: Effect, scales: Scales) -> Array:
    """Frequencies to scan, Hz: finer than the resolution of the longest recording."""
    spacing = (0.5 if effect.observe is not None else 0.75) / scales.duration
    oscillator, noise = fit.target.oscillator, fit.target.likelihood.noise
    pairs = zip(oscillator.counts, oscillator.intervals, strict=True)
    highest = min(noise.highest(int(n), float(dt)) for n, dt in pairs)
    if effect.observe is None:
        stiffest = (scales.stiffness + scales.contact_stiffness) / scales.mass
        contact = RESPONSE_REACH * np.sqrt(stiffest) / (2 * np.pi)
        highest = min(0.9 * highest, max(contact, FLIGHT_REACH * scales.natural_frequency))
        return np.arange(2 * spacing, highest, spacing)
    lowest = HUM_ABOVE * scales.natural_frequency  # below, the motion itself would pass for a hum
    return np.arange(max(2 * spacing, lowest), highest, spacing)


def shakes_in_own_band(fit: Fit, gross: bool) -> bool:
    """True when the model has a harmonic force at a frequency at which the motion swings anyway.

    There a decaying motion and a forced one differ only by phase, and the force passes for any slow
    change of frequency or damping: over the whole band where the misfit is `gross`, and always
    where the recordings are too short to tell both frequencies apart.
    """
    names = [f"{e.id}.frequency" for e in fit.target.oscillator.effects if _is_force(e)]
    found = [float(fit.mode[fit.names.index(name)]) for name in names]
    recordings = fit.target.oscillator.campaign.recordings
    swings = _swings if gross else _is_unresolved
    return any(swings(recording, frequency) for frequency in found for recording in recordings)


def _is_force(effect: Effect) -> bool:
    return is_periodic(effect) and effect.observe is None


def _spectrum(recording: Recording) -> Array:
    """Amplitudes at multiples of the reciprocal of the duration, but for the mean."""
    return np.abs(np.fft.rfft(recording.samples - recording.samples.mean()))


def _swings(recording: Recording, frequency: float) -> bool:
    """Whether a recording has a good part of its spectrum's peak at a frequency, Hz."""
    spectrum = _spectrum(recording)
    at = frequency * recording.samples.size * recording.interval
    near = spectrum[max(1, int(at) - 1) : int(at) + 3]
    return bool(near.size and near.max() > OWN_BAND * spectrum[1:].max())


def _is_unresolved(recording: Recording, frequency: float) -> bool:
    """Whether a recording's strongest line lies closer to a frequency, Hz, than its duration can
    separate."""
    peak = 1 + int(np.argmax(_spectrum(recording)[1:]))
    return abs(frequency * recording.samples.size * recording.interval - peak) < 1.0


def _best_frequency(fit: Fit, effect: Effect, scales: Scales) -> Score | None:
    grid = frequencies(fit, effect, scales)
    if grid.size < 2:
        return None
    recordings = range(len(fit.linearisation))
    if effect.observe is not None:
        blocks = [line_blocks(fit, r, grid) for r in recordings]
    else:
        blocks = [_response_blocks(fit, r, grid, scales) for r in recordings]
    statistic, sizes, information = _statistics(fit, blocks)
    best = int(np.argmax(statistic))
    freedom = 2 * len(blocks)
    alone = float(stats.chi2.sf(statistic[best], freedom))
    p_value = float(min(1.0, alone * grid.size))
    amplitudes = np.hypot(sizes[best, 0::2], sizes[best, 1::2])
    weight = 0.5 * (np.diag(information[best])[0::2] + np.diag(information[best])[1::2])
    amplitude = float(np.sum(weight * amplitudes) / np.sum(weight))
    sd = float(1 / np.sqrt(weight.sum()))
    return Score(
        effect,
        _shapes(fit, effect, float(grid[best]), sizes[best]),
        float(stats.norm.isf(max(p_value, 1e-300) / 2)),
        p_value,
        np.array([amplitude]),
        np.array([sd]),
        LIMIT_SD * sd,
        np.zeros(fit.mode.size),
        1.0,
        0.5 * float(statistic[best]) - float(np.log(grid.size)) - 0.5 * freedom,
        (f"{effect.id}.amplitude",),
    )


def _shapes(fit: Fit, effect: Effect, frequency: float, sizes: Array) -> dict[str, float]:
    phases = np.arctan2(sizes[1::2], sizes[0::2]) % (2 * np.pi)
    recordings = fit.target.oscillator.campaign.recordings
    shapes = {f"{effect.id}.frequency": frequency}
    for recording, phase in zip(recordings, phases, strict=True):
        shapes[f"{effect.id}.phase[{recording.name}]"] = float(phase)
    return shapes


def _statistics(fit: Fit, blocks: Sequence[Blocks]) -> tuple[Array, Array, Array]:
    """Chi-squared (F,), sizes (F, 2 R) of sine and cosine, information (F, 2 R, 2 R)."""
    information, score = projected(fit, blocks)
    scale = np.sqrt(np.maximum(np.einsum("fii->fi", information), 1e-300))
    scaled = information / (scale[:, :, None] * scale[:, None, :])
    ridge = 1e-9 * np.eye(scale.shape[1])
    sizes = np.linalg.solve(scaled + ridge, (score / scale)[..., None])[..., 0] / scale
    return np.einsum("fi,fi->f", sizes, score), sizes, information


def projected(fit: Fit, blocks: Sequence[Blocks]) -> tuple[Array, Array]:
    """Information (F, m R, m R) and score (F, m R) with what the parameters absorb taken off."""
    count, own = blocks[0].score.shape
    width = own * len(blocks)
    sigma = sigma_of(fit)
    matrix = np.diag(prior_information(fit.target.priors, fit.mode))
    noise = fit.target.oscillator.layout.roles("noise")
    matrix[noise, noise] = 0.0
    parts = fit.linearisation
    matrix += likelihood_information(parts, grams(parts), sigma, fit.mode.size)
    shared = np.zeros((count, fit.mode.size, width))
    information = np.zeros((count, width, width))
    score = np.zeros((count, width))
    for r, block in enumerate(blocks):
        at = slice(own * r, own * (r + 1))
        shared[:, block.columns, at] = block.absorbed
        information[:, at, at] = block.own
        score[:, at] = block.score
    information -= np.einsum("fdi,de,fej->fij", shared, inverse(matrix), shared, optimize=True)
    return 0.5 * (information + information.transpose(0, 2, 1)), score


def line_blocks(fit: Fit, r: int, grid: Array) -> Blocks:
    """A hum of one metre: Fourier sums of the whitened residual and derivatives."""
    part, sigma, noise = fit.linearisation[r], sigma_of(fit)[r], fit.target.likelihood.noise
    oscillator = fit.target.oscillator
    interval, count = float(oscillator.intervals[r]), int(oscillator.counts[r])
    white = np.vstack([part.residual, part.jacobian.T]) / sigma
    stacked, start = noise.in_time(white, count, interval)
    step = 2 * np.pi * interval * (grid[1] - grid[0])
    first = 2 * np.pi * interval * grid[0]
    sums = czt(stacked, grid.size, np.exp(-1j * step), np.exp(1j * first), axis=-1)
    gain = _whitening_gain(fit, grid, interval) / sigma
    sums = sums * np.exp(-2j * np.pi * grid * start)
    pairs = np.stack([-sums.imag, sums.real], axis=-1) * gain[:, None]  # (1 + k, F, 2)
    n = stacked.shape[-1]
    own = np.repeat((0.5 * n * gain**2)[:, None, None] * np.eye(2), 1, axis=0)
    return Blocks(own, pairs[1:].transpose(1, 0, 2), pairs[0], part.columns)


def _whitening_gain(fit: Fit, grid: Array, interval: float) -> Array:
    rho = fit.target.likelihood.noise.correlation
    angle = 2 * np.pi * grid * interval
    return np.sqrt((1 - 2 * rho * np.cos(angle) + rho**2) / (1 - rho**2))


def _response_blocks(fit: Fit, r: int, grid: Array, scales: Scales) -> Blocks:
    """A force of one newton: simulated responses to its sine and cosine."""
    found = []
    for some in np.array_split(grid, -(-grid.size // AT_ONCE)):
        pairs = force_responses(fit, r, some, scales).reshape(some.size, 2, -1)
        found.append(blocks_of(fit, r, pairs))
    own, absorbed, score = (
        np.concatenate([getattr(block, name) for block in found])
        for name in ("own", "absorbed", "score")
    )
    return Blocks(own, absorbed, score, found[0].columns)


def blocks_of(fit: Fit, r: int, columns: Array) -> Blocks:
    """Products of whitened columns (F, m, n) of recording r."""
    part, sigma = fit.linearisation[r], float(sigma_of(fit)[r])
    own = np.einsum("fin,fjn->fij", columns, columns, optimize=True)
    absorbed = np.einsum("nk,fin->fki", part.jacobian / sigma, columns, optimize=True)
    return Blocks(own, absorbed, columns @ (part.residual / sigma), part.columns)


def force_responses(fit: Fit, r: int, grid: Array, scales: Scales) -> Array:
    """Whitened responses (2 F, n) to sine and cosine of one newton at frequencies (F,), Hz."""
    oscillator, sigma = fit.target.oscillator, sigma_of(fit)
    slots = oscillator.layout.slots(fit.mode)[r]
    size = 1e-3 * float(sigma[r]) * scales.stiffness
    q = np.tile(slots, (2 * grid.size + 1, 1))
    q[1:, _FORCE] = size
    q[1:, _OMEGA] = np.repeat(2 * np.pi * grid, 2)
    q[1:, _PHASE] = np.tile([0.0, 0.5 * np.pi], grid.size)
    motion = oscillator.motions_of(np.full(q.shape[0], r), q)
    return whitened_one(fit, r, motion[1:] - motion[0], sigma) / size
