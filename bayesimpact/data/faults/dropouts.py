"""Stretches in which the readings leave the motion and come back to it: drop-outs of a signal.

A vibrometer that loses its speckle, a loose contact or a lost packet reads anything for a while:
noise, zeros, the last value. `spikes` and `bursts` know up to five samples. Here a bad stretch
grows from its first sample as long as the readings beside it do not lie on one curve through good
ones on both sides. That there is such a curve in the end is the proof: samples lost, a step of the
zero or an impact leave two motions that no smooth curve joins. And what a stop or another law does
for a while sets in and ends smoothly, where a signal that is lost jumps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.faults.bursts import LONGEST, SURE, Spike
from bayesimpact.data.faults.fault import Array, gaussian_threshold
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.faults.local import best_form, predict_sides, robust_sd
from bayesimpact.data.gaps import Mask
from bayesimpact.data.recording import Recording

GUARD = 4  # samples next to a stretch that must lie on the curve
BESIDE = 16  # further good ones on either side through which it goes
WINDOW = 0.6  # natural periods that stretch and good samples together may span
MOST = 0.1  # of the samples: more are the signal
JOINED = 1.5  # times the noise: how well one curve may fit both sides


def find_dropouts(recording: Recording, period: float | None) -> list[Spike]:
    """Stretches of more than `LONGEST` bad readings in a free motion without a stop, whose `period`
    in samples is given; not of an acceleration, which every dry friction makes jump twice a cycle.

    The strength is the median miss of a stretch over the noise of the readings and of the curve
    there; from `SURE` times a single reading's threshold on it counts.
    """
    if recording.case or recording.order == 2 or period is None:
        return []
    if WINDOW * period < 2 * (BESIDE + GUARD) + 1:
        return []
    x = recording.samples
    used = np.ones(x.size, bool) if recording.used is None else recording.used.copy()
    before = x - predict_sides(x, best_form(x, period), 0).before
    # readings of a slow motion repeat: what a coarse step leaves of others is no less than that
    level = max(robust_sd(before[used]), reading_step(x))
    least = gaussian_threshold(x.size)
    if level == 0.0:
        return []
    found, end = list[Spike](), 0
    for first in np.flatnonzero(used & (np.abs(before) > SURE * least * level)):
        if first < end:
            continue
        one = _grown(x, used, int(first), period, least)
        if one is not None and one.span[1] - one.span[0] > LONGEST:
            found.append(one)
            used[slice(*one.span)] = False
            end = one.span[1]
    count = sum(b - a for a, b in (one.span for one in found))
    return found if count <= MOST * x.size else []


def _grown(x: Array, used: Mask, first: int, period: float, least: float) -> Spike | None:
    """The stretch about a bad sample; None where the motion does not go on behind it."""
    end = first + 1
    most = int(WINDOW * period) - 2 * (BESIDE + GUARD)
    good = np.flatnonzero(used)
    while end - first <= most:
        left, right = good[good < first][-BESIDE - GUARD :], good[good >= end][: BESIDE + GUARD]
        if min(left.size, right.size) < BESIDE + GUARD or right[-1] - left[0] > WINDOW * period:
            return None
        far = np.concatenate([left[:BESIDE], right[GUARD:]])
        near = np.concatenate([left[BESIDE:], np.arange(first, end), right[:GUARD]])
        rms, off, leverage = _curve(x, far, near, period)
        noise = _noise(x, left)
        bad = np.abs(off) > least * leverage * max(rms, noise)
        grown_first = int(min(near[:GUARD][bad[:GUARD]], default=first))
        grown_end = int(max(near[-GUARD:][bad[-GUARD:]], default=end - 1)) + 1
        if (grown_first, grown_end) != (first, end):
            first, end = grown_first, grown_end
            continue
        inside, beyond = off[GUARD:-GUARD], np.abs(off / leverage)[GUARD:-GUARD]
        strength = float(np.median(beyond)) / noise if noise > 0.0 else np.inf
        joined = rms < JOINED * noise and strength > SURE * least and _is_rough(inside)
        if joined and not _is_step(x, np.concatenate([far, near]), noise, period):
            size = float(inside[np.argmax(np.abs(inside))])
            return Spike((first, end), size, strength, SURE * least)
        end += GUARD  # what looks good beside it may be bad as well
    return None


def _is_rough(off: Array) -> bool:
    """Whether misses (m,) of a curve are far from those of a force that acts for so long: they jump
    at the ends or in between.
    """
    at = (np.arange(off.size) + 0.5) / off.size
    return _roughness(off) > SURE * _roughness(at * (1.0 - at))


def _roughness(off: Array) -> float:
    """Second differences over values, norms; zero before and behind."""
    return float(np.linalg.norm(np.diff(np.pad(off, 2), 2)) / np.linalg.norm(off))


def _noise(x: Array, good: NDArray[np.int64]) -> float:
    """Noise of readings at neighbouring good places, by what a cubic leaves of them."""
    own = np.vander((good - good.mean()) / np.ptp(good), 4)
    left = x[good] - own @ np.linalg.lstsq(own, x[good], rcond=None)[0]
    return float(np.sqrt(left @ left / (good.size - 4)))


def _curve(x: Array, far: Array, near: Array, period: float) -> tuple[float, Array, Array]:
    """Rms miss of the readings `far` of a curve through them, that of the readings `near`, and the
    standard deviation of those for a noise of 1.

    A cubic beside a vibration whose amplitude changes linearly.
    """

    here, there = _basis(far, far, period), _basis(near, far, period)
    inverse = np.linalg.pinv(here, rcond=1e-6)
    found = inverse @ x[far]
    left = x[far] - here @ found
    freedom = far.size - np.linalg.matrix_rank(here, tol=1e-6)
    deviation = np.sqrt(1.0 + np.sum((there @ inverse) ** 2, axis=1))
    return float(np.sqrt(left @ left / freedom)), x[near] - there @ found, deviation


def _basis(at: Array, far: Array, period: float) -> Array:
    s, turn = (at - far.mean()) / np.ptp(far), 2 * np.pi * at / period
    return np.column_stack(
        [np.vander(s, 4), np.cos(turn), np.sin(turn), s * np.cos(turn), s * np.sin(turn)]
    )


def _is_step(x: Array, places: Array, noise: float, period: float) -> bool:
    """Whether one step of the readings (a zero that moved), behind which the vibration may have
    another phase (samples lost), explains them as well.
    """
    places = np.sort(places)
    basis = _basis(places, places, period)
    for step in places[GUARD:-GUARD]:
        behind = places >= step
        own = np.column_stack([np.ones(places.size), places - step, basis[:, 4:6]])
        columns = np.column_stack([basis, behind[:, None] * own])
        left = x[places] - columns @ np.linalg.lstsq(columns, x[places], rcond=1e-6)[0]
        if left @ left < (JOINED * noise) ** 2 * places.size:
            return True
    return False
