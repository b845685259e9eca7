"""`recording_duplicate`: one recording given twice, whole or in part, as if it were new."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.data.faults.fault import Fault, file_time
from bayesimpact.data.period import noise_level
from bayesimpact.data.recording import Recording

KEY = 16  # samples that locate one recording in another
SAME = 0.5  # of the noise: two recordings of their own differ by 1.4 times it, and by their motions
LEAST = 0.5  # of the shorter recording has to agree


def find_duplicates(recordings: Sequence[Recording]) -> list[Fault]:
    """The later of two recordings that agree to less than half the noise, at any shift in time.

    The chance that noise of their own agrees so in n samples is below 0.3^n.
    """
    found = []
    gone: set[str] = set()
    for j, later in enumerate(recordings):
        for earlier in recordings[:j]:
            if earlier.name in gone:
                continue
            count = _common(earlier.samples, later.samples)
            shorter = min(earlier.samples.size, later.samples.size)
            if count >= max(LEAST * shorter, KEY):
                found.append(_fault(earlier, later, count))
                gone.add(later.name)
                break
    return found


def _common(a: np.ndarray, b: np.ndarray) -> int:
    """Samples that two recordings have in common, at no shift or the shift that the key tells."""
    noise = max(noise_level(a), noise_level(b), 1e-12 * float(np.ptp(a)))
    for shift in {0, *_shifts(a, b, noise), *(-s for s in _shifts(b, a, noise))}:
        x, y = (a[shift:], b) if shift >= 0 else (a, b[-shift:])
        n = min(x.size, y.size)
        if n >= KEY and float(np.sqrt(np.mean((x[:n] - y[:n]) ** 2))) < SAME * noise:
            return int(n)
    return 0


def _shifts(a: np.ndarray, b: np.ndarray, noise: float) -> list[int]:
    """Where b begins within a: by the first samples of b."""
    if a.size < KEY or b.size < KEY:
        return []
    near = np.flatnonzero(np.abs(a[: a.size - KEY + 1] - b[0]) < 2 * SAME * noise)
    rows = a[near[:, None] + np.arange(KEY)] - b[:KEY]
    return [int(s) for s in near[np.sqrt(np.mean(rows**2, axis=1)) < SAME * noise][:3]]


def _fault(earlier: Recording, later: Recording, count: int) -> Fault:
    return Fault(
        id="recording_duplicate",
        recording=later.name,
        spans=((0, later.samples.size),),
        start_s=file_time(later, 0),
        end_s=file_time(later, later.samples.size - 1),
        size=float(count),
        unit="samples",
        statement=f"{count} samples are those of {earlier.name}: no new evidence",
        remedy=f'skip = "the same recording as {earlier.name}"',
        strength=float(count),
        threshold=float(KEY),
        action="skip",
    )
