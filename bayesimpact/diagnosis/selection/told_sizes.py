"""No effect is named beside a remainder whose own interval holds none of it at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.diagnosis.intervals import NINETY, Intervals
from bayesimpact.diagnosis.refits.sizes import sizes_of
from bayesimpact.diagnosis.selection.decision import Decision, Verdict
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect


def of_told_size(decision: Decision, ranges: Intervals, fit: Fit) -> Decision:
    """Where something remains, a decision without effects of one size and no shape that may be none
    by its 90 % interval in the model that is shown: that allows for models that do not stand out
    from it, as the decision's own sizes do not. `unknown` without any effect.
    """
    if decision.verdict != "partly":
        return decision
    kept = tuple(e for e in decision.effects if not _may_be_none(ranges, e, fit))
    if kept == decision.effects:
        return decision
    verdict: Verdict = "partly" if kept else "unknown"
    return replace(decision, verdict=verdict, effects=kept)


def _may_be_none(ranges: Intervals, effect: Effect, fit: Fit) -> bool:
    sizes, shapes = sizes_of(fit, effect)
    if len(sizes) != 1 or shapes:
        return False
    ((i, null),) = sizes
    sd = float(np.sqrt(ranges.covariance[i, i]))
    return bool(abs(ranges.mean[i] - null) < NINETY * sd)
