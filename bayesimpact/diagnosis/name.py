"""What is missing: refits of admissible effects, forward selection, backward elimination, rivals.

Models are compared by their evidence times a prior that pays for multiplicity: each added effect
costs log(2 K) for a catalogue of K, so that a large catalogue makes no false names likelier. Full
refits rank the effects; scores only give their starting points, because signs and bounds are
physics and decide between near-opposites that scores cannot tell apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesimpact.diagnosis.force import MissingForce, missing_drift, missing_force
from bayesimpact.diagnosis.pairs import promising_pairs
from bayesimpact.diagnosis.periodic import shakes_in_own_band
from bayesimpact.diagnosis.refit import (
    Candidate,
    base_candidate,
    correlation_spread,
    refit,
    tempered_evidence,
    without,
)
from bayesimpact.diagnosis.scan import Scan, scan
from bayesimpact.diagnosis.scores import Score
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

ALPHA = 0.004  # of each of the three tests that ask whether anything is missing
DECISIVE = 5.5  # nats of log odds that a name needs over every rival (2 ln odds of 11)
MOST_EFFECTS = 3
WORTH_A_REFIT = 4.0  # expected gain in log likelihood, nats
NEAR_BEST = 0.5  # of the best expected gain, less a margin: below that no refit makes a rival
NEAR_MARGIN = 10.0  # nats
FAR = 50.0  # nats; beyond four times that, the floor grows with the root of the best gain only
LEAP = 30.0  # expected gain from which on effects that are on or off are always fitted, nats
RASH = 1.5  # by how much a score may underrate what a refit gains
GROSS = 3.0  # residual over noise from which on a misfit is no longer concealed
LEAST_STEP = 0.8  # an effect that takes less than this off a gross residual is not worth a name
BEAM = 3  # models that are extended while the best one is not white: it, and single effects
PAIRS = 4  # refitted at the first step
EXCHANGES = 3  # rounds of leaving out and exchanging effects

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class State:
    """One model on the way, and whether anything is missing from it.

    Attributes
    ----------
    candidate : the model
    scan : scores of everything it lacks
    force : the force of displacement and velocity that it leaves unexplained
    drift : the change of stiffness and damping with time that it leaves unexplained
    """

    candidate: Candidate
    scan: Scan
    force: MissingForce
    drift: MissingForce

    @property
    def is_white(self) -> bool:
        """True when neither the catalogue nor an unknown force explains anything more."""
        return min(self.scan.p_value, self.force.p_value, self.drift.p_value) >= ALPHA

    @property
    def unknown(self) -> MissingForce:
        """The likelier one of both free forces."""
        return max(self.force, self.drift, key=lambda f: f.log_evidence)


@dataclass(frozen=True, eq=False)
class Naming:
    """The outcome of the search for names.

    Attributes
    ----------
    base, chosen : first and last state
    tried : every model that was fitted, best first
    prior_cost : nats per added effect
    spread : samples over which the best model's residual repeats itself, where the misfit is gross
    """

    base: State
    chosen: State
    tried: tuple[Candidate, ...]
    prior_cost: float
    spread: float = 1.0

    def log_odds(self, candidate: Candidate) -> float:
        """Log posterior odds of a model against the base model."""
        return (
            tempered_evidence(candidate, self.spread)
            - tempered_evidence(self.base.candidate, self.spread)
            - self.prior_cost * len(candidate.effects)
        )

    def rivals(self) -> tuple[Candidate, ...]:
        """Models that lack a chosen effect and come within the decisive odds.

        One with more effects must be the likelier one: two effects imitate a third more often than
        the price of an effect allows for.
        """
        chosen = self.chosen.candidate
        reached = self.log_odds(chosen)
        return tuple(
            c
            for c in self.tried
            if self.log_odds(c) > reached - DECISIVE * (len(c.effects) <= len(chosen.effects))
            and not set(chosen.ids) <= set(c.ids)
            and not _is_elaboration(c, chosen)
        )

    def prefers_learned_force(self) -> bool:
        """True when one free force beats the chosen effects decisively.

        An effect that imitates a force outside the catalogue loses to that force. Where the chosen
        effects leave nothing, no force can gain more than they do, whatever the linearised problem
        promises.
        """
        force, chosen = self.base.unknown, self.chosen.candidate
        evidence = force.log_evidence
        if self.chosen.is_white:
            reached = chosen.fit.log_likelihood - self.base.candidate.fit.log_likelihood
            evidence -= max(0.0, force.gain - reached - DECISIVE)
        return evidence / self.spread > self.log_odds(chosen) + DECISIVE

    def probability(self, effect_id: str) -> float:
        """Probability that an effect is part of the model, over all models tried."""
        odds = np.array([self.log_odds(c) for c in self.tried])
        weight = np.exp(odds - odds.max())
        have = np.array([effect_id in c.ids for c in self.tried])
        return float(weight[have].sum() / weight.sum())


def name(
    fit: Fit,
    effects: Sequence[Effect],
    scales: Scales,
    *,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Naming:
    """Find the effects that the base model of `fit` leaves out."""
    search = _Search(effects, scales, rng, progress or (lambda message: None))
    state = base = search.examine(base_candidate(fit))
    beam = [base]
    while not state.is_white and len(state.candidate.effects) < MOST_EFFECTS:
        if all(search.is_hopeless(s) for s in beam):
            break
        better = [c for s in beam for c in search.extended(s)]
        better = sorted({c.ids: c for c in better}.values(), key=search.worth, reverse=True)
        if not better or search.worth(better[0]) <= search.worth(state.candidate):
            break
        if (
            is_gross(state.candidate.fit)
            and better[0].fit.rms > LEAST_STEP * state.candidate.fit.rms
        ):
            break
        state = search.examine(better[0])
        if not state.is_white:
            singles = [c for c in better[1:] if len(c.effects) == 1]
            beam = [state, *(search.examine(c) for c in singles[: BEAM - 1])]
    if state.is_white or is_gross(base.candidate.fit):  # else no name can be given
        state = search.settled(state)
    return search.naming(base, state)


class _Search:
    """The models fitted so far."""

    def __init__(
        self,
        effects: Sequence[Effect],
        scales: Scales,
        rng: np.random.Generator,
        progress: Progress,
    ) -> None:
        self.effects, self.scales, self.rng, self.progress = effects, scales, rng, progress
        self.cost = float(np.log(2 * len(effects)))
        self.tried: dict[frozenset[str], Candidate] = {}
        self.states: dict[frozenset[str], State] = {}

    def keep(self, candidate: Candidate) -> Candidate:
        key = frozenset(candidate.ids)
        if is_gross(candidate.fit) and shakes_in_own_band(candidate.fit):
            candidate = replace(candidate, log_evidence=-np.inf)
        held = self.tried.get(key)
        if held is None or candidate.log_evidence > held.log_evidence:
            self.tried[key] = candidate
        return self.tried[key]

    def examine(self, candidate: Candidate) -> State:
        self.progress("scoring what " + (" + ".join(candidate.ids) or "the base model") + " lacks")
        candidate = self.keep(candidate)
        if frozenset(candidate.ids) in self.states:
            return self.states[frozenset(candidate.ids)]
        found = scan(candidate.fit, self.effects, self.scales, rng=self.rng)
        force = missing_force(candidate.fit, self.scales, rng=self.rng)
        drift = missing_drift(candidate.fit, self.scales, rng=self.rng)
        state = State(candidate, found, force, drift)
        self.states[frozenset(candidate.ids)] = state
        return state

    def extended(self, state: State) -> list[Candidate]:
        """Models with one more effect; from the base model on also the most promising pairs."""
        scores = worth_a_refit(state.scan)
        found = [self.fit_more(state.candidate, [score]) for score in scores]
        if not state.candidate.effects:
            best_single = max((c.log_evidence for c in found), default=-np.inf)
            for pair in promising_pairs(state.scan, count=PAIRS):
                expected = state.candidate.log_evidence + pair.gain
                if expected > best_single + self.cost:
                    found.append(self.fit_more(state.candidate, pair.scores))
        return found

    def fit_more(self, candidate: Candidate, scores: Sequence[Score]) -> Candidate:
        key = frozenset((*candidate.ids, *(s.effect.id for s in scores)))
        if key not in self.tried:
            self.progress("fitting " + " + ".join((*candidate.ids, *(s.effect.id for s in scores))))
            self.keep(refit(candidate.fit, scores, self.scales))
        return self.tried[key]

    def is_hopeless(self, state: State) -> bool:
        """Whether a free force will beat all models with one more effect, as far as scores tell."""
        if not state.candidate.effects or is_gross(state.candidate.fit):
            return False
        base = self.states[frozenset()]
        most = max((s.gain for s in state.scan.best()), default=0.0)
        within_reach = self.worth(state.candidate) + RASH * most
        return base.unknown.log_evidence > within_reach - self.worth(base.candidate) + NEAR_MARGIN

    def worth(self, candidate: Candidate) -> float:
        return tempered_evidence(candidate, self.spread()) - self.cost * len(candidate.effects)

    def spread(self) -> float:
        """Samples over which the best residual repeats itself; 1 without a gross misfit."""
        base = self.tried[frozenset()]
        if not is_gross(base.fit):
            return 1.0
        best = min(self.tried.values(), key=lambda c: c.fit.reduced_chi2)
        return correlation_spread(best.fit)

    def eliminated(self, state: State) -> State:
        """Leave out effects, the least useful first, that the recordings do not demand.

        An effect stays when the model without it is decisively worse, or leaves something.
        """
        while len(state.candidate.effects) > 1:
            smaller = [self.drop(state.candidate, e) for e in state.candidate.effects]
            best = max(smaller, key=self.worth)
            lost = self.worth(state.candidate) - self.worth(best)
            if lost >= DECISIVE or (lost > 0 and not self.examine(best).is_white):
                return state
            state = self.examine(best)
        return state

    def drop(self, candidate: Candidate, effect: Effect) -> Candidate:
        key = frozenset(i for i in candidate.ids if i != effect.id)
        if key not in self.tried:
            self.progress("without " + effect.id)
            self.keep(without(candidate, effect, self.scales))
        return self.tried[key]

    def settled(self, state: State) -> State:
        """The model that neither leaving out nor exchanging an effect improves."""
        for _ in range(EXCHANGES):
            state = self.eliminated(state)
            self.compare_rivals(state)
            best = self.best(len(state.candidate.effects))
            if set(best.ids) == set(state.candidate.ids):
                break
            state = self.examine(best)
        return state

    def best(self, size: int) -> Candidate:
        """The likeliest model tried with at most so many effects."""
        return max((c for c in self.tried.values() if len(c.effects) <= size), key=self.worth)

    def compare_rivals(self, state: State) -> None:
        """Put every other effect in the place of each chosen one (for pairs and triples)."""
        chosen = state.candidate
        if len(chosen.effects) < 2:
            return
        for effect in chosen.effects:
            rest = self.drop(chosen, effect)
            scores = worth_a_refit(scan(rest.fit, self.effects, self.scales, rng=self.rng))
            for score in scores:
                if score.effect.id != effect.id:
                    self.fit_more(rest, [score])

    def naming(self, base: State, chosen: State) -> Naming:
        tried = tuple(sorted(self.tried.values(), key=self.worth, reverse=True))
        best = self.best(len(chosen.candidate.effects))
        if set(best.ids) != set(chosen.candidate.ids):
            chosen = self.examine(best)
        return Naming(base, chosen, tried, self.cost, self.spread())


def is_gross(fit: Fit) -> bool:
    """True when the residual dwarfs the noise."""
    return fit.reduced_chi2 > GROSS**2


def worth_a_refit(scan: Scan) -> list[Score]:
    """Effects whose score promises something, and not far less than the best one.

    The larger the misfit, the less a score tells. Where something can be gained at all, effects
    that do not begin at the base model (a contact without tension) are always fitted.
    """
    scores = scan.best()
    most = max((s.gain for s in scores), default=0.0)
    floor = max(WORTH_A_REFIT, min(NEAR_BEST * most, np.sqrt(FAR * most)) - NEAR_MARGIN)
    leaps = most > LEAP
    return [s for s in scores if s.gain > floor or (leaps and _is_a_leap(s.effect))]


def _is_a_leap(effect: Effect) -> bool:
    return not effect.parameters or effect.prefer is not None


def _is_elaboration(candidate: Candidate, chosen: Candidate) -> bool:
    """True when the candidate only refines the chosen model (`Effect.prefer`)."""
    extra = [e for e in candidate.effects if e.id not in chosen.ids]
    return bool(extra) and all(e.prefer in chosen.ids for e in extra)
