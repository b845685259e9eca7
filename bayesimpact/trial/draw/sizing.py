"""Sizes of planted effects, such that they stand out by so many standard errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import BayesimpactError
from bayesimpact.trial.draw.planted_effects import PLANTED_EFFECTS, EffectForm, PlantedEffect
from bayesimpact.trial.draw.planted_outside import OUTSIDE_EFFECTS
from bayesimpact.trial.draw.sensitivity import Sensitivity
from bayesimpact.trial.rig.recordings import Parameters

Array = NDArray[np.float64]
Rng = np.random.Generator

LIMIT = 5.0  # standard errors that make the detection limit
CLOSE = 0.05  # relative error of a score that is good enough
LIKE = 0.97  # cosine beyond which two effects count as one
TRIES = 10
LARGEST_STEP = 1e3


class Unsuitable(BayesimpactError):
    """This draw cannot show what it should."""


@dataclass(frozen=True, eq=False)
class Placed:
    """An effect at one size: its expected score, and what refitting the base model leaves of it."""

    size: float
    score: float
    response: Array


@dataclass(frozen=True)
class Sized:
    """A planted effect with its size found.

    Attributes
    ----------
    effect, numbers : what the rig gets
    strength : size in detection limits (of this effect beside its partner, for a pair; by the
        distance from the nearest entry of the catalogue, for a force outside it)
    score : expected score of this effect alone
    form, entry : where it comes from
    distinct, nearest : distance, in standard errors, from the effect of the catalogue that imitates
        it best, and which that is; None in a pair
    """

    effect: str
    numbers: Parameters
    strength: float
    score: float
    form: EffectForm
    entry: PlantedEffect
    distinct: float | None = None
    nearest: str | None = None


def planted_effect_of(effect: str) -> PlantedEffect:
    """How an effect of the catalogue, or a force outside it, is planted."""
    return PLANTED_EFFECTS.get(effect) or OUTSIDE_EFFECTS[effect]


def placed(sensitivity: Sensitivity, effect: str, form: EffectForm, size: float) -> Placed:
    """The effect at a given size."""
    response = sensitivity.response({effect: form.build(size)}, form.reference)
    return Placed(size, float(np.linalg.norm(response)), response)


def sized(sensitivity: Sensitivity, effect: str, form: EffectForm, strength: float) -> Placed:
    """The effect at `strength` detection limits; at its only size when it is on or off."""
    size = solve(lambda s: placed(sensitivity, effect, form, s).score, form, LIMIT * strength)
    return placed(sensitivity, effect, form, size)


def single(sensitivity: Sensitivity, effect: str, strength: float, least: float, rng: Rng) -> Sized:
    """One effect of `strength` detection limits; one that is on or off has at least `least`."""
    entry = planted_effect_of(effect)
    form = entry.form(sensitivity.design, rng)
    found = sized(sensitivity, effect, form, strength)
    if found.score < LIMIT * least * (1 - CLOSE) and not entry.by_noise:
        raise Unsuitable(f"{effect} stands out by {found.score:.1f} standard errors only")
    apart = sensitivity.distinct(found.response, besides=effect)
    numbers = form.build(found.size)
    return Sized(effect, numbers, found.score / LIMIT, found.score, form, entry, *apart)


def outside(sensitivity: Sensitivity, effect: str, strength: float, rng: Rng) -> Sized:
    """A force outside the catalogue, `strength` limits away from the nearest single entry of it."""
    entry = planted_effect_of(effect)
    form = entry.form(sensitivity.design, rng)

    def score(size: float) -> float:
        return sensitivity.distinct(placed(sensitivity, effect, form, size).response)[0]

    found = placed(sensitivity, effect, form, solve(score, form, LIMIT * strength))
    left, nearest = sensitivity.distinct(found.response)
    numbers = form.build(found.size)
    return Sized(effect, numbers, left / LIMIT, found.score, form, entry, left, nearest)


def pair(
    sensitivity: Sensitivity, ids: Sequence[str], strengths: Sequence[float], least: float, rng: Rng
) -> tuple[Sized, ...]:
    """Two effects, each `strength` limits above what the other one could imitate of it."""
    planted = [planted_effect_of(e) for e in ids]
    forms = [entry.form(sensitivity.design, rng) for entry in planted]
    both = list(zip(ids, forms, strict=True))
    found = [sized(sensitivity, effect, form, 1.0) for effect, form in both]
    own = _own_share(found, ids)
    for i, (effect, form) in enumerate(both):
        if form.start > 0:
            size = found[i].size * LIMIT * strengths[i] / (own * found[i].score)
            if size > form.largest:
                raise Unsuitable(f"{effect} would have to be unphysically large")
            found[i] = placed(sensitivity, effect, form, size)
    own = _own_share(found, ids)
    for one, (effect, _), entry in zip(found, both, planted, strict=True):
        if one.score * own < 0.7 * LIMIT * least and not entry.by_noise:
            raise Unsuitable(f"{effect} is hidden by its partner")
    return tuple(
        Sized(e, f.build(x.size), x.score * own / LIMIT, x.score, f, p)
        for (e, f), p, x in zip(both, planted, found, strict=True)
    )


def _own_share(found: Sequence[Placed], ids: Sequence[str]) -> float:
    """Share of either response that the other cannot imitate."""
    first, second = found
    cosine = float(first.response @ second.response) / max(first.score * second.score, 1e-300)
    if abs(cosine) > LIKE:
        raise Unsuitable(f"{' and '.join(ids)} look alike, cosine {cosine:.3f}")
    return float(np.sqrt(1 - cosine**2))


def solve(score: Callable[[float], float], form: EffectForm, target: float) -> float:
    """Size whose score is `target`: a power of the size, near enough, found as we go."""
    size = form.start
    if size == 0:
        return size
    power, last = 1.0, (0.0, 0.0)
    for _ in range(TRIES):
        value = score(size)
        if not np.isfinite(value) or value < 1e-6 * target:
            raise Unsuitable("the effect cannot be seen at all")
        if abs(value / target - 1) < CLOSE:
            return size
        if last[0] > 0 and size != last[0]:
            power = float(np.clip(np.log(value / last[1]) / np.log(size / last[0]), 0.5, 3.0))
        last = (size, value)
        size *= min(LARGEST_STEP, (target / value) ** (1 / power))
        if size > form.largest:
            raise Unsuitable("the effect would have to be unphysically large")
    raise Unsuitable("no size has the wanted score")
