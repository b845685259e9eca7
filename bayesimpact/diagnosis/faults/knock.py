"""A knock in mid-record: from one instant on, the motion goes on from another state.

A blow to the table or a hand changes velocity (and, if it lasts, displacement) at once, and all
that follows is another free motion of the same oscillator. Against a model with the physics in it
such a jump is two more columns of one recording, what either of two free changes of the motion is
from a sample on, for every sample at once by sums over what follows: the score test of a change
point (Rao 1948). What the score proposes is then done: the recording is taken as two, one before
and one after, which share all physics, and has to fit. Where that leaves something, what remains
may tell the next knock, of this recording or another. Missing physics does not end with a new
start: what an error of the physics adds up to in a stretch grows with its length squared, so that n
new starts leave 1 / (n + 1)^2 of it, more than the 1 / `EXCESS`^n that is asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import FALSE_ALARM, Fault, file_time
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults.alone import SharedModel
from bayesimpact.diagnosis.faults.change_point import change_window, parameter_basis
from bayesimpact.diagnosis.faults.compare import Compared, log_likelihood_gain
from bayesimpact.diagnosis.faults.recording_faults import values_of
from bayesimpact.diagnosis.faults.together import CERTAIN
from bayesimpact.diagnosis.selection.outcome import above_noise, leaves_something
from bayesimpact.diagnosis.thresholds import EXCESS, LARGE
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.linear_response.free_changes import FreeChanges, free_changes
from bayesimpact.model.measurement import smooth

Array = NDArray[np.float64]

STEP = 1e-6  # of the largest displacement: free changes so small are linear
PLACE = 0.5 * float(chi2.isf(1e-3, 2))  # nats: less likely places than this are no candidates
NEAR = 2  # samples beside these: the blow takes its time
LASTING = (0.0, 0.125, 0.25, 0.5)  # periods that a blow may last: set by hand
MOST = 4  # knocks that are told together: set by hand
LEAST_FREE = 1e-3  # of a column squared, that parameters leave of it: less is error of derivatives
SLACK = 2.0  # times less than a knock must explain, that a score may promise: of first order
LATER = " from sample "  # in the name of a recording's later parts


@dataclass(frozen=True)
class StateJump:
    """From a sample on, a recording goes on from another state.

    Attributes
    ----------
    recording : its position in the campaign
    place : first sample after the jump, the likeliest
    earliest, latest : between which it lies
    gain : nats, in the linear approximation
    share : of what all recordings leave, that it and parameters explain
    """

    recording: int
    place: int
    earliest: int
    latest: int
    gain: float
    share: float

    def moved(self, by: int) -> StateJump:
        """The same in samples that are counted from elsewhere."""
        places = (self.place + by, self.earliest + by, self.latest + by)
        return StateJump(self.recording, *places, self.gain, self.share)


@dataclass(frozen=True, eq=False)
class _Sums:
    """Products (n, ...) of the two columns of a jump at every sample of a stretch: with the
    residual, with each other, with an orthonormal basis of what parameters do.
    """

    slope: Array
    size: Array
    shared: Array


@dataclass(frozen=True, eq=False)
class _Split:
    """A campaign whose recordings are taken as several, and a model's fit to it.

    Attributes
    ----------
    fit : of the model to all parts
    jumps : between the parts, in samples of the recordings as they were
    nats : that each of these gained
    """

    fit: Fit
    jumps: tuple[StateJump, ...] = ()
    nats: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class _Longest:
    """The longest part of every recording with knocks, and all others.

    Attributes
    ----------
    told : the knocks, each with the campaign without what lies beyond it
    fit : of the model to what stays
    parts : samples [first, end) that stay, by the recording's position
    """

    told: tuple[tuple[Fault, Campaign], ...]
    fit: Fit
    parts: dict[int, tuple[int, int]]

    def is_under_a_knock(self, inner: dict[int, tuple[int, int]]) -> bool:
        """Whether readings outside of `inner` parts leave more than noise does by chance."""
        likelihood, outside = self.fit.density.likelihood, list[Array]()
        for r, (first, end) in inner.items():
            level = likelihood.noise.level * float(likelihood.scales[r])
            begun, own = self.parts[r][0], self.fit.residuals[r] / level
            outside += [own[: max(first - begun, 0)], own[end - begun :]]
        left = np.concatenate(outside)
        usual = max(self.fit.reduced_chi2, 1.0)
        return bool(left @ left > usual * chi2.isf(FALSE_ALARM, max(left.size, 1)))


def knocks_beside(base: Fit, found: Fit) -> tuple[tuple[Compared, ...], Fit, Fit] | None:
    """The knocks that explain what a model leaves; the base model's and the model's mode of the
    recordings without what lies beyond them: of each its longest part stays. None where there are
    none.

    The model of all parts must leave no large misfit, and `EXCESS` times less for every knock than
    without; the base model, from which physics may be missing, no more than the noise.
    """
    campaign = found.density.oscillator.campaign
    recordings = campaign.recordings
    forces = found.density.likelihood.noise.forces  # along whole recordings
    if campaign.keep_faults or any(r.motion_name for r in recordings) or forces is not None:
        return None
    split = _Split(found)
    while len(split.jumps) < MOST:
        step = _next(found, split)
        if step is None:
            return None
        split = step
        if _is_enough(found, split):
            return _without(base, found, split)
    return None


def _next(found: Fit, split: _Split) -> _Split | None:
    """With one more jump, the likeliest, where that explains a part of 1 / `EXCESS` at least of
    what is left above the noise; else None.
    """
    campaign, left = found.density.oscillator.campaign, split.fit
    origins = _apart(campaign, split.jumps)[1]
    jumps = [j for part in range(len(origins)) if (j := likeliest_jump(left, part)) is not None]
    jump = max(jumps, key=lambda j: j.gain, default=None)
    if jump is None or EXCESS * SLACK * jump.share < 1.0:
        return None
    r, first = origins[jump.recording]
    more = (*split.jumps, replace(jump.moved(first), recording=r))
    model = _model(left, found.density.oscillator.effects, {})
    fit = model.fitted(_apart(campaign, more)[0])
    if fit is None or above_noise(fit) > (1.0 - 1.0 / EXCESS) * above_noise(left):
        return None
    nats = log_likelihood_gain(left.reduced_chi2, fit.reduced_chi2, campaign)
    return _Split(fit, more, (*split.nats, nats)) if nats >= CERTAIN else None


def _is_enough(found: Fit, split: _Split) -> bool:
    """Whether new starts leave as little as knocks must."""
    if split.fit.reduced_chi2 > LARGE**2:
        return False
    if not found.density.oscillator.effects and leaves_something(split.fit):
        return False  # a law of the stop that is missing may seem to act once
    return EXCESS ** len(split.jumps) * above_noise(split.fit) <= above_noise(found)


def _without(base: Fit, found: Fit, split: _Split) -> tuple[tuple[Compared, ...], Fit, Fit] | None:
    """The faults and both modes, with the longest part of every recording alone, as far from its
    knocks as these last.
    """
    campaign = found.density.oscillator.campaign
    period = 2 * np.pi * float(np.sqrt(campaign.mass / max(found.value("k1"), 1e-300)))
    splits = (_widened(split, share * period, campaign.recordings) for share in LASTING)
    tried = [one for one in (_longest(found, x) for x in splits) if one is not None]
    if not tried:
        return None
    wider = zip(tried, [*tried[1:], tried[-1]], strict=True)
    best = next(one for one, other in wider if not one.is_under_a_knock(other.parts))
    kept = best.fit.density.oscillator.campaign
    plain = _model(base, base.density.oscillator.effects, {}).fitted(kept)
    if plain is None:
        return None
    change = found.reduced_chi2, best.fit.reduced_chi2
    return tuple(Compared(fault, after, *change) for fault, after in best.told), plain, best.fit


def _widened(split: _Split, seconds: float, recordings: Sequence[Recording]) -> _Split:
    """The same with so many seconds more left out on either side of every jump, as far as there
    are readings.
    """
    jumps = list[StateJump]()
    for jump in split.jumps:
        more = round(seconds / recordings[jump.recording].interval)
        last = recordings[jump.recording].samples.size - NEAR
        jumps.append(
            replace(
                jump,
                earliest=max(jump.earliest - more, min(jump.earliest, NEAR)),
                latest=min(jump.latest + more, max(jump.latest, last)),
            )
        )
    return replace(split, jumps=tuple(jumps))


def _longest(found: Fit, split: _Split) -> _Longest | None:
    """The faults and the model's mode, with the longest part of every recording alone."""
    campaign, own = found.density.oscillator.campaign, dict[str, float]()
    told, kept, values = list[tuple[Fault, Campaign]](), campaign, values_of(split.fit)
    spans = dict[int, tuple[int, int]]()
    for r in sorted({jump.recording for jump in split.jumps}):
        recording = campaign.recordings[r]
        parts = _parts(recording, [j for j in split.jumps if j.recording == r])
        spans[r] = longest = max(parts, key=lambda part: part[1] - part[0])
        cut, gained = 0, zip(split.jumps, split.nats, strict=True)
        for jump, nats in _inwards([(j, n) for j, n in gained if j.recording == r], longest):
            now = kept.recordings[r]
            fault, part = _fault(now, jump.moved(-cut), nats, is_before=jump.place < longest[0])
            kept, cut = _with(kept, r, now.part(*part)), cut + part[0]
            told.append((fault, kept))
        name = f"[{_part_name(recording, longest[0])}]"
        own |= {n.replace(name, f"[{recording.name}]"): values[n] for n in values if name in n}
    again = _model(split.fit, found.density.oscillator.effects, own).fitted(kept)
    return None if again is None else _Longest(tuple(told), again, spans)


def _inwards(
    jumps: list[tuple[StateJump, float]], kept: tuple[int, int]
) -> list[tuple[StateJump, float]]:
    """Jumps of a recording, those farther from the part that is kept first on either side of it."""
    ordered = sorted(jumps, key=lambda one: one[0].place)
    before = [one for one in ordered if one[0].place < kept[0]]
    return [*before, *ordered[len(before) :][::-1]]


def _with(campaign: Campaign, r: int, recording: Recording) -> Campaign:
    """The campaign with another recording in the place of one."""
    recordings = campaign.recordings
    return replace(campaign, recordings=(*recordings[:r], recording, *recordings[r + 1 :]))


def _model(fit: Fit, effects: tuple[Effect, ...], values: dict[str, float]) -> SharedModel:
    """A fit's model with effects, as campaigns of other recordings are fitted with it."""
    return SharedModel(fit.density.likelihood.noise, effects, values_of(fit) | values)


def _apart(
    campaign: Campaign, jumps: Sequence[StateJump]
) -> tuple[Campaign, list[tuple[int, int]]]:
    """The campaign with its recordings as several, without the readings where jumps may lie; and of
    every part whose it is and its first sample there.
    """
    origins, recordings = list[tuple[int, int]](), list[Recording]()
    for r, recording in enumerate(campaign.recordings):
        for first, end in _parts(recording, [j for j in jumps if j.recording == r]):
            name = _part_name(recording, first)
            recordings.append(replace(recording.part(first, end), name=name))
            origins.append((r, first))
    return replace(campaign, recordings=tuple(recordings)), origins


def _part_name(recording: Recording, first: int) -> str:
    """The name of a part, the same whatever else is taken apart."""
    return f"{recording.name}{LATER}{first}" if first else recording.name


def _parts(recording: Recording, jumps: Sequence[StateJump]) -> list[tuple[int, int]]:
    """Samples between the jumps of a recording, firsts and last-plus-ones."""
    ordered = sorted(jumps, key=lambda j: j.place)
    firsts = [0, *(j.latest + NEAR for j in ordered)]
    ends = [*(j.earliest - NEAR for j in ordered), recording.samples.size]
    return list(zip(firsts, ends, strict=True))


def _fault(
    recording: Recording, jump: StateJump, nats: float, *, is_before: bool
) -> tuple[Fault, tuple[int, int]]:
    """The knock as a record, whose remedy leaves out what lies before it or after it; and the part
    that stays.
    """
    size = recording.samples.size
    first, second = _parts(recording, [jump])
    if is_before:
        kept, span, remedy = second, (0, second[0]), "start_s"
        edge = file_time(recording, second[0] - 0.4)
    else:
        kept, span, remedy = first, (first[1], size), "end_s"
        edge = file_time(recording, first[1] - 0.6)
    when = file_time(recording, jump.place)
    fault = Fault(
        id="recording_knock",
        recording=recording.name,
        spans=(span,),
        start_s=file_time(recording, first[1]),
        end_s=file_time(recording, second[0]),
        size=float("nan"),
        unit="-",
        statement=f"a knock at {when:.4g} s, or a change of the probe: the motion goes on from "
        "another state",
        remedy=f"{remedy} = {edge:.9g}",
        strength=nats,
        threshold=CERTAIN,
        action="cut",
    )
    return fault, kept


def likeliest_jump(fit: Fit, r: int) -> StateJump | None:
    """The jump of displacement and velocity that explains most of what a fit leaves of recording
    `r`; None where its gain stays below what white noise reaches at one of the samples with a
    chance of `FALSE_ALARM`.
    """
    noise, recording = (
        fit.density.likelihood.noise,
        fit.density.oscillator.campaign.recordings[r],
    )
    begin, end = change_window(fit, r)
    if begin >= end:
        return None
    signals, start = noise.in_time(
        np.column_stack([parameter_basis(fit)[r], fit.linearisation[r].residual]).T,
        recording.samples.size, recording.interval, recording.used,
    )  # fmt: skip
    first = round(start / recording.interval)
    score = _score(_sums(fit, r, signals, first))
    score[: max(begin - first, 0)] = 0.0
    score[max(end - first, 0) :] = 0.0
    best = int(np.argmax(score))
    power, count = float(fit.sums.sum()), float(fit.density.likelihood.sizes.sum())
    nats = 0.5 * score / max(noise.level**2, (power - score[best]) / count)
    if not nats[best] > 0.5 * chi2.isf(FALSE_ALARM / score.size, 2):
        return None
    near_best = np.flatnonzero(nats > nats[best] - PLACE)
    earliest, place, latest = (first + int(i) for i in (near_best[0], best, near_best[-1]))
    return StateJump(r, place, earliest, latest, float(nats[best]), float(score[best] / power))


def _sums(fit: Fit, r: int, signals: Array, first: int) -> _Sums:
    """Products of the columns of a jump at every sample from `first` on, (m, ...), with `signals`
    (p + 1, m), an orthonormal basis and the residual.
    """
    oscillator, noise = fit.density.oscillator, fit.density.likelihood.noise
    recording, count = oscillator.campaign.recordings[r], signals.shape[1]
    reach = float(np.abs(fit.displacements[r]).max())
    changes = free_changes(oscillator, r, oscillator.layout.slots(fit.mode)[r], STEP * reach)
    columns = np.zeros((2, changes.points))
    for part in changes.stretches:
        columns[:, part.begin : part.begin + part.readings.shape[0]] = part.readings.T
    seen = smooth(columns, oscillator.smoothing, recording.interval)
    white = noise.whitened(recording, seen)
    moved = noise.in_time(white, columns.shape[1], recording.interval, recording.used)[0].T
    products = np.concatenate(
        [moved[:, :, None] * signals.T[:, None, :], moved[:, :, None] * moved[:, None, :]], axis=2
    )
    sums = _from_here_on(products, changes, first)[:count]
    return _Sums(sums[..., signals.shape[0] - 1], sums[..., -2:], sums[..., : signals.shape[0] - 1])


def _from_here_on(products: Array, changes: FreeChanges, first: int) -> Array:
    """Sums of products (m, 2, k) from every row to the last, stretch by stretch: what is carried
    into the next one counts as its own changes do. The last two of k are of the changes themselves.
    """
    sums, ahead = np.zeros_like(products), np.zeros(products.shape[1:])
    begins = [max(part.begin - first, 0) for part in changes.stretches]
    ends = [*begins[1:], products.shape[0]]
    for i in reversed(range(len(begins))):
        own = slice(begins[i], ends[i])
        if begins[i] >= ends[i]:
            continue
        sums[own] = np.cumsum(products[own][::-1], axis=0)[::-1] + ahead
        carried = changes.carried[i].T  # of the stretch before, in this one's terms
        ahead = carried @ sums[begins[i]]
        ahead[:, -2:] = ahead[:, -2:] @ carried.T
    return sums


def _score(sums: _Sums) -> Array:
    """Twice the gain of a jump at every sample (n,), by what no parameter does of it."""
    free = sums.size - np.einsum("nip,njp->nij", sums.shared, sums.shared)
    scale = np.sqrt(np.maximum(np.einsum("nii->ni", sums.size), 1e-300))
    scaled = free / (scale[:, :, None] * scale[:, None, :])
    values, vectors = np.linalg.eigh(scaled)
    along = np.einsum("nij,ni->nj", vectors, sums.slope / scale)
    told = values > LEAST_FREE
    return np.asarray(np.sum(np.where(told, along**2 / np.where(told, values, 1.0), 0.0), axis=1))
