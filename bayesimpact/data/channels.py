"""Several channels of one motion: a probe and an accelerometer that recorded one release together.

Recordings of one `motion` share its initial state, `y0` and `v0`, which bear the name of the first
of them. Rest reading, noise and quantity are each channel's own. Only what begins at the same
instant shares a state: a channel whose start was cut off has one of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

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
    return named and together and one.input is None and other.input is None


def check_channels(where: str, recordings: Sequence[Recording]) -> None:
    """Refuse channels of one motion that cannot be; raises InputError."""
    first: dict[str, Recording] = {}
    for number, recording in enumerate(recordings, 1):
        if not recording.motion_name:
            continue
        place = f"{where}, recording {number} ({recording.name}), key motion"
        found = f'"{recording.motion_name}"'
        if recording.input is not None:
            accepted = "a motion of free decays: channels under an input cannot be joined yet"
            raise InputError(place, f"{found} with an input", accepted)
        other = first.setdefault(recording.motion_name, recording)
        if recording.case != other.case:
            said = f'{found} with case "{recording.case}"'
            raise InputError(place, said, f'case "{other.case}", as {other.name}, of this motion')
        if not _begin_together(other, recording):
            said = f"{found} from {recording.start:.9g} s"
            accepted = f"{other.start:.9g} s, where {other.name} begins (start_s, end_s cut both)"
            raise InputError(place, said, accepted)
