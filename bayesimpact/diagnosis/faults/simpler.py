"""Whether correcting faults of recordings explains what effects of a first answer do, with less.

A probe's gain may hide behind gaps of every recording's own, a clock behind dampings per obstacle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayesimpact.diagnosis.faults.recording_faults import Corrected, Step
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from, without
from bayesimpact.diagnosis.selection.decision import Verdict
from bayesimpact.diagnosis.thresholds import DECISIVE

OPEN: Mapping[Verdict, int] = {"adequate": 0, "named": 0, "ambiguous": 1}
"""Verdicts that explain everything, by what they leave open."""


def is_complete(found: Diagnosis) -> bool:
    """Whether nothing remains and nothing is open."""
    return found.verdict in ("adequate", "named")


def may_be_simpler(steps: Sequence[Step], before: Corrected, found: Diagnosis) -> bool:
    """Whether an answer with further faults corrected could take the place of one without: not
    where these faults alone are more than all that a settled one names.
    """
    return not is_complete(found) or len(before.compared) + sum(map(len, steps)) <= _size(found)


def is_simpler(again: Diagnosis, found: Diagnosis) -> bool:
    """Whether an answer with further faults corrected leaves less open than one without, or as
    little with no more effects and faults.

    Faults that leave something unexplained have not proved themselves.
    """
    order = (OPEN.get(again.verdict, 2), _size(again)), (OPEN.get(found.verdict, 2), _size(found))
    return again.verdict in OPEN and order[0] <= order[1]


def makes_idle(corrected: Corrected, found: Diagnosis) -> bool:
    """Whether an effect of an answer is not needed decisively once further faults are corrected.

    Where each still is, the faults do not do what any of them does.
    """
    effects = found.selection.chosen.candidate.effects
    fit, layout = corrected.identification.fit, found.after.density.oscillator.layout
    shared = layout.roles("physical", "effect")
    values = {layout.names[i]: float(found.after.mode[i]) for i in shared}
    scales = campaign_scales(fit)
    whole = fit_from(fit, effects, values, scales)
    least = whole.log_evidence - found.selection.prior_cost - DECISIVE
    return any(without(whole, e, scales).log_evidence > least for e in effects)


def _size(found: Diagnosis) -> int:
    """Effects, and faults that comparing recordings showed."""
    return len(found.effects) + (len(found.corrected.compared) if found.corrected else 0)
