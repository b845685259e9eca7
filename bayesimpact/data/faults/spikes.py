"""`recording_spikes`: readings that neither their past nor their future predicts.

Spikes close to each other are found by `bursts`.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.data.faults.bursts import Spike, find_bursts
from bayesimpact.data.faults.dropouts import find_dropouts
from bayesimpact.data.faults.ends import missed_ends, unpredicted_ends
from bayesimpact.data.faults.fault import (
    Array,
    Fault,
    Span,
    amount,
    file_time,
    gaussian_threshold,
    times_of,
)
from bayesimpact.data.faults.flat import last_digit
from bayesimpact.data.faults.local import best_form, predict_sides, robust_sd, rounding_error
from bayesimpact.data.gaps import excluded, runs, without
from bayesimpact.data.period import crossing_period
from bayesimpact.data.recording import Recording

LONGEST = 5  # samples of one spike
AGREE = 0.5  # of the deviation: how far both sides may differ where neither knows of a corner
USUAL = 97.0  # percentile of a statistic that the motion alone may reach
BEYOND = 4.0  # times that percentile
MOST = 0.01  # of the samples: more deviations than this are the signal


def find_spikes(recording: Recording) -> list[Fault]:
    """Samples far off the motion, drop-outs of any length or up to five in a row; impacts are none.

    Spikes close to each other come first, as in `bursts`, then drop-outs, and then spikes alone, as
    in `lone_spikes`, each without what is found already: beside a spike a good reading may look
    like one.
    """
    close = find_bursts(recording)
    rest = without(recording, [one.span for one in close]) if close else recording
    lost = find_dropouts(rest, crossing_period(recording.samples, 1.0))
    rest = without(rest, [one.span for one in lost]) if lost else rest
    return _fault(recording, [*close, *lost, *_unpredicted(rest)])


def lone_spikes(
    recording: Recording, *, contacts: bool = True, residual: bool = False
) -> list[Fault]:
    """Up to five samples in a row far off what both sides predict alike, or a few at an end far off
    what the one side there predicts (`ends`), or a fit where samples are its `residual`; impacts
    are none.

    A brief contact is a spike of the acceleration away from the stop, and the flight between two of
    them one towards it, back to what flights have: such ones do not count, as long as there may be
    `contacts` in the readings.

    The statistic is the smaller of the deviations from either side over the bulk of such
    deviations. It has to pass the Gaussian threshold and four times the 97th percentile over the
    recording, which is what the corners of the motion itself reach.
    """
    return _fault(recording, _unpredicted(recording, contacts, residual))


def _unpredicted(
    recording: Recording, contacts: bool = True, residual: bool = False
) -> list[Spike]:
    """What `lone_spikes` finds, none touching another."""
    x = recording.samples
    brief = contacts and recording.order == 2 and bool(recording.case)
    period = crossing_period(x, 1.0)
    form = best_form(x, period)
    least = gaussian_threshold(x.size * LONGEST)
    found: list[tuple[float, float, Span]] = []
    for width in range(1, LONGEST + 1):
        for strength, size, span in _of_width(x, form, width, least):
            if not brief or (size >= 0.0 and _is_above(x, span, period)):
                found.append((strength, size, span))
    chosen: list[Spike] = []
    for strength, size, (first, end) in sorted(found, reverse=True):
        if all(end + 1 < one.span[0] or first > one.span[1] + 1 for one in chosen):
            chosen.append(Spike((first, end), size, strength, least))
    inside = tuple(chosen)
    missed = missed_ends(x) if residual else []
    for one in missed or unpredicted_ends(x):
        if all(one.span[1] < other.span[0] or one.span[0] > other.span[1] for other in inside):
            chosen.append(one)
    count = sum(one.span[1] - one.span[0] for one in chosen)
    return chosen if count <= max(MOST * x.size, LONGEST) else []


def _is_above(x: Array, span: Span, period: float | None) -> bool:
    """Whether readings lie above all others within half a period."""
    reach = x.size if period is None else int(np.ceil(0.5 * period))
    first, end = span
    around = np.concatenate([x[max(first - reach, 0) : first], x[end : end + reach]])
    return bool(x[first:end].max() > np.max(around, initial=-np.inf))


def _fault(recording: Recording, spikes: list[Spike]) -> list[Fault]:
    """One fault that names them all; what was found twice is one."""
    if not spikes:
        return []
    bad = np.zeros(recording.samples.size, bool)
    for one in spikes:
        bad[slice(*one.span)] = True
    places = tuple(runs(bad))
    largest = max(abs(one.size) for one in spikes)
    clearest = max(spikes, key=lambda one: one.strength / one.threshold)
    what = "spike" if max(b - a for a, b in places) <= LONGEST else "drop-out of the signal"
    what = what if len(places) == 1 else "spikes" if what == "spike" else "spikes and drop-outs"
    noun = what if len(places) == 1 else f"{len(places)} {what}"
    return [
        Fault(
            id="recording_spikes",
            recording=recording.name,
            spans=places,
            start_s=file_time(recording, places[0][0]),
            end_s=file_time(recording, places[-1][1] - 1),
            size=largest,
            unit=recording.unit,
            statement=f"{noun} of up to {amount(largest, recording.unit)} at "
            f"{times_of(recording, places)}",
            remedy=excluded(recording, places),
            strength=clearest.strength,
            threshold=clearest.threshold,
        )
    ]


def _of_width(
    x: Array, form: tuple[int, int], width: int, least: float
) -> list[tuple[float, float, Span]]:
    """Strength, size and span of spikes of exactly `width` samples."""
    deviation = np.full((width, x.size), np.nan)
    differ = np.zeros(x.size)
    for k in range(width):
        sides = predict_sides(x, form, width, float(k))
        here = np.full(x.size, np.nan)
        here[: x.size - k] = x[k:]
        left, right = here - sides.before, here - sides.after
        same = np.sign(left) == np.sign(right)
        smaller = np.where(np.abs(left) < np.abs(right), left, right)
        deviation[k] = np.where(np.isfinite(left + right), np.where(same, smaller, 0.0), np.nan)
        differ = np.maximum(differ, np.abs(left - right))
        if k == 0:
            bend = sides.slope_after - sides.slope_before
            outside = left * bend > 0
    weakest = np.min(np.abs(deviation), axis=0)
    one_sign = np.abs(np.sign(deviation).sum(axis=0)) == width
    statistic = np.where(one_sign, weakest, 0.0)
    statistic[~np.isfinite(weakest)] = 0.0
    level = robust_sd(left)  # of the sample furthest ahead
    usual = np.percentile(statistic, USUAL)
    if level == 0.0:
        return []
    # where the motion is bent within few samples it lies inside both extrapolations
    bent = outside & (statistic < np.abs(bend) * (width + 1))
    step = last_digit(x)
    rounded = 0.5 * step + rounding_error(form, width - 1.0, step)
    strong = (
        (statistic > max(least * level, BEYOND * usual, rounded))
        & (differ < AGREE * statistic)
        & ~bent
    )
    return [
        (float(statistic[i] / level), float(deviation[0, i]), (int(i), int(i + width)))
        for i in np.flatnonzero(strong)
    ]
