"""A force of no effect that periods ahead ask for beside sets of effects.

The equation of motion along the measured motion (`likely_terms`) sees little of what acts in
contact, where few samples are. A simulation of one period sees every term of the grammar as it sees
the effects of the catalogue: one law for all of them, a column each.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.candidates.equation_error import measured_paths
from bayesimpact.diagnosis.candidates.likely_terms import (
    as_effects,
    prices_by_kind,
    reach_of,
    unlisted,
)
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.formula.library import library
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

MOST_SAMPLES = 400_000  # of all recordings: their columns then take 2 x 1.7 GB


def periods_with_terms(
    fit: Fit,
    effects: Sequence[Effect],
    scales: Scales,
    recordings: Sequence[Recording] | None = None,
) -> PeriodSets:
    """The problem of periods ahead about a fit, with all terms of the grammar; without any where
    the recordings are so long that their columns would fill the memory.
    """
    if fit.density.oscillator.counts.sum() > MOST_SAMPLES:
        return PeriodSets(fit, effects, scales, recordings=recordings)
    paths = measured_paths(fit if recordings is None else fit.with_recordings(recordings))
    acting = fit.density.oscillator.acting
    listed = {e.id for e in (*effects, *acting) if e in acting or e.admissible(scales)}
    terms = unlisted(library(scales, *reach_of(paths)), listed)
    price, cost = prices_by_kind(terms), float(np.log(2 * len(effects)))
    beyond = [max(price[t.kind] - cost, 0.0) for t in terms]
    grammar = as_effects(paths, scales, terms, beyond)
    return PeriodSets(fit, effects, scales, grammar, recordings)
