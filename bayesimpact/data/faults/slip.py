"""`recording_slip`: samples lost or written twice, so that the motion jumps in phase."""

from __future__ import annotations

import itertools

import numpy as np

from bayesimpact.data.faults.fault import (
    FALSE_ALARM,
    Array,
    Fault,
    amount,
    file_time,
    gaussian_threshold,
)
from bayesimpact.data.faults.flat import equal_share, last_digit
from bayesimpact.data.faults.local import best_form, predict_sides, robust_sd, rounding_error
from bayesimpact.data.gaps import runs
from bayesimpact.data.period import crossing_period
from bayesimpact.data.recording import Recording

USUAL = 99.0  # percentile of the statistic that the motion alone may reach
BEYOND = 3.0  # times that percentile
WHOLE = 0.5  # of the motion's way from sample to sample: halfway between none lost and one
RESOLVED = 5.0  # times the samples of one side's polynomial: a motion whose period is shorter bends
# within them by about as much as it moves, and its own largest misses have to count
BENDS = 3.0  # samples: how far a corner of the motion within a few samples may displace both sides
MOST = 3  # slips: more jumps than this are the signal
WIDEST = 5  # samples of a spike
CHANCE = 3.0  # standard deviations
TURNING = 0.3  # rad of a cycle about the largest accelerations, where the mass turns: set by hand
REPEATED = 3  # samples of a block written twice, at least
LONGEST = 200  # samples of such a block
COARSE = 0.02  # of neighbours equal: from here on equal blocks are the step's


def find_slips(recording: Recording) -> list[Fault]:
    """Places where both sides are smooth and do not meet.

    The statistic is the distance of the two extrapolations half way between two samples, over the
    bulk of such distances. A corner keeps the displacement and may only shift it by its change of
    slope times a few samples; besides, three times the 99th percentile over the recording has to be
    passed, which is what corners of the motion reach, and what rounding may do to both. A slip is
    of whole samples: its sides are apart by half a sample's way of the motion or more, while an
    impact, or a stop that chatters, bends the motion by less; without a stop, a displacement may
    jump by any amount, as where a probe slips or a tracked marker is found beside itself. An
    acceleration jumps by itself where the mass turns, and friction with it. A velocity towards the
    stop becomes less at a contact onset, where the obstacle has a mass; samples lost there show
    when recordings are compared.
    Where both sides do meet once a few samples beside the place are left out, those were a spike.
    The remedy keeps the longest part without a slip: how many samples are missing need then not be
    known.
    """
    x = recording.samples
    period = crossing_period(x, 1.0)
    form = best_form(x, period)
    sides = predict_sides(x, form, 0, -0.5)
    jump = np.abs(sides.after - sides.before)
    jump = np.where(np.isfinite(jump), jump, 0.0)
    if recording.used is not None:
        affected = np.convolve(~recording.used, np.ones(2 * form[1] + 1), mode="same") > 0.5
        jump[affected] = 0.0
    level = robust_sd(jump[jump > 0.0])
    if level == 0.0:
        return []
    least = gaussian_threshold(x.size)
    bend = np.abs(sides.slope_after - sides.slope_before)
    resolved = period is not None and period > RESOLVED * form[1]
    usual = _usual(jump, form[1] if resolved else 0)
    rounded = 2.0 * rounding_error(form, -0.5, last_digit(x))
    least_jump = max(least * level, BEYOND * usual, rounded)
    way = 0.5 * np.abs(sides.slope_after + sides.slope_before)
    # of a displacement that meets no obstacle a zero may move by any amount
    share = 0.0 if resolved and recording.order == 0 and not recording.case else WHOLE
    strong = jump > np.maximum(least_jump, np.nan_to_num(np.maximum(BENDS * bend, share * way)))
    if recording.order == 2 and period is not None:  # friction turns round with the mass
        size = np.abs(x - np.mean(x)) * 2.0 * np.pi / period
        strong &= ~(way < TURNING * size)
    if (
        recording.order == 1 and recording.case
    ):  # an obstacle's mass takes of it at every contact onset
        strong &= ~((sides.before > 0.0) & (np.abs(sides.after) < sides.before))
    places = [
        p
        for p in _peaks(jump, strong, form[1])
        if _stands_out(jump, p, form[1])
        and _both_sides_hold(x, p, form, level, least)
        and not _meet_across(x, p, form)
    ]
    places = _apart([*places, *_written_twice(x)], form[1])
    if not places or len(places) > MOST:
        return []
    return [_fault(recording, places, jump, level, least)]


def _written_twice(x: Array) -> list[int]:
    """First sample of every block that repeats the readings just before it, digit by digit."""
    share = equal_share(x)
    if share > COARSE:
        return []
    chance = np.log(FALSE_ALARM / (x.size * LONGEST))

    def least(equal: float) -> float:
        """Samples that repeat by no chance where so many neighbours are equal."""
        return float(chance / np.log(min(equal + 1 / x.size, 1.0 - 1e-9)))

    places = []
    for lag in range(2, min(LONGEST, x.size // 4)):
        for first, end in runs(x[lag:] == x[:-lag]):
            if end - first < max(least(share), REPEATED, lag) or np.unique(x[first:end]).size < 2:
                continue
            here = float(
                np.mean(np.diff(x[first : end + lag]) == 0.0)
            )  # a mass at rest repeats too
            if end - first >= least(max(share, here)):
                places.append(first + lag)
    return places


def _apart(places: list[int], reach: int) -> list[int]:
    """Places further apart than a reach, the first of every group."""
    kept: list[int] = []
    for place in sorted(places):
        if not kept or place - kept[-1] > reach:
            kept.append(place)
    return kept


def _usual(jump: Array, reach: int) -> float:
    """What the motion reaches anywhere but within a reach of the `MOST` largest jumps: a few slips
    spoil more than a hundredth of a short recording, and would be taken for its motion.
    """
    rest, near = jump.copy(), np.zeros(jump.size, bool)
    for _ in range(MOST if reach else 0):
        place = int(np.argmax(rest))
        near[max(place - reach, 0) : place + reach + 1] = True
        rest[near] = 0.0
    return float(np.percentile(jump[~near], USUAL)) if not near.all() else np.inf


def _peaks(jump: Array, strong: np.ndarray, reach: int) -> list[int]:
    """The largest of every group of strong jumps closer than twice the reach."""
    places: list[int] = []
    for i in np.flatnonzero(strong):
        if places and i - places[-1] <= 2 * reach:
            if jump[i] > jump[places[-1]]:
                places[-1] = int(i)
        else:
            places.append(int(i))
    return places


def _stands_out(jump: Array, place: int, reach: int) -> bool:
    """Whether a jump is that much larger than most beside it, out of its own reach: where the
    polynomials are too long for the motion, both sides part nearly as far everywhere about.
    """
    around = np.arange(reach + 1, 3 * reach + 1)
    beside = np.concatenate([place - around, place + around])
    beside = jump[beside[(beside >= 0) & (beside < jump.size)]]
    return bool(jump[place] > BEYOND * np.median(beside[beside > 0.0])) if beside.any() else True


def _both_sides_hold(
    x: Array, place: int, form: tuple[int, int], level: float, least: float
) -> bool:
    """Whether the samples next to the jump follow from their own side."""
    ahead = predict_sides(x, form, 1, 0.0)
    near = range(2)
    left = [x[place - 1 - k] - ahead.before[place - 1 - k] for k in near]
    right = [x[place + k] - ahead.after[place + k] for k in near]
    sides = predict_sides(x, form, 0, -0.5)
    size = abs(float(sides.after[place] - sides.before[place]))
    return bool(np.nanmax(np.abs([*left, *right])) < max(2 * least * level, 0.25 * size))


def _meet_across(x: Array, place: int, form: tuple[int, int]) -> bool:
    """Whether both sides meet across a few samples just before a place, or just after it.

    They meet where their distance is what noise makes of it, and the jump without the gap is not.
    """
    near = predict_sides(x, form, 0, -0.5)
    jump = near.after[place] - near.before[place]
    for gap in range(1, WIDEST + 1):
        sides = predict_sides(x, form, gap, 0.5 * (gap - 1))
        apart = sides.after - sides.before
        noise = CHANCE * robust_sd(apart)
        for first in (place - gap, place):
            if abs(apart[first]) < noise < abs(apart[first] - jump):
                return True
    return False


def _fault(
    recording: Recording, places: list[int], jump: Array, level: float, least: float
) -> Fault:
    size = recording.samples.size
    edges = [0, *places, size]
    parts = list(itertools.pairwise(edges))
    first, end = max(parts, key=lambda part: part[1] - part[0])
    spans = tuple(span for span in ((0, first), (end, size)) if span[1] > span[0])
    keys = []
    if first > 0:
        keys.append(f"start_s = {file_time(recording, first - 0.4):.9g}")
    if end < size:
        keys.append(f"end_s = {file_time(recording, end - 0.6):.9g}")
    worst = max(places, key=lambda p: jump[p])
    named = ", ".join(f"{file_time(recording, p - 0.5):.6g} s (sample {p})" for p in places)
    return Fault(
        id="recording_slip",
        recording=recording.name,
        spans=spans,
        start_s=file_time(recording, places[0] - 1),
        end_s=file_time(recording, places[-1]),
        size=float(jump[worst]),
        unit=recording.unit,
        statement=f"the motion jumps by {amount(float(jump[worst]), recording.unit)} at {named}: "
        "samples lost or written twice, or the probe's zero or gain changed",
        remedy="\n".join(keys),
        strength=float(jump[worst] / level),
        threshold=least,
        action="cut",
    )
