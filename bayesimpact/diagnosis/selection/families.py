"""Families of effects of which one at least is needed, where no law of them is told apart.

A real suspension damps by several laws at once, and what remains beside the likeliest set hides
which. Each effect may then be left out, because the rest of its family does what it did; all of the
family may not. Of a family F that the chosen set S has effects of, something is needed where, among
all sets without any of F,

- S without them was fitted, and that again with the other effect of which scores promise most,
- every one trails S by the decisive odds, and
- every one leaves `EXCESS` times as much misfit as S, other effects refitted.

Models that are refused as names (a line that may be the motion's own) are none of these sets.
What acts in contact is one family here: laws of its stiffness, damping, inertia and memory do much
the same during an impact (`decision` tells them apart where the recordings do).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.selection.outcome import Selection, leaves_far_more
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.law import is_formula
from bayesimpact.model.effects.effect import Effect

CONTACT = "contact"
IN_CONTACT = ("contact stiffness", "contact damping", "contact inertia or memory", "release")


def family(effect: Effect) -> str:
    """The family that is told of: that of the catalogue, or all that acts in contact."""
    return CONTACT if effect.family in IN_CONTACT else effect.family


def untold_families(selection: Selection, told: Sequence[Effect]) -> tuple[str, ...]:
    """Families of the chosen model's effects of which none is told; of terms of a formula none."""
    own = dict.fromkeys(family(e) for e in selection.chosen.candidate.effects if not is_formula(e))
    return tuple(f for f in own if f not in {family(e) for e in told})


def is_family_needed(selection: Selection, name: str) -> bool:
    """Whether every likely hypothesis has an effect of a family, although more remains."""
    chosen = selection.chosen.candidate
    rest = frozenset(e.id for e in chosen.effects if family(e) != name)
    possible = [c for c in selection.tried if np.isfinite(selection.log_odds(c))]
    without = [c for c in possible if all(family(e) != name for e in c.effects)]
    if not (is_fitted(without, rest, 0) and is_fitted(without, rest, 1)):
        return False
    least = selection.log_odds(chosen) - DECISIVE
    return len(members(selection, name)) > 1 and all(
        selection.log_odds(c) < least and leaves_far_more(selection, c.fit) for c in without
    )


def is_fitted(models: Sequence[Candidate], ids: frozenset[str], more: int) -> bool:
    """Whether one of some models has these effects and as many `more`."""
    return any(ids <= frozenset(c.ids) and len(c.ids) == len(ids) + more for c in models)


def members(selection: Selection, name: str) -> tuple[Effect, ...]:
    """Effects of a family that were fitted, those of the chosen model first."""
    found = {
        e.id: e
        for c in (selection.chosen.candidate, *selection.tried)
        for e in c.effects
        if family(e) == name
    }
    return tuple(found.values())
