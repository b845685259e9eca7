"""Where in the recordings an impact is, and where what was added shows most."""

from __future__ import annotations

from dataclasses import dataclass
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
    first, last : samples from one touch (or upward passage through rest) to the next
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
    """Reading of the probe where the stop begins, m; None where no single one is known."""
    known = {row.name: row.median for row in results.rows}
    own = [value for name, value in known.items() if name.endswith(f".g[{recording.name}]")]
    gap = own[0] if own else known.get("g", float("nan"))
    level = gap + known.get(f"offset[{recording.name}]", 0.0)
    return level if results.stop and np.isfinite(level) else None


def touches(recording: RecordingResult, level: float) -> np.ndarray:
    """Samples (k,) before which the fitted motion rises through a reading."""
    y = recording.predicted
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
        level = stop_level(results, recording)
        starts = touches(recording, float(np.mean(recording.predicted)) if level is None else level)
        gain = (recording.samples - old) ** 2 - recording.residual**2
        total = np.concatenate([[0.0], np.cumsum(gain / (2 * recording.noise_rms**2))])
        for k, (first, last) in enumerate(pairwise(starts)):
            leave = int(first)
            if level is not None:
                inside = recording.predicted[first:last] >= level
                leave = int(first + (np.argmin(inside) if not inside.all() else inside.size))
            found.append(
                Cycle(r, k + 1, int(first), int(last), leave, float(total[last] - total[first]))
            )
    return found


def telling_cycle(results: Results) -> Cycle | None:
    """The cycle in which the extended model gains most; None where none gains."""
    return max((c for c in cycles(results) if c.gain > 0), key=lambda c: c.gain, default=None)
