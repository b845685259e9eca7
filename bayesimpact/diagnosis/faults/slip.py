"""A slip that its own jump does not show: from one sample on a recording runs early or late.

Samples lost near a turning point displace the motion by hardly more than the noise, but all that
follows is out of phase. Against the fit of the recording alone such a shift is one more column of
the linear model, v(t) from a sample on (see `change_point`). What the score proposes is then done:
the readings are put where they belong, and have to fit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import FALSE_ALARM, Fault, file_time
from bayesimpact.data.gaps import without
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults.alone import SharedModel, own_fit
from bayesimpact.diagnosis.faults.change_point import change_scores, parameter_basis
from bayesimpact.inference.fit import Fit

PLACE = 0.5 * float(chi2.isf(1e-3, 1))  # nats: less likely places than this are no candidates
NEAR = 2  # samples beside these places: where many are lost, the score is not linear
HELPS = 2.0  # times less, that the likeliest number of samples must leave; set by hand
EDGE = 8  # samples at either end, after which a shift is told from the start values


@dataclass(frozen=True)
class SampleShift:
    """From a sample on, a recording comes `samples` too early (> 0: lost) or too late.

    Attributes
    ----------
    place : first sample after the slip, the likeliest
    earliest, latest : between which it lies
    samples : how many are missing; negative for samples written twice
    gain : nats, in the linear approximation
    """

    place: int
    earliest: int
    latest: int
    samples: float
    gain: float


def likeliest_shift(fit: Fit) -> SampleShift | None:
    """The shift that explains most of the residual of a fit to one recording, if any does.

    None where the gain stays below what white noise reaches at one of its samples with a chance of
    `FALSE_ALARM`.
    """
    likelihood = fit.density.likelihood
    scores = change_scores(fit, 0, np.gradient(fit.seen[0]), parameter_basis(fit))
    score = scores.explained
    score[:EDGE] = score[-EDGE:] = 0.0
    best = int(np.argmax(score))
    left = float(fit.sums[0] - score[best]) / float(likelihood.sizes[0])
    nats = 0.5 * score / max(likelihood.noise.level**2, left)
    if nats[best] < 0.5 * chi2.isf(FALSE_ALARM / score.size, 1):
        return None
    near_best = np.flatnonzero(nats > nats[best] - PLACE)
    earliest, place, latest = (int(i) + scores.first for i in (near_best[0], best, near_best[-1]))
    samples = float(scores.slope[best] / scores.size[best])
    return SampleShift(place, earliest, latest, samples, float(nats[best]))


def put_right(recording: Recording, between: tuple[int, int], samples: int) -> Recording:
    """The recording with readings after a slip where they belong in time.

    The slip lies `between` two samples, first and last-plus-one: those are set aside. Lost samples
    leave a gap, samples written twice go.

    Raises `ValueError` when less than a fifth of the samples would be left.
    """
    first, end = max(between[0], 0), min(between[1], recording.samples.size)
    x = recording.samples
    used = np.ones(x.size, bool) if recording.used is None else recording.used
    after = end + max(-samples, 0)
    gap = max(samples, 0)
    x = np.concatenate([x[:end], np.full(gap, x[end - 1]), x[after:]])
    used = np.concatenate([used[:end], np.ones(gap, bool), used[after:]])
    return without(replace(recording, samples=x, used=used), [(first, end + gap)])


def find_shift(
    campaign: Campaign, recording: Recording, model: SharedModel, own: Fit | None
) -> tuple[SampleShift, Fit] | None:
    """The shift of a recording, in whole samples, and the fit to it with that put right.

    own : the fit to the recording as it is, if there is one
    """
    if own is None or recording.input is not None:
        return None
    shift = likeliest_shift(own)
    if shift is None:
        return None
    between = shift.earliest - NEAR, shift.latest + NEAR
    tried: list[tuple[float, int, Fit]] = []
    near = {round(shift.samples) + by for by in (-1, 0, 1)} - {0}
    for samples in sorted(near, key=lambda n: (abs(n - shift.samples), n)):
        if tried and HELPS * tried[0][0] > own.reduced_chi2:
            break  # a sample more or less does not put it right either
        try:
            again = put_right(recording, between, samples)
        except ValueError:  # it may lie nearly anywhere: what is left would not show it
            return None
        fit = own_fit(campaign, again, model)
        if fit is not None:
            tried.append((fit.reduced_chi2, samples, fit))
    if not tried:
        return None
    _, samples, fit = min(tried, key=lambda one: one[:2])
    return replace(shift, samples=float(samples)), fit


def slip_fault(recording: Recording, shift: SampleShift) -> Fault:
    """The slip as a record; its remedy keeps the longer part."""
    size, count = recording.samples.size, int(shift.samples)
    if shift.earliest >= size - shift.latest:
        span, remedy = (shift.earliest, size), "end_s"
        edge = file_time(recording, shift.earliest - 0.6)
    else:
        span, remedy = (0, shift.latest), "start_s"
        edge = file_time(recording, shift.latest - 0.4)
    words = "lost" if count > 0 else "written twice"
    noun = "sample" if abs(count) == 1 else "samples"
    when = file_time(recording, shift.place)
    return Fault(
        id="recording_slip",
        recording=recording.name,
        spans=(span,),
        start_s=file_time(recording, shift.earliest - 1),
        end_s=file_time(recording, shift.latest),
        size=float(abs(count)),
        unit="-",
        statement=f"{abs(count)} {noun} {words} at {when:.6g} s: what follows is out of phase",
        remedy=f"{remedy} = {edge:.9g}",
        strength=shift.gain,
        threshold=0.5 * float(chi2.isf(FALSE_ALARM / size, 1)),
        action="cut",
    )
