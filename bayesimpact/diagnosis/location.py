"""Where the model misses: regime, displacement, velocity, time, obstacles and recordings.

Two views. The missing force, integrated along the recorded motion, says where in (displacement,
velocity) the force acts; that of a problem linearised about a large misfit is not believed, and
what the better model's effects add takes its place. The gain in log likelihood of the best
extension over the base says when and in which recordings it shows. A mismatch of the measuring
chain is no force: it is told apart by comparing the evidence of a free force with that of a free
distortion of the probe's reading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import SECOND_STOP
from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.added_force import added_force
from bayesimpact.diagnosis.refits.size import effect_numbers, force_along
from bayesimpact.diagnosis.residual_force.gaussian_process import MissingForce, trajectory_points
from bayesimpact.diagnosis.score_test.directions import sigma_of
from bayesimpact.diagnosis.selection.outcome import Selection, is_large
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Regime
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]

INSIDE = 0.95  # of the squared force that the ranges are to hold
MOSTLY = 0.75  # share of the squared force that makes a regime
TIME_BINS = 24
_GAP = SLOTS.index("g")


@dataclass(frozen=True, eq=False)
class Location:
    """A place, and how much of what is unexplained lies in it.

    Attributes
    ----------
    regime : free, contact, entry, exit, everywhere or measurement
    share : of the unexplained force (of the gain, for a measurement) inside the ranges
    displacement, velocity, time : ranges, m, m/s, s
    recordings, cases : where it shows, most first
    force_rms : over the place, N; None for a force linearised about a large misfit
    force_sd : how well that is known where no effect tells it, N
    contact_share : share of the squared force beyond the gap
    agrees : both views name the same regime
    gain : log-likelihood gain per recording and time bin, (R, TIME_BINS), nats
    beyond_base : the force is without what base parameters could imitate
    """

    regime: Regime
    share: float
    displacement: tuple[float, float]
    velocity: tuple[float, float]
    time: tuple[float, float]
    recordings: tuple[str, ...]
    cases: tuple[str, ...]
    force_rms: float | None
    contact_share: float
    agrees: bool
    gain: Array
    force_sd: float = 0.0
    beyond_base: bool = False

    __repr__ = short_repr


def locate(base: Fit, better: Fit, force: MissingForce, effects: tuple[Effect, ...]) -> Location:
    """Place of what `better` has and `base` lacks; `force` is what is missing from `base`, to first
    order.

    The place of several effects is that of all their forces together, as far as these are forces
    of displacement and velocity; else that of the missing force. What only the measuring chain does
    has no place where something acts on the mass.
    """
    effects = tuple(e for e in effects if e.regime != "measurement") or effects
    points = trajectory_points(base)
    times = [r.times for r in base.density.oscillator.campaign.recordings]
    own = [f for f in (own_force(e, better, points, times) for e in effects) if f is not None]
    if own and len(own) == len(effects):
        weights = [np.sum(parts, axis=0) ** 2 for parts in zip(*own, strict=True)]
        return _place(base, better, points, weights, None, effects)
    large = not effects and is_large(base)
    added = added_force(base, better) if large and not base.density.oscillator.effects else None
    if added is not None:
        weights = [f**2 for f in added.forces]
        found = _place(base, better, added.points, weights, None, effects, moved=better)
        return replace(found, beyond_base=True)
    weights = [force.force(y, v, t) ** 2 for (y, v), t in zip(points, times, strict=True)]
    found = _place(base, better, points, weights, force, effects)
    return replace(found, force_rms=None) if large else found


def locate_effect(selection: Selection, effect: Effect, better: Fit) -> Location:
    """Place of one effect of `better`, from its own force, or from what the model without it
    leaves unexplained.
    """
    ids = frozenset(e.id for e in better.density.oscillator.effects)
    examined = selection.examined_models.get(ids - {effect.id}, selection.base)
    return locate(examined.candidate.fit, better, examined.unknown, (effect,))


def own_force(
    effect: Effect, fit: Fit, points: Sequence[tuple[Array, Array]], times: Sequence[Array]
) -> list[Array] | None:
    """Force of an effect's law along the recorded motions, N; None for what is not a force of
    displacement, velocity and time alone.
    """
    law = effect.law
    if law is None or law.rate is not None or law.travel is not None:
        return None
    slots = fit.density.oscillator.layout.slots(fit.mode)
    found = []
    for r, ((y, v), t) in enumerate(zip(points, times, strict=True)):
        found.append(force_along(law, y, v, t, effect_numbers(effect, fit, r), slots[r]))
    return found


def _place(
    base: Fit,
    better: Fit,
    points: Sequence[tuple[Array, Array]],
    weights: list[Array],
    force: MissingForce | None,
    effects: tuple[Effect, ...],
    moved: Fit | None = None,
) -> Location:
    """Place of a squared force, `weights` (n,) per recording, at `points` of the motion of the
    fit `moved`, which is `base` where none is given.
    """
    within = in_contact(moved or base, points, either=not effects)
    beyond = sum(float(w[c].sum()) for w, c in zip(weights, within, strict=True))
    below = sum(float(w[~c].sum()) for w, c in zip(weights, within, strict=True))
    contact_share = beyond / max(beyond + below, 1e-300)
    seen = regime_seen(contact_share)
    regime = effects[0].regime if effects else seen
    gain = gain_by_time(base, better)
    contact = regime in ("contact", "entry", "exit")  # the suspension's forces act there as well
    chosen = within if contact else [np.ones(w.size, dtype=bool) for w in weights]
    y, v, w = (np.concatenate(c) for c in ([p[0] for p in points], [p[1] for p in points], weights))
    inside = np.concatenate(chosen)
    place = _ranges(y, v, np.where(inside, w, 0.0))
    selected = inside & _between(y, place[0]) & _between(v, place[1])
    share = float(w[selected].sum()) / max(beyond + below, 1e-300)
    if force is not None and not force.reach:
        share = force.share_within(*place[0])
    rms = float(np.sqrt(np.mean(w[selected]))) if selected.any() else 0.0
    sd = 0.0
    if force is not None and selected.any():
        times = [r.times for r in base.density.oscillator.campaign.recordings]
        known = [force.deviation(*p, t) for p, t in zip(points, times, strict=True)]
        sd = float(np.sqrt(np.mean(np.concatenate(known)[selected] ** 2)))
    if regime == "measurement":
        share, rms = _positive_share(gain), 0.0
    names, cases = _where(base, gain)
    return Location(
        regime, share, place[0], place[1], _time_range(base, gain), names, cases, rms,
        contact_share, _agree(regime, seen), gain, sd,
    )  # fmt: skip


def in_contact(
    fit: Fit, points: Sequence[tuple[Array, Array]], *, either: bool
) -> list[NDArray[np.bool_]]:
    """Samples beyond the gap, per recording; of `either` stop where the campaign has two."""
    gaps = fit.density.oscillator.layout.slots(fit.mode)[:, _GAP]
    found = [y >= g for (y, _), g in zip(points, gaps, strict=True)]
    if either and SECOND_STOP in fit.density.oscillator.campaign.declared:
        other = fit.value(f"{SECOND_STOP}.gap")
        found = [here | (y < -other) for here, (y, _) in zip(found, points, strict=True)]
    return found


def regime_seen(contact_share: float) -> Regime:
    """Regime by the missing force alone."""
    if contact_share > MOSTLY:
        return "contact"
    return "free" if contact_share < 1 - MOSTLY else "everywhere"


def gain_by_time(base: Fit, better: Fit) -> Array:
    """Gain in log likelihood of `better` over `base`, nats, per recording and time bin."""
    rows = []
    pairs = zip(base.linearisation, better.linearisation, sigma_of(base), strict=True)
    smoothed = base.density.likelihood.noise.smoothing is not None
    for r, (old, new, sigma) in enumerate(pairs):
        if smoothed:  # Fourier coefficients have no time: use the residuals themselves
            a, b = base.residuals[r], better.residuals[r]
        else:
            a, b = old.residual, new.residual
        difference = 0.5 * (a**2 - b**2) / sigma**2
        rows.append([chunk.sum() for chunk in np.array_split(difference, TIME_BINS)])
    return np.array(rows)


def _ranges(y: Array, v: Array, w: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    return _shortest(y, w), _shortest(v, w)


def _shortest(x: Array, w: Array) -> tuple[float, float]:
    """Shortest interval of x that holds the share INSIDE of the weights."""
    order = np.argsort(x)
    x, share = x[order], np.cumsum(w[order])
    if share[-1] <= 0:
        return float(x[0]), float(x[-1])
    share = share / share[-1]
    ends = np.searchsorted(share, np.minimum(share + INSIDE, 1.0 - 1e-12))
    ends = np.minimum(ends, x.size - 1)
    possible = share <= 1 - INSIDE + 1e-12
    length = np.where(possible, x[ends] - x, np.inf)
    first = int(np.argmin(length)) if possible.any() else 0
    return float(x[first]), float(x[ends[first]])


def _between(x: Array, limits: tuple[float, float]) -> NDArray[np.bool_]:
    return np.asarray((x >= limits[0]) & (x <= limits[1]))


def _positive_share(gain: Array) -> float:
    positive = np.maximum(gain, 0.0).sum()
    return float(positive / max(np.abs(gain).sum(), 1e-300))


def _time_range(base: Fit, gain: Array) -> tuple[float, float]:
    longest = max(r.duration for r in base.density.oscillator.campaign.recordings)
    profile = np.cumsum(np.maximum(gain.sum(axis=0), 0.0))
    if profile[-1] <= 0:
        return 0.0, longest
    share = profile / profile[-1]
    first, last = np.searchsorted(share, [0.025, 0.975])
    return float(first * longest / TIME_BINS), float(min(last + 1, TIME_BINS) * longest / TIME_BINS)


def _where(base: Fit, gain: Array) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Recordings (and their obstacles) that together hold nine tenths of the gain."""
    recordings = base.density.oscillator.campaign.recordings
    per_recording = np.maximum(gain.sum(axis=1), 0.0)
    order = np.argsort(-per_recording)
    share = np.cumsum(per_recording[order]) / max(per_recording.sum(), 1e-300)
    count = int(np.searchsorted(share, 0.9)) + 1
    kept = [recordings[i] for i in order[:count]]
    cases = (
        tuple(dict.fromkeys(r.case for r in kept)) if base.density.oscillator.campaign.stop else ()
    )
    return tuple(r.name for r in kept), cases


def _agree(regime: Regime, seen: Regime) -> bool:
    if regime == "measurement" or seen == "everywhere" or regime == "everywhere":
        return True
    return (regime == "free") == (seen == "free")
