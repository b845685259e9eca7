"""Sines and cosines against a fit: their products with each other, J and the residual."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import czt

from bayesimpact.diagnosis.refits.evidence import gradient
from bayesimpact.diagnosis.residual_force.gaussian_process import whitened_one
from bayesimpact.diagnosis.score_test.directions import sigma_of
from bayesimpact.inference.fit import (
    Fit,
    grams,
    inverse,
    likelihood_information,
)

Array = NDArray[np.float64]

AT_ONCE = 32  # frequencies whose responses fit into a processor's cache
EQUAL = 1e-6  # of a spacing: rounding of a grid


@dataclass(frozen=True, eq=False)
class Blocks:
    """One recording at F frequencies: m columns (sine and cosine, or several of them) against each
    other, J and the residual.
    """

    own: Array  # (F, m, m)
    absorbed: Array  # (F, k, m)
    score: Array  # (F, m)
    columns: NDArray[np.int64]  # (k,)


def blocks_of(fit: Fit, r: int, columns: Array) -> Blocks:
    """Products of whitened columns (F, m, n) of recording r."""
    part, sigma = fit.linearisation[r], float(sigma_of(fit)[r])
    own = np.einsum("fin,fjn->fij", columns, columns, optimize=True)
    absorbed = np.einsum("nk,fin->fki", part.jacobian / sigma, columns, optimize=True)
    return Blocks(own, absorbed, columns @ (part.residual / sigma), part.columns)


def blocks_in_parts(
    fit: Fit, r: int, grid: Array, waves: Callable[[Array], Array]
) -> Iterator[Blocks]:
    """Blocks of whitened sines and cosines (2 F, n) at F frequencies, some of them at a time."""
    for some in np.array_split(grid, -(-grid.size // AT_ONCE)) if grid.size else ():
        yield blocks_of(fit, r, waves(some).reshape(some.size, 2, -1))


def joined(parts: Iterable[Blocks]) -> Blocks:
    """One recording's blocks at the frequencies of all parts."""
    found = list(parts)
    own, absorbed, score = (
        np.concatenate([getattr(block, name) for block in found])
        for name in ("own", "absorbed", "score")
    )
    return Blocks(own, absorbed, score, found[0].columns)


def absorbed(fit: Fit, blocks: Sequence[Blocks], at: int, sizes: Array) -> Array:
    """Shift of the model's parameters (d,) that ignoring lines at one frequency causes, whose
    columns have these sizes (m R,).
    """
    shift, own = np.zeros(fit.mode.size), blocks[0].score.shape[1]
    for block, mine in zip(blocks, sizes.reshape(-1, own), strict=True):
        shift[block.columns] += block.absorbed[at] @ mine
    shift[fit.density.oscillator.layout.roles("noise")] = 0.0
    return np.asarray(fit.covariance @ shift)


def line_blocks(fit: Fit, r: int, grid: Array, decay: float = 0.0) -> Blocks:
    """A hum of one metre at equally spaced frequencies (F,), Hz, two or more of them.

    By Fourier sums of the whitened residual and derivatives: all but exact where the fitted
    parameters absorb little of it, and where it decays (1/s) slowly beside its period.
    """
    part, sigma, noise = fit.linearisation[r], sigma_of(fit)[r], fit.density.likelihood.noise
    oscillator = fit.density.oscillator
    interval, count = float(oscillator.intervals[r]), int(oscillator.counts[r])
    white = np.vstack([part.residual, part.jacobian.T]) / sigma
    used = oscillator.campaign.recordings[r].used
    stacked, start = noise.in_time(white, count, interval, used)
    n = stacked.shape[-1]
    envelope = np.exp(-decay * (start + interval * np.arange(n)))
    lift = _whitening_gain(fit, grid, interval) / (sigma * fit.density.likelihood.scales[r])
    sums = _fourier_sums(stacked * envelope, grid, interval) * np.exp(-2j * np.pi * grid * start)
    pairs = np.stack([-sums.imag, sums.real], axis=-1) * lift[:, None]  # (1 + k, F, 2)
    own = (0.5 * np.sum(envelope**2) * lift**2)[:, None, None] * np.eye(2)
    return Blocks(own, pairs[1:].transpose(1, 0, 2), pairs[0], part.columns)


def white_line_blocks(fit: Fit, r: int, grid: Array, decay: float = 0.0) -> Blocks:
    """The same at any frequencies, exact, where the noise of recording `r` is white."""
    part, sigma = fit.linearisation[r], float(sigma_of(fit)[r] * fit.density.likelihood.scales[r])
    recording = fit.density.oscillator.campaign.recordings[r]
    seen = np.exp(-decay * recording.times) / sigma
    if recording.used is not None:
        seen = np.where(recording.used, seen, 0.0)
    white = np.vstack([part.residual, part.jacobian.T]) / sigma_of(fit)[r]
    sums = _fourier_sums(white * seen, grid, recording.interval)
    pairs = np.stack([-sums.imag, sums.real], axis=-1)  # (1 + k, F, 2)
    twice = _fourier_sums((seen**2)[None], 2 * grid, recording.interval)[0]
    mean, even, odd = 0.5 * np.sum(seen**2), 0.5 * twice.real, -0.5 * twice.imag
    own = np.array([[mean - even, odd], [odd, mean + even]]).transpose(2, 0, 1)
    return Blocks(own, pairs[1:].transpose(1, 0, 2), pairs[0], part.columns)


def _fourier_sums(signals: Array, grid: Array, interval: float) -> NDArray[np.complex128]:
    """Sums of signals (K, n) times exp(-2 pi i f t) at equally spaced frequencies (F,), Hz."""
    step = 2 * np.pi * interval * (grid[1] - grid[0])
    first = 2 * np.pi * interval * grid[0]
    return np.asarray(czt(signals, grid.size, np.exp(-1j * step), np.exp(1j * first), axis=-1))


def _whitening_gain(fit: Fit, grid: Array, interval: float) -> Array:
    return np.asarray(1.0 / np.sqrt(fit.density.likelihood.noise.spectrum(grid, interval)))


def hums(fit: Fit, r: int, lines: Array, decay: float = 0.0) -> Array:
    """Whitened sine and cosine of one unit of the reading at every frequency (F,), Hz: (2 F, n).

    From the first sample on they decay, 1/s.
    """
    times = fit.density.oscillator.campaign.recordings[r].times
    turns = rotations(lines, times) * np.exp(-decay * times)
    waves = np.stack([turns.imag, turns.real], axis=1).reshape(2 * lines.size, -1)
    return whitened_one(fit, r, waves, sigma_of(fit))


def rotations(lines: Array, times: Array) -> NDArray[np.complex128]:
    """exp(2 pi i f t) at frequencies (F,), Hz, and times (n,), s: (F, n).

    Where they are equally spaced, each is the one before turned by the same step: a product instead
    of a sine and a cosine.
    """
    spacing = np.diff(lines)
    if lines.size < 3 or np.ptp(spacing) > EQUAL * abs(spacing[0]):
        return np.asarray(np.exp(2j * np.pi * lines[:, None] * times))
    found = np.empty((lines.size, times.size), dtype=np.complex128)
    found[0] = np.exp(2j * np.pi * lines[0] * times)
    step = np.exp(2j * np.pi * spacing.mean() * times)
    for k in range(1, lines.size):
        np.multiply(found[k - 1], step, out=found[k])
    return found


def projected(fit: Fit, blocks: Sequence[Blocks]) -> tuple[Array, Array]:
    """Information (F, m R, m R) and score (F, m R) with what the parameters absorb taken off."""
    count, own = blocks[0].score.shape
    width = own * len(blocks)
    sigma = sigma_of(fit)
    matrix = np.diag(fit.density.priors.information(fit.mode))
    noise = fit.density.oscillator.layout.roles("noise")
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
    solve = inverse(matrix)
    information -= np.einsum("fdi,de,fej->fij", shared, solve, shared, optimize=True)
    slope = gradient(fit)  # zero at the mode; an ascent ends near it
    slope[noise] = 0.0
    score -= np.einsum("fdi,d->fi", shared, solve @ slope)
    return 0.5 * (information + information.transpose(0, 2, 1)), score
