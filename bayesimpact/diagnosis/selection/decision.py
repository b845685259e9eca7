"""The verdict that follows from the odds of all hypotheses.

Let S be the likeliest set of effects that the search reached.

1. S leaves nothing that stands out from the noise (`ExaminedModel.is_white`):
   `adequate` when S is empty, or `unknown` where the base model leaves more than half of the signal
   to coloured noise, which the motion may be itself; where the base model beats S by the decisive
   odds, nothing is proved: `adequate` if it leaves no more than the noise, else `unknown`;
   `unknown` when one free force in the place of all effects beats S by the decisive odds;
   `ambiguous` when another set comes within these odds, or the search ended by its limit before
   all that might were fitted; else `named`.
2. Something remains beside S. All odds are those with a force of time beside every hypothesis,
   where what the model nearest to the recordings leaves beside one is noise.
   Nothing is needed where a free force in the place of all effects leaves `EXCESS` times less of
   the misfit, and S with such a force beside it is not decisively likelier than that force alone:
   the effects only imitate it. Else an effect of S is needed when
   - every set of effects without it trails S by the decisive odds, or trails at all a set with the
     effect that has fewer effects or parameters; if it has more than S itself, one that has no
     more: more to fit with makes imitation easy, and the rest of the truth may be among it. Where
     the effect is a line, sets whose own line may be the motion's (`own_band`) are among these:
     they are refused as names, and still are another explanation,
   - the likeliest set without it is not decisively likelier, no force of time beside either, than
     the likeliest one with it,
   - `EXCESS` times as much is left without it, other effects refitted: of the misfit above the
     noise, or, where a force of time is all that S leaves, of that force about the motion's own
     frequencies. An effect that imitates what the catalogue lacks may put the phase right, but
     leaves most of the force,
   - its size is apart from none at all by `APART` of its own standard deviations, with what the
     remainder may have done to it in them (`discrepancy`), and a mode's damping as far below the
     critical one: what does not ring is no mode,
   - where it refines a simpler law (`Effect.prefer`), `EXCESS` times as much is left with that law
     in its place: what remains may be all that tells the two apart; where one of its family has no
     parameters at all, its size is more than one part in `EXCESS` from that at which it does what
     that one does: a size that is free also does a part of what remains,
   - no set without it, with a residual force of whichever form is likeliest, is likelier than S
     with its own residual force: by these odds (as in 1), where that force depends on what the
     effect's depends on and may be no more than the effect itself, and
   - no other effect in its place, with such a force beside, comes within these odds of that, or
     above it where it has more parameters: what remains may be what tells two laws apart.
   A search that ended by its limit must have fitted all of these.
   With needed effects the verdict is `partly`, without any it is `unknown`. Other effects of S stay
   in the fitted model, but are not named. Where every likely set that lacks one of them has another
   of its family, or where a law and the one that it refines are not told apart, and all of the
   above holds of these together, it is told that one of them is needed. Where none of a family is
   told, and S cannot spare all of them (`families`), it is told that some of the family are.

A name never rests on one p-value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from bayesimpact.diagnosis.faults.compare import base_failed
from bayesimpact.diagnosis.refits.equivalent import equivalent
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.residual_force.learned import may_restate
from bayesimpact.diagnosis.score_test.directions import is_periodic
from bayesimpact.diagnosis.selection.families import is_family_needed, members, untold_families
from bayesimpact.diagnosis.selection.outcome import (
    ExaminedModel,
    Selection,
    doubtful_misfit,
    leaves_far_more,
    leaves_something,
    misfit_above_noise,
)
from bayesimpact.diagnosis.thresholds import APART, DECISIVE, EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

Verdict = Literal["adequate", "named", "partly", "ambiguous", "unknown"]
Group = tuple[Effect, ...]

LARGEST_GROUP = 3  # effects of which one is needed: more tell little


@dataclass(frozen=True, eq=False)
class Decision:
    """A verdict and what it stands on.

    Attributes
    ----------
    verdict : see `bayesimpact.diagnosis.selection.decision`
    effects : that are named, most important first
    rivals : sets of effects that come within the decisive odds
    either : groups of effects of one family, of each of which every likely set has one
    families : of which every likely set has some effect, and those that were fitted
    """

    verdict: Verdict
    effects: tuple[Effect, ...]
    rivals: tuple[Candidate, ...] = ()
    either: tuple[Group, ...] = ()
    families: Mapping[str, Group] = field(default_factory=dict)

    @property
    def told(self) -> Group:
        """Effects that are named, or one of a group of which is."""
        return (*self.effects, *(e for group in self.either for e in group))


def decide(selection: Selection) -> Decision:
    """The verdict on a finished search.

    Where something remains, `selection.tried` must hold the chosen model and what it is without
    each of its effects, and `selection.residual` the chosen model and, where an effect
    `may_be_needed`, the base model and, unless that shows `is_imitated`, the models without each
    such effect and with others in its place.
    """
    chosen = selection.chosen
    effects = ordered(selection, chosen.candidate.effects)
    if chosen.is_white:
        if not effects:
            fit = chosen.candidate.fit
            hidden = fit.density.likelihood.noise.is_coloured and base_failed(fit)
            return Decision("unknown" if hidden else "adequate", ())
        if loses_to_nothing(selection):
            left = leaves_something(selection.base.candidate.fit)
            return Decision("unknown" if left else "adequate", ())
        if selection.prefers_learned_force():
            return Decision("unknown", ())
        rivals = selection.rivals()
        decided = selection.finished and not rivals
        return Decision("named" if decided else "ambiguous", effects, rivals)
    if is_imitated(selection):
        return Decision("unknown", ())
    needed = tuple(e for e in effects if is_told_apart(selection, e) and is_needed(selection, (e,)))
    groups = (group_of(selection, e) for e in effects if e not in needed)
    either = tuple(g for g in groups if len(g) > 1 and is_needed(selection, g))
    rivals = selection.rivals() if needed else ()
    found = Decision("partly" if needed else "unknown", needed, rivals, either)
    untold = untold_families(selection, found.told)
    families = {f: members(selection, f) for f in untold if is_family_needed(selection, f)}
    return replace(found, families=families)


def loses_to_nothing(selection: Selection) -> bool:
    """Whether the base model is decisively likelier than the chosen one."""
    base, chosen = selection.base.candidate, selection.chosen.candidate
    return selection.log_odds(base) > selection.log_odds(chosen) + DECISIVE


def is_needed(selection: Selection, group: Group) -> bool:
    """Whether every likely hypothesis has an effect of the chosen model, the first of a group, or
    another of the group, although more remains.
    """
    if not may_be_needed(selection, group):
        return False
    chosen = frozenset(selection.chosen.candidate.ids)
    if not (selection.finished or is_compared(selection, group)):
        return False
    if is_surpassed(selection, group):
        return False
    reached = selection.with_residual_force(chosen)
    return not any(
        selection.with_residual_force(ids) > reached + lead(selection, ids, group[0])
        for ids, candidate in selection.residual.items()
        if not holds(candidate.effects, group)
    )


def is_surpassed(selection: Selection, group: Group) -> bool:
    """Whether the likeliest model without any of a group is decisively likelier than all with one,
    no force of time beside either: what that force takes of a misfit is then no reason.
    """
    alone = replace(selection, beside=None)
    with_one = [c for c in selection.tried if holds(c.effects, group)]
    without = [c for c in selection.tried if not holds(c.effects, group)]
    most = max(map(alone.log_odds, with_one), default=-np.inf)
    return max(map(alone.log_odds, without), default=-np.inf) > most + DECISIVE


def is_told_apart(selection: Selection, effect: Effect) -> bool:
    """Whether far more is left with the law that an effect refines in its place, if it does, and
    its size is not that at which it does what a law without parameters does.
    """
    return not any(
        is_of_fixed_size(selection, effect, law, candidate.fit)
        or (law.id == effect.prefer and not leaves_far_more(selection, candidate.fit))
        for law, candidate in simpler_laws(selection, effect)
    )


def simpler_laws(selection: Selection, effect: Effect) -> list[tuple[Effect, Candidate]]:
    """The law that an effect refines, and those of its family without parameters, with the chosen
    model with them in its place, as far as these were fitted.
    """
    ids = frozenset(selection.chosen.candidate.ids)
    rest = ids - {effect.id}
    found = []
    for candidate in selection.tried:
        new = [e for e in candidate.effects if e.id not in ids]
        if len(new) == 1 and frozenset(candidate.ids) == rest | {new[0].id}:
            fixed = new[0].family == effect.family and not new[0].parameters
            if fixed or new[0].id == effect.prefer:
                found.append((new[0], candidate))
    return found


def is_of_fixed_size(selection: Selection, effect: Effect, law: Effect, fit: Fit) -> bool:
    """Whether an effect of one size has nearly that at which it does what a law without parameters
    does along a `fit` with that.
    """
    if law.parameters or len(effect.parameters) != 1:
        return False
    name = f"{effect.id}.{effect.parameters[0].name}"
    at = equivalent(law, effect, fit, campaign_scales(selection.base.candidate.fit))
    size = selection.chosen.candidate.fit.value(name)
    return bool(at) and EXCESS * abs(at[name] - size) < abs(at[name])


def group_of(selection: Selection, effect: Effect) -> Group:
    """An effect of the chosen model, a simpler law like it, and those of its family that likely
    sets without it have in its place; without these where one of the sets has none, or there are
    too many.
    """
    chosen = selection.chosen.candidate
    simpler = [
        law
        for law, candidate in simpler_laws(selection, effect)
        if law.id == effect.prefer or is_of_fixed_size(selection, effect, law, candidate.fit)
    ]
    alone = (effect, *simpler[:1])
    least = selection.log_odds(chosen) - DECISIVE
    others = {e.id: e for e in alone[1:]}
    for candidate in selection.tried:
        if selection.log_odds(candidate) <= least or holds(candidate.effects, (effect,)):
            continue
        same = [e for e in candidate.effects if e.family == effect.family]
        found = [e for e in same if e.id not in chosen.ids]
        if len(found) != 1:
            return alone
        others[found[0].id] = found[0]
    return (effect, *others.values()) if len(others) < LARGEST_GROUP else alone


def is_imitated(selection: Selection) -> bool:
    """Whether a free force in the place of all effects leaves far less of the misfit.

    Not where the effects with a free force beside them are decisively likelier than that force
    alone: then they do what it does not.
    """
    free = selection.residual.get(frozenset())
    if free is None:
        return False
    left = misfit_above_noise(selection, selection.chosen.candidate.fit)
    least = max(misfit_above_noise(selection, free.fit), doubtful_misfit(selection))
    both = selection.residual.get(frozenset(selection.chosen.candidate.ids))
    if both is not None and selection.log_odds(both) > selection.log_odds(free) + DECISIVE:
        return False
    return left > EXCESS * least


def is_compared(selection: Selection, group: Group) -> bool:
    """Whether a search that ended by its limit has still fitted what an effect must beat.

    With a residual force: the chosen model, the base model, the one without the effect, and the
    likeliest with another, not of its group, in its place; where none was tried, it was not.
    """
    chosen = frozenset(selection.chosen.candidate.ids)
    other = in_its_place(selection, group)
    if other is None:
        return False
    rivals = {chosen, frozenset[str](), chosen - {group[0].id}, frozenset(other.ids)}
    return rivals <= selection.residual.keys()


def lead(selection: Selection, ids: frozenset[str], effect: Effect) -> float:
    """Odds by which a model with a residual force must lead the chosen one to unseat an effect.

    One with fewer effects decisively where the force may be the effect itself (`may_restate`), for
    it then contradicts nothing; else it is another explanation, and so is another effect in a
    place: these may trail as much, or not at all where they have more parameters to fit with.
    """
    found = selection.residual[ids].effects
    if len(ids) < len(selection.chosen.candidate.effects):
        return DECISIVE if may_restate(found[-1], effect) else 0.0
    named = tuple(e for e in found if e.id in ids)
    return 0.0 if is_larger(named, selection.chosen) else -DECISIVE


def is_larger(effects: Sequence[Effect], chosen: ExaminedModel) -> bool:
    """Whether a set of effects is larger than the chosen one, or as large with more parameters."""
    return complexity(effects) > complexity(chosen.candidate.effects)


def complexity(effects: Sequence[Effect]) -> tuple[int, int]:
    """Numbers of effects and of their parameters, states at the beginning apart."""
    return len(effects), sum(not p.initial for e in effects for p in e.parameters)


def may_be_needed(selection: Selection, group: Group) -> bool:
    """`is_needed` as far as models without a residual force tell."""
    return (
        leads_without(selection, group)
        and stands_out(selection, group[0])
        and selection.apart.get(group[0].id, np.inf) >= APART
    )


def leads_without(selection: Selection, group: Group) -> bool:
    """Whether every set without an effect of a group trails the chosen one decisively, or at all
    one that has such an effect and is simpler; where it is larger than the chosen one, no larger.
    """
    chosen = selection.chosen
    own = selection.log_odds(chosen.candidate)
    with_it = [c for c in selection.tried if any(e.id in c.ids for e in group)]
    sizes = [(complexity(c.effects), selection.log_odds(c)) for c in with_it]

    def least(rival: Candidate) -> float:
        most, larger = complexity(rival.effects), is_larger(rival.effects, chosen)
        simpler = [odds for size, odds in sizes if size < most or (larger and size == most)]
        return max([own - DECISIVE, *simpler])

    others = [c for c in selection.tried if not holds(c.effects, group)]
    if is_periodic(group[0]):
        others = [with_its_evidence(c) for c in others]
    return not any(selection.log_odds(c) > least(c) for c in others)


def with_its_evidence(candidate: Candidate) -> Candidate:
    """A model, with the evidence that it would have if it were not refused."""
    refused = candidate.refused
    return candidate if refused is None else replace(candidate, log_evidence=refused)


def misses(selection: Selection, effect: Effect) -> bool:
    """Whether `EXCESS` times as much misfit is left without an effect."""
    smaller = frozenset(selection.chosen.candidate.ids) - {effect.id}
    return leaves_far_more(
        selection, next(c.fit for c in selection.tried if frozenset(c.ids) == smaller)
    )


def stands_out(selection: Selection, effect: Effect) -> bool:
    """Whether `EXCESS` times as much is left without an effect, of misfit or of force."""
    if misses(selection, effect):
        return True
    if selection.own is not None and not selection.own.leaves_noise:
        return False  # what is left is no force of time: a size of one says nothing
    ids = frozenset(selection.chosen.candidate.ids)
    smaller = ids - {effect.id}
    return selection.power.get(smaller, 0.0) > EXCESS * selection.power.get(ids, np.inf)


def in_its_place(selection: Selection, group: Group) -> Candidate | None:
    """The likeliest model with an effect in the place of one of the chosen model's, the first of a
    group, that is not of the group.
    """
    chosen = frozenset(selection.chosen.candidate.ids)
    rest = chosen - {group[0].id}
    others = [
        c
        for c in selection.tried
        if len(c.ids) == len(chosen) and rest < frozenset(c.ids) and not holds(c.effects, group)
    ]
    return max(others, key=selection.log_odds, default=None)


def holds(effects: Sequence[Effect], group: Group) -> bool:
    """Whether a model has an effect of a group, one that reduces to it (`prefer`), or its
    restatement.
    """
    return any(g.id in (e.id, e.prefer) or g.is_same_law(e) for e in effects for g in group)


def ordered(selection: Selection, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Effects by how much evidence the model loses without them."""
    if len(effects) < 2:
        return effects
    chosen = set(selection.chosen.candidate.ids)
    left = {frozenset(c.ids): c for c in selection.tried}

    def loss(effect: Effect) -> float:
        smaller = left.get(frozenset(chosen - {effect.id}))
        return float("-inf") if smaller is None else smaller.log_evidence

    return tuple(sorted(effects, key=loss))
