"""Which effects deserve a refit, by what their scores promise.

The larger the misfit, the less a score tells; a refit decides, and these floors only say which
refits cannot matter.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.model.effects.effect import Effect

LEAST_GAIN = 4.0  # expected gain in log likelihood, nats
NEAR_BEST = 0.5  # of the best expected gain, less a margin: below that no refit makes a rival
NEAR_MARGIN = 10.0  # nats
FAR = 50.0  # nats; beyond four times that, the floor grows with the root of the best gain only
DISCONTINUOUS = 8.0  # nats expected, from which on effects that are on or off are always fitted
SCORE_UNDERESTIMATE = 1.5  # by how much a score may underrate what a refit gains
JOINT = 3  # effects of one family that are tried in one step
AT_THE_STOP = {"contact", "entry", "exit"}  # regimes


def refit_candidates(scan: Scan, least: float = 0.0) -> list[Score]:
    """Effects whose score promises something (`least`, nats), and not far less than the best one.

    The larger the misfit, the less a score tells. Where something can be gained at all, effects
    that do not begin at the base model (a contact without tension) are always fitted.
    """
    scores = scan.best()
    most = max((s.gain for s in scores), default=0.0)
    floor = max(least, LEAST_GAIN, min(NEAR_BEST * most, np.sqrt(FAR * most)) - NEAR_MARGIN)
    gains = most > DISCONTINUOUS
    return [s for s in scores if s.gain > floor or (gains and is_discontinuous(s.effect))]


def is_discontinuous(effect: Effect) -> bool:
    """Whether an effect does not begin at the base model: its score has no first order."""
    return not effect.has_size or bool(effect.sets)


def is_redundant(candidate: Candidate, effect: Effect) -> bool:
    """Whether a model has the whole of an effect already, or the effect the whole of one of its.

    An effect without parameters is contained in the one that refines it.
    """
    return any(
        (e.prefer == effect.id and not effect.parameters)
        or (effect.prefer == e.id and not e.parameters)
        for e in candidate.effects
    )


def _are_alike(one: Effect, other: Effect) -> bool:
    return one.family == other.family or {one.regime, other.regime} <= AT_THE_STOP


def families(scan: Scan) -> list[list[Score]]:
    """Effects of one family that may act together, the strongest of each family first."""
    by_family: dict[str, list[Score]] = {}
    for score in scan.best():
        effect = score.effect
        members = by_family.setdefault(effect.family, [])
        beside = all(effect.stands_beside(s.effect) for s in members)
        shaped = any(p.circular for p in effect.parameters)
        if score.gain > 0 and effect.has_size and not shaped and beside:
            members.append(score)
    return [members[:JOINT] for members in by_family.values() if len(members) > 1]


def in_place_of(
    effect: Effect, scores: Sequence[Score], large: bool, asked: Collection[str] = ()
) -> list[Score]:
    """Effects that might do what one does, by their `scores` on a model without it; `large` is its
    misfit, `asked` what is asked for there.

    What explains less than half of its signal to first order cannot come near it. Effects that do
    not begin at the base model have no first order; they stand for one of their own family, or of
    the contact: where the misfit is large for no other.
    """
    own = max((s.gain for s in scores if s.effect.id == effect.id), default=0.0)
    least = NEAR_BEST * own - NEAR_MARGIN
    return [
        s
        for s in scores
        if s.effect.id != effect.id
        and (
            _are_alike(s.effect, effect)
            if is_discontinuous(s.effect) and (large or s.gain <= least)
            else s.gain > least or s.effect.id in asked
        )
    ]
