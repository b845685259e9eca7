"""Several channels of one motion: a probe and an accelerometer that recorded one release together.

Recordings of one `motion` share its initial state, `y0` and `v0`, which bear the name of the first
of them. Rest reading, noise and quantity are each channel's own. Only what begins at the same
instant shares a state: a channel whose start was cut off has one of its own. Under an input the
channels share that as well, sampled with them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError

TOGETHER = 1e-3  # of a sampling interval: two starts that are one instant


def keepers(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Of every recording, the name of the first one that begins with the same state."""
    return tuple(
        next(first.name for first in recordings if first is r or _begin_together(first, r))
        for r in recordings
    )


def _begin_together(one: Recording, other: Recording) -> bool:
    apart = abs(one.start - other.start)
    together = apart <= TOGETHER * min(one.interval, other.interval)
    named = bool(one.motion_name) and one.motion_name == other.motion_name
    return named and together and is_same_input(one, other)


def is_same_input(one: Recording, other: Recording) -> bool:
    """True when the same drives both, or nothing; readings may end apart, and be read elsewhere."""
    if one.input is None or other.input is None:
        return one.input is other.input
    alike = _kind(one.input) == _kind(other.input)
    n = min(one.samples.size, other.samples.size)
    spaced = abs(one.interval - other.interval) * n <= TOGETHER * one.interval
    return alike and spaced and np.array_equal(one.input.samples[:n], other.input.samples[:n])


def _kind(given: Input) -> tuple[str, bool, bool]:
    return given.kind, given.free, given.band_limited


def check_channels(where: str, recordings: Sequence[Recording]) -> None:
    """Refuse gains that nothing tells, and channels of one motion that cannot be; InputError."""
    if recordings and all(r.free_gain for r in recordings):
        place = f"{where}, recording 1 ({recordings[0].name}), key gain"
        raise InputError(place, '"free" of every recording', "a recording of known gain beside it")
    first: dict[str, Recording] = {}
    for number, recording in enumerate(recordings, 1):
        if not recording.motion_name:
            continue
        place = f"{where}, recording {number} ({recording.name}), key motion"
        found = f'"{recording.motion_name}"'
        other = first.setdefault(recording.motion_name, recording)
        if recording.case != other.case:
            said = f'{found} with case "{recording.case}"'
            raise InputError(place, said, f'case "{other.case}", as {other.name}, of this motion')
        if not is_same_input(other, recording):
            said = f"{found} with another input"
            raise InputError(place, said, f"that of {other.name}, of this motion, sample by sample")
        if not _begin_together(other, recording):
            said = f"{found} from {recording.start:.9g} s"
            accepted = f"{other.start:.9g} s, where {other.name} begins (start_s, end_s cut both)"
            raise InputError(place, said, accepted)
