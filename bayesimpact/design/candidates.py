"""Recordings that a lab can make with the rig that it has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from bayesimpact.design.hypotheses import PastRelease, Rivalry

Kind = Literal["repeat", "release", "stop removed", "longer", "faster", "gap"]

HEIGHTS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
"""Releases, in the highest one so far. Half as much again is what a probe chosen for the campaign
may still read, and a model may still predict.
"""
WITHIN = 1.0
"""The same where a force has been learned: it is not known where the mass has not been."""
LONGER = 2.0
FASTER = 4.0
GAP = 0.15
"""A stop moved by so much of the highest release, nearer and farther."""


@dataclass(frozen=True)
class PlannedRecording:
    """One recording that could be made.

    Attributes
    ----------
    kind : what differs from the recordings so far
    case : the obstacle; "" without
    y0, v0 : displacement and velocity at the first sample, m and m/s
    duration, interval : s
    stop : the obstacle is there
    gap_shift : by how much the stop is moved away, m; its exact place is then unknown
    repeats : the recording that is repeated, for a repeat
    """

    kind: Kind
    case: str
    y0: float
    v0: float
    duration: float
    interval: float
    stop: bool = True
    gap_shift: float = 0.0
    repeats: str = ""

    @property
    def joins(self) -> bool:
        """Whether the recording can stand in the same campaign as those so far, which has one gap
        and is with or without a stop throughout.
        """
        return self.kind != "stop removed" and self.gap_shift == 0.0

    @property
    def samples(self) -> int:
        """How many it has."""
        return max(2, round(self.duration / self.interval) + 1)


def highest(rivals: Rivalry) -> float:
    """The highest release so far, m: displacements may be driven, or begin after the release."""
    return max(r.reach for r in rivals.releases)


def sign(rivals: Rivalry) -> float:
    """On which side the mass is released: -1 away from the stop."""
    return 1.0 if sum(r.y0 for r in rivals.releases) > 0 else -1.0


def repeats(rivals: Rivalry) -> tuple[PlannedRecording, ...]:
    """Every recording once more."""
    return tuple(
        PlannedRecording(
            "repeat", r.case, r.y0, r.v0, r.duration, r.interval, rivals.stop, repeats=r.name
        )
        for r in rivals.releases
    )


def first_designs(rivals: Rivalry) -> tuple[PlannedRecording, ...]:
    """Releases from several heights against every obstacle, and with the stop removed."""
    learned = any(i == "learned_force" for h in rivals.hypotheses for i in h.ids)
    heights = [h for h in HEIGHTS if h <= (WITHIN if learned else HEIGHTS[-1])]
    usual = usual_release(rivals.releases)
    side = sign(rivals) * highest(rivals)
    found = [
        PlannedRecording(
            "release", case, h * side, 0.0, usual.duration, usual.interval, rivals.stop
        )
        for case in rivals.cases
        for h in heights
    ]
    if rivals.stop:
        found += [
            replace(d, kind="stop removed", stop=False)
            for d in found
            if d.case == rivals.cases[0] and abs(d.y0) >= 0.5 * abs(side)
        ]
    return tuple(found)


def variants(design: PlannedRecording, rivals: Rivalry) -> tuple[PlannedRecording, ...]:
    """The same release recorded for longer, sampled faster, and with another gap."""
    found = [
        replace(design, kind="longer", duration=LONGER * design.duration),
        replace(design, kind="faster", interval=design.interval / FASTER),
    ]
    if design.stop and rivals.stop:
        shift = GAP * highest(rivals)
        found += [replace(design, kind="gap", gap_shift=s) for s in (-shift, shift)]
    return tuple(found)


def usual_release(releases: Sequence[PastRelease]) -> PastRelease:
    """The longest recording: new ones are made like it."""
    return max(releases, key=lambda r: r.duration)
