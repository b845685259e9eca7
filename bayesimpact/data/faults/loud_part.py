"""`recording_noise` of a short recording: part of it has noise of another, larger level.

Where `find_noise` has too few samples for blocks whose noise it tells from every fast motion, one
thing still is no motion: a level that steps up, or down, and is even on either side of the step. A
fast mode or the ringing of a contact decays from block to block instead, and has its own colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.faults.fault import Fault, gaussian_threshold
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.faults.noise import (
    BLOCKS,
    FACTOR,
    LEAST_BLOCK,
    LOUD,
    SAME,
    SCATTER,
    noise_fault,
)
from bayesimpact.data.period import noise_level
from bayesimpact.data.recording import Recording

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

SHORTEST = 40  # samples of a block: a level of twice the usual one is four errors off
LEAST = 6  # blocks
RMS_SCATTER = 1.26  # as `SCATTER`, of a level by the mean square: sqrt(sum of squared rho_k / 2)
STEPS = 1.5  # of the noise of rounding: a level below may be the motion's, not the noise's
EVEN = 3.0  # standard errors, by which even levels differ
LINE = 0.01  # chance that noise shows a line


@dataclass(frozen=True, eq=False)
class _Levels:
    """Noise of blocks (B,), from mean squares of sixth and fourth differences, and by the bulk."""

    sixth: Floats
    fourth: Floats
    bulk: Floats

    @classmethod
    def of(cls, blocks: Sequence[Floats]) -> _Levels:
        return cls(
            np.array([_rms(x, 6) for x in blocks]),
            np.array([_rms(x, 4) for x in blocks]),
            np.array([noise_level(x) for x in blocks]),
        )


def find_loud_part(recording: Recording) -> list[Fault]:
    """Blocks whose noise is three times the recording's usual one, and as loud as one another.

    Recordings whose blocks `find_noise` compares are left to it, and accelerations beside a stop,
    where contacts ring.
    """
    x = recording.samples
    count = min(BLOCKS, x.size // SHORTEST)
    rings = bool(recording.case) and recording.order == 2
    if count < LEAST or x.size >= 4 * LEAST_BLOCK or rings:
        return []
    edges = np.linspace(0, x.size, count + 1).astype(int)
    parts = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    blocks = [x[a:b] for a, b in parts]
    levels = _Levels.of(blocks)
    usual = float(np.median(levels.sixth))
    if usual <= STEPS * reading_step(x) / np.sqrt(12.0):
        return []
    loud = _loud(levels, x.size / count)
    if not loud.any() or any(_has_line(blocks[k]) for k in np.flatnonzero(loud)):
        return []
    return [noise_fault(recording, edges, np.where(loud, levels.sixth, 0.0), usual)]


def _loud(levels: _Levels, size: float) -> Flags:
    """Which blocks (B,) of `size` samples are loud; none where the others, or they, are not even,
    or where they lack the colour of noise.
    """
    none = np.zeros(levels.sixth.size, dtype=bool)
    ratio = levels.sixth / np.median(levels.sixth)
    bulk = levels.bulk / max(float(np.median(levels.bulk)), 1e-300)
    certain = (bulk - 1.0) * np.sqrt(size) / SCATTER > gaussian_threshold(ratio.size)
    loud = (ratio > FACTOR) & certain  # a spike is in no bulk
    if not loud.any() or ratio[loud].max() <= LOUD or loud.sum() > ratio.size // 3:
        return none
    quiet = ratio[~loud] / np.sqrt(np.mean(ratio[~loud] ** 2))
    even = np.all(np.abs(np.log(quiet)) < EVEN * RMS_SCATTER / np.sqrt(size))
    even = even and ratio[loud].max() <= FACTOR * ratio[loud].min()
    fourth = levels.fourth / np.median(levels.fourth)
    white = np.all(np.abs(fourth - ratio)[loud] < SAME * ratio[loud])
    return loud if even and white else none


def _rms(x: Floats, order: int) -> float:
    """Standard deviation of white noise, from the mean square of differences of an order."""
    return float(np.sqrt(np.mean(np.diff(x, order) ** 2) / comb(2 * order, order)))


def _has_line(x: Floats) -> bool:
    """Whether a line holds more of the faster half of a spectrum than one of noise does (Fisher
    1929, Proc. R. Soc. A 125:54). Sixth differences take slower motion off.
    """
    power = np.abs(np.fft.rfft(np.diff(x, 6) * np.hanning(x.size - 6)))[1:] ** 2
    angle = np.pi * np.arange(1, power.size + 1) / (x.size - 6)
    fast = (power / np.sin(angle) ** 12)[power.size // 2 :: 2]  # the window joins neighbours
    return bool(fast.max() > fast.sum() * (1.0 - (LINE / fast.size) ** (1.0 / (fast.size - 1))))
