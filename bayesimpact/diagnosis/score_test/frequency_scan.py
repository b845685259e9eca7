"""Scans over frequency: a harmonic force on the mass, a hum in the probe's signal, a ringing mode.

All have an amplitude and, in every recording, a phase; while the amplitude is zero the phases mean
nothing, so each frequency is tested with a free sine and cosine per recording: 2 R numbers, chi-
squared under the model once the fitted parameters are projected off. The smallest p-value pays for
the number of independent frequencies, and of the decays of what rings down.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.diagnosis.score_test.directions import decays_of, is_periodic, is_steady
from bayesimpact.diagnosis.score_test.forced_responses import (
    Responses,
    force_responses,
    simulated_responses,
)
from bayesimpact.diagnosis.score_test.harmonics import (
    Blocks,
    absorbed,
    blocks_in_parts,
    hums,
    joined,
    line_blocks,
    projected,
    white_line_blocks,
)
from bayesimpact.diagnosis.score_test.scores import LIMIT_SD, Score
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.measurement import magnitude_response

Array = NDArray[np.float64]

RESPONSE_REACH = 2.0  # forcing is looked for up to so many times the natural frequency in contact,
FLIGHT_REACH = 4.0  # or in free flight
LINE_PERIODS = 5.0  # in the longest recording, at least: slower ones pass for a drift
NEAR_RESONANCE = (
    2.0  # times the natural frequency: below, the parameters may absorb nearly all of a hum
)
SIMULATED = 8  # lines, with their neighbours, where a force's responses have to be simulated
ABSORBED = 1e-6  # of a line's power: what is left of so much tells nothing but rounding
LEAST_GAIN = 0.1  # of a filter: hums that it lets through so far leak into the band below


def periodic_scores(fit: Fit, effects: Sequence[Effect], scales: Scales) -> tuple[Score, ...]:
    """The best frequency of every periodic effect that the fit's model does not contain.

    Their p-values are corrected for the number of frequencies.
    """
    have = {e.id for e in fit.density.oscillator.acting}
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
    highest = highest_known(fit)
    if effect.observe is None:
        stiffest = (scales.stiffness + scales.contact_stiffness) / scales.mass
        contact = RESPONSE_REACH * np.sqrt(stiffest) / (2 * np.pi)
        highest = min(0.9 * highest, max(contact, FLIGHT_REACH * scales.natural_frequency))
    return np.arange(LINE_PERIODS / scales.duration, highest, spacing)


def highest_known(fit: Fit) -> float:
    """Highest frequency that all recordings' whitened numbers know, Hz."""
    oscillator, noise = fit.density.oscillator, fit.density.likelihood.noise
    pairs = zip(oscillator.counts, oscillator.intervals, strict=True)
    return min(noise.highest(int(n), float(dt)) for n, dt in pairs)


def leaking(fit: Fit, scales: Scales) -> Array:
    """Frequencies of hums above the band of a filter that leak into it, Hz.

    The whitened numbers end at half power, where a filter still lets a strong hum through.
    """
    smoothing = fit.density.oscillator.smoothing
    if smoothing is None:
        return np.zeros(0)
    interval = float(fit.density.oscillator.intervals.max())
    grid = np.arange(highest_known(fit), 0.5 / interval, 0.5 / scales.duration)
    stopped = np.flatnonzero(magnitude_response(smoothing, interval, grid) < LEAST_GAIN)
    return grid[: stopped[0]] if stopped.size else grid


def _best_frequency(fit: Fit, effect: Effect, scales: Scales) -> Score | None:
    grid = frequencies(fit, effect, scales)
    if grid.size < 2:
        return None
    above = leaking(fit, scales) if effect.observe is not None and is_steady(effect) else grid[:0]
    decays = decays_of(effect, scales)
    trials, shaken = (grid.size + above.size) * decays.size, list[Responses]()
    if effect.observe is None:
        grid, shaken = _forces(fit, grid, scales)
    scans = [_scan_of_frequency(fit, grid, above, decay, scales, shaken) for decay in decays]
    turn = int(np.argmax([statistic.max() for statistic, *_ in scans]))
    statistic, sizes, information, blocks = scans[turn]
    best = int(np.argmax(statistic))
    if best >= grid.size:
        best = grid.size + int(np.argmax(raw_power(fit, above)))
    grid = np.concatenate([grid, above])
    freedom = sizes.shape[1]
    alone = float(stats.chi2.sf(statistic[best], freedom))
    p_value = float(min(1.0, alone * trials))
    amplitude, sd, names = _amplitudes(fit, effect, sizes[best], information[best])
    phases = np.arctan2(sizes[best, 1::2], sizes[best, 0::2]) % (2 * np.pi)
    started = amplitude * np.stack([np.cos(phases), np.sin(phases)])  # with these a refit begins
    return Score(
        effect,
        _shapes(fit, effect, float(grid[best]), float(decays[turn]), phases),
        float(stats.norm.isf(max(p_value, 1e-300) / 2)),
        p_value,
        amplitude,
        sd,
        LIMIT_SD * float(sd[0]),
        absorbed(fit, blocks, best, started.T.ravel()) / fit.sd,
        1.0,
        0.5 * float(statistic[best]) - float(np.log(trials)) - 0.5 * freedom,
        names,
    )


def _forces(fit: Fit, grid: Array, scales: Scales) -> tuple[Array, list[Responses]]:
    """Frequencies out of `grid`, Hz, at which to try a force, and every recording's responses.

    Where they have to be simulated, those of the strongest lines and their neighbours: what a force
    leaves in a reading, once its beginning has faded, is a line at its frequency.
    """
    recordings = range(len(fit.linearisation))
    found = [force_responses(fit, r, grid, scales) for r in recordings]
    simulated = [partial(simulated_responses, fit, r, scales=scales) for r in recordings]
    if None not in found or grid.size <= 3 * SIMULATED:
        return grid, [one or other for one, other in zip(found, simulated, strict=True)]
    lines, *_ = _statistics(fit, [line_blocks(fit, r, grid) for r in recordings])
    padded = np.pad(lines, 1, constant_values=-np.inf)
    peaks = np.flatnonzero((lines >= padded[:-2]) & (lines >= padded[2:]))
    strongest = peaks[np.argsort(lines[peaks])[-SIMULATED:]]
    near = np.unique(np.clip(strongest[:, None] + (-1, 0, 1), 0, grid.size - 1))
    return grid[near], [one or other for one, other in zip(found, simulated, strict=True)]


def _scan_of_frequency(
    fit: Fit, grid: Array, above: Array, decay: float, scales: Scales, shaken: Sequence[Responses]
) -> tuple[Array, Array, Array, list[Blocks]]:
    """Of a force with these responses, or, without any, of a hum."""
    if shaken:
        blocks = [joined(blocks_in_parts(fit, r, grid, one)) for r, one in enumerate(shaken)]
    else:
        recordings = range(len(fit.linearisation))
        blocks = [_blocks(fit, r, grid, above, decay, scales) for r in recordings]
    return *_statistics(fit, blocks), blocks


def _amplitudes(
    fit: Fit, effect: Effect, sizes: Array, information: Array
) -> tuple[Array, Array, tuple[str, ...]]:
    """Amplitudes, their standard deviations and names: one for all recordings, or one each."""
    amplitudes = np.hypot(sizes[0::2], sizes[1::2])
    weight = 0.5 * (np.diag(information)[0::2] + np.diag(information)[1::2])
    if effect.parameter("amplitude").scope == "recording":
        recordings = fit.density.oscillator.campaign.recordings
        names = tuple(f"{effect.id}.amplitude[{r.name}]" for r in recordings)
        return amplitudes, 1.0 / np.sqrt(np.maximum(weight, 1e-300)), names
    amplitude = float(np.sum(weight * amplitudes) / np.sum(weight))
    return np.array([amplitude]), np.array([1 / np.sqrt(weight.sum())]), (f"{effect.id}.amplitude",)


def _blocks(fit: Fit, r: int, grid: Array, above: Array, decay: float, scales: Scales) -> Blocks:
    if fit.density.likelihood.noise.is_white and fit.density.oscillator.smoothing is None:
        return white_line_blocks(fit, r, grid, decay)
    waves = partial(hums, fit, r, decay=decay)
    slow = grid < NEAR_RESONANCE * scales.natural_frequency
    sums = [line_blocks(fit, r, grid[~slow], decay)] if np.sum(~slow) > 1 else []
    near = grid[slow] if sums else grid
    return joined(
        [*blocks_in_parts(fit, r, near, waves), *sums, *blocks_in_parts(fit, r, above, waves)]
    )


def _shapes(
    fit: Fit, effect: Effect, frequency: float, decay: float, phases: Array
) -> dict[str, float]:
    recordings = fit.density.oscillator.campaign.recordings
    shapes = {f"{effect.id}.frequency": frequency}
    if not is_steady(effect):
        shapes[f"{effect.id}.decay"] = decay
    for recording, phase in zip(recordings, phases, strict=True):
        shapes[f"{effect.id}.phase[{recording.name}]"] = float(phase)
    return shapes


def _statistics(fit: Fit, blocks: Sequence[Blocks]) -> tuple[Array, Array, Array]:
    """Chi-squared (F,), sizes (F, 2 R) of sine and cosine, information (F, 2 R, 2 R)."""
    information, score = projected(fit, blocks)
    left = np.einsum("fii->fi", information)
    whole = np.concatenate([np.einsum("fii->fi", block.own) for block in blocks], axis=1)
    scale = np.sqrt(np.where(left > ABSORBED * whole, left, np.inf))
    scaled = information / (scale[:, :, None] * scale[:, None, :])
    ridge = 1e-9 * np.eye(scale.shape[1])
    sizes = np.linalg.solve(scaled + ridge, (score / scale)[..., None])[..., 0] / scale
    return np.einsum("fi,fi->f", sizes, score), sizes, information


def raw_power(fit: Fit, grid: Array) -> Array:
    """Power of all residuals as recorded, not whitened, at frequencies (F,), Hz.

    What leaks into the band tells that a line stands above it, not where.
    """
    power = np.zeros(grid.size)
    for recording, residual in zip(
        fit.density.oscillator.campaign.recordings, fit.residuals, strict=True
    ):
        waves = np.exp(-2j * np.pi * grid[:, None] * recording.times)
        power += np.abs(waves @ (residual * np.hanning(residual.size))) ** 2
    return power
