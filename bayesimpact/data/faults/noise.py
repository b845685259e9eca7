"""`recording_noise`: the noise of a recording is louder for a while, or louder than the others'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.faults.fault import Action, Fault, amount, file_time, gaussian_threshold
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.gaps import excluded, runs
from bayesimpact.data.period import noise_level
from bayesimpact.data.recording import Recording

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

BLOCKS = 12
LEAST_BLOCK = 150  # samples
FACTOR = 2.0  # times the usual level: less is told by no test that motion does not spoil
EDGE = 0.6  # of a block, beside a loud one: a median does not see what fills less than half
LOUD = 3.0  # times the usual level: samples that carry a ninth of the others' weight
SAME = 0.25  # how far fourth and sixth differences may disagree on a level of noise
SCATTER = 1.6  # of the level from a median of correlated differences, times 1 / sqrt(n)


def find_noise(recording: Recording) -> list[Fault]:
    """Blocks whose noise is above twice the recording's usual level.

    Above three times they are excluded, below told. Levels are the bulk of sixth differences. What
    motion leaves there is no noise: the level from fourth differences has to rise as much, and a
    part with far more motion than all others has its own fast modes.
    """
    x = recording.samples
    count = min(BLOCKS, x.size // LEAST_BLOCK)
    if count < 4:
        return []
    edges = np.linspace(0, x.size, count + 1).astype(int)
    parts = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    rounding = reading_step(x) / np.sqrt(12.0)  # a motion rounds at random, a rest does not
    sixth = np.maximum([noise_level(x[a:b]) for a, b in parts], rounding)
    fourth = np.maximum([_fourth(x[a:b]) for a, b in parts], rounding)
    usual, other = float(np.median(sixth)), float(np.median(fourth))
    if usual == 0.0 or other == 0.0:
        return []
    sd = SCATTER / np.sqrt(x.size / count)
    least = gaussian_threshold(count)
    ratio = sixth / usual
    strong = (ratio > FACTOR) & ((ratio - 1.0) / sd > least)
    strong &= np.abs(fourth / other - ratio) < SAME * ratio
    if not strong.any() or strong.sum() > count // 2:
        return []
    power = np.array([np.var(x[a:b]) for a, b in parts])
    motion = np.sqrt(np.maximum(power - ((1.0 + SAME) * sixth) ** 2, 0.0))
    if motion[strong].min() > FACTOR * motion[~strong].max():
        return []
    action: Action = "exclude" if ratio[strong].max() > LOUD else "notice"
    found = noise_fault(recording, edges, np.where(strong, sixth, 0.0), usual)
    strength = (found.size - 1.0) / sd
    return [replace(found, strength=strength, threshold=least, action=action)]


def noise_fault(recording: Recording, edges: Counts, levels: Floats, usual: float) -> Fault:
    """Blocks of a recording between `edges` (B + 1,), samples, whose noise is too loud, and a part
    of a block beside them; `levels` (B,) are theirs, 0 of the others, over the `usual` one.
    """
    size = recording.samples.size
    reach = int(EDGE * size / levels.size)
    loud = np.zeros(size, dtype=bool)
    for k in np.flatnonzero(levels):
        loud[max(int(edges[k]) - reach, 0) : int(edges[k + 1]) + reach] = True
    spans = tuple(runs(loud))
    worst = float(levels.max() / usual)
    return Fault(
        id="recording_noise",
        recording=recording.name,
        spans=spans,
        start_s=file_time(recording, spans[0][0]),
        end_s=file_time(recording, spans[-1][1] - 1),
        size=worst,
        unit="times the usual noise",
        statement=f"noise of {amount(worst * usual, recording.unit)}, {worst:.3g} times the "
        f"recording's usual level, from {file_time(recording, spans[0][0]):.6g} s",
        remedy=excluded(recording, spans),
        strength=worst,
        threshold=LOUD,
        action="exclude",
    )


def _fourth(x: np.ndarray) -> float:
    return float(np.median(np.abs(np.diff(x, 4))) / (0.6745 * np.sqrt(70.0)))


def loud_recordings(recordings: Sequence[Recording]) -> list[Fault]:
    """Notices of recordings whose noise is three times the usual one of the campaign, or more.

    Of the readings' size too: where both are larger alike, the unit or the gain is another.
    """
    if len(recordings) < 3:
        return []
    levels = np.array([noise_level(r.samples) for r in recordings])
    usual = float(np.median(levels))
    if len({r.quantity for r in recordings}) > 1:
        return []
    if usual == 0.0:
        return []
    sizes = np.array([float(np.std(r.samples)) for r in recordings])
    relative = levels / np.maximum(sizes, 1e-300)
    loud = (levels > LOUD * usual) & (relative > LOUD * np.median(relative))
    return [
        Fault(
            id="recording_noise",
            recording=r.name,
            spans=((0, r.samples.size),),
            start_s=file_time(r, 0),
            end_s=file_time(r, r.samples.size - 1),
            size=float(level / usual),
            unit="times the usual noise",
            statement=f"noise of {amount(float(level), r.unit)}, {level / usual:.3g} times that of "
            "the other recordings",
            remedy='skip = "louder noise than the others"',
            strength=float((level / usual - 1.0) * np.sqrt(r.samples.size) / SCATTER),
            threshold=float(2.0 * np.sqrt(r.samples.size) / SCATTER),
            action="notice",
        )
        for r, level, is_loud in zip(recordings, levels, loud, strict=True)
        if is_loud and reading_step(r.samples) < level and _fourth(r.samples) < 1.25 * level
    ]
