"""Where in the recordings an impact is, and where what was added shows most."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bayesimpact.report.results import Array, RecordingResult, Results


@dataclass(frozen=True)
class Cycle:
    """One cycle of a recording.

    Attributes
    ----------
    recording : position among the recordings
    number : of the cycle, from 1; of the impact where there is a stop
    first, last : samples from one contact onset (or upward passage through rest) to the next
    leave : sample at which contact ends; `first` where there is none
    gain : log likelihood that the extended model gains in it, nats
    """

    recording: int
    number: int
    first: int
    last: int
    leave: int
    gain: float


def stop_level(results: Results, recording: RecordingResult) -> float | None:
    """Reading of the probe where the stop begins, m; None where no single one is known, or the
    probe reads no displacement.
    """
    if recording.displacement.size:
        return None
    level = gap_of(results, recording) + offset_of(results, recording)
    return level if results.stop and np.isfinite(level) else None


def gap_of(results: Results, recording: RecordingResult) -> float:
    """Displacement from the true rest at which the stop begins, m; not finite where unknown."""
    known = {row.name: row.median for row in results.rows}
    own = [value for name, value in known.items() if name.endswith(f".g[{recording.name}]")]
    return own[0] if own else known.get("g", float("nan"))


def offset_of(results: Results, recording: RecordingResult) -> float:
    """Rest reading of the probe."""
    rows = (row.median for row in results.rows if row.name == f"offset[{recording.name}]")
    return next(rows, 0.0)


def contacts(results: Results, recording: RecordingResult) -> tuple[Array, float | None]:
    """The fitted motion (n,) and where on it the stop begins; None without a stop.

    The reading, or, where the probe reads no displacement, the model's displacement.
    """
    if not recording.displacement.size:
        return recording.predicted, stop_level(results, recording)
    gap = gap_of(results, recording)
    return recording.displacement, gap if results.stop and np.isfinite(gap) else None


def contact_onsets(y: Array, level: float) -> np.ndarray:
    """Samples (k,) before which a motion (n,) rises through a level."""
    return np.flatnonzero((y[1:] >= level) & (y[:-1] < level)) + 1


def before_predicted(results: Results) -> tuple[Array, ...] | None:
    """Reading of the base model for every recording, m; None where it was not kept."""
    joined = results.diagnosis_arrays.get("before_predicted")
    sizes = [r.samples.size for r in results.recordings]
    if joined is None or joined.size != sum(sizes):
        return None
    return tuple(np.split(joined, np.cumsum(sizes)[:-1]))


def cycles(results: Results) -> list[Cycle]:
    """All whole cycles, with what the extended model gains in each; [] without a base model."""
    before = before_predicted(results)
    if before is None:
        return []
    found = []
    for r, (recording, old) in enumerate(zip(results.recordings, before, strict=True)):
        y, level = contacts(results, recording)
        starts = contact_onsets(y, float(np.mean(y)) if level is None else level)
        gain = replace(recording, predicted=old).residual ** 2 - recording.residual**2
        total = np.concatenate([[0.0], np.cumsum(gain / (2 * recording.noise_rms**2))])
        for k, (first, last) in enumerate(pairwise(starts)):
            leave = int(first)
            if level is not None:
                inside = y[first:last] >= level
                leave = int(first + (np.argmin(inside) if not inside.all() else inside.size))
            found.append(
                Cycle(r, k + 1, int(first), int(last), leave, float(total[last] - total[first]))
            )
    return found
