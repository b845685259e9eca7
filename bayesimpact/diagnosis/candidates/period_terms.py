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
    LIKELY,
    as_effects,
    prices_by_kind,
    reach_of,
    unlisted,
)
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.candidates.term_sets import Chosen, EffectSet
from bayesimpact.formula.law import is_formula, kind_id
from bayesimpact.formula.library import library
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

MOST_SAMPLES = 400_000  # of all recordings: their columns then take 2 x 1.7 GB
KINDS = 3  # of terms that are fitted beside as many effects: set by hand


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


def sets_with_a_term_ahead(problem: PeriodSets, most: int) -> list[list[EffectSet]]:
    """For none, one, ... and `most` - 1 effects the likeliest sets of these and a term, with terms
    of different kinds; the first is likelier than all smaller ones.
    """
    terms = [t for t, term in enumerate(problem.terms) if is_formula(term.effect)]
    if not terms or most < 1:
        return []
    none = problem.log_odds(())
    found, reached = list[list[EffectSet]](), none
    levels: list[list[Chosen]] = [[()], *problem.levels(most - 1)]
    for level in levels:
        likely = [problem.refined(chosen) for chosen in level[:LIKELY]]
        odds = {(*s, t): problem.log_odds((*s, t)) for s in likely for t in terms}
        kinds: dict[str, Chosen] = {}
        for chosen in sorted(odds, key=lambda one: -odds[one]):
            kinds.setdefault(kind_id(problem.terms[chosen[-1]].effect.id), chosen)
        best = list(kinds.values())[:KINDS]
        if odds[best[0]] <= reached:
            break
        reached = odds[best[0]]
        found.append([problem.set_of(one, odds[one] - none) for one in best])
    return found
