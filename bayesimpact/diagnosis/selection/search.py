"""What is missing: refits of admissible effects, forward selection, backward elimination, rivals.

Models are compared by their evidence times a prior that pays for multiplicity: each added effect
costs log(2 K) for a catalogue of K, so that a large catalogue makes no false names likelier. Full
refits rank the effects; scores only give their starting points, because signs and bounds are
physics and decide between near-opposites that scores cannot tell apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bayesimpact.diagnosis.budget import Budget
from bayesimpact.diagnosis.candidates.promising import (
    NEAR_MARGIN,
    SCORE_UNDERESTIMATE,
    families,
    is_redundant,
)
from bayesimpact.diagnosis.measurement.hums import fit_without_hums
from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.refit import (
    Candidate,
    base_candidate,
    in_words,
)
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_contact
from bayesimpact.diagnosis.score_test.pairs import promising_pairs
from bayesimpact.diagnosis.selection.asking import Asking
from bayesimpact.diagnosis.selection.models import NOTHING, STARTS, UNCONVERGED_SHORTFALL, Progress
from bayesimpact.diagnosis.selection.outcome import (
    ExaminedModel,
    Selection,
    explains_most,
    is_large,
)
from bayesimpact.diagnosis.selection.revision import revised
from bayesimpact.diagnosis.selection.unknown import learn_force
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.refitted import refitted
from bayesimpact.model.effects.effect import Effect, Scales

# Effects from which on a single force in contact is fitted in their place: three sizes can follow
# the shape of one law, which one or two seldom do.
IMITATING_EFFECTS = 3
BEAM = 3  # models that are extended while the best one is not white
PAIRS = 4  # refitted at the first step


def select_model(
    fit: Fit,
    effects: Sequence[Effect],
    scales: Scales,
    *,
    rng: np.random.Generator,
    progress: Progress | None = None,
    budget: Budget | None = None,
    first: Fit | None = None,
) -> Selection:
    """Find the effects that the base model of `fit` leaves out.

    Best first: the likeliest models so far are extended by every effect that scores promise
    something of, by the best pairs at first, and where the misfit is large by several effects of
    one family at once, because damping laws may help little alone and much together; what gains
    most per effect is then the next model. While it extends, the search takes any gain that the
    noise level allows, for what remains may yet be explained; effects that the odds do not demand
    are left out afterwards, and each that stays is exchanged for every other that might do what it
    does. Where the misfit was large, the search begins with what the equation of motion asks for
    and, with a stop, simulations of one period ahead; it goes on from a model that no exchange
    improves and still leaves something, but not from one that leaves a large misfit where a free
    force alone leaves nothing. It begins with the model of `first` instead, a fit to the same
    campaign, where that is given.

    Where the misfit is large and the spectra of the recordings show a hum, the search begins with
    what the recordings less that ask for.

    Where what remains is slow noise of the measuring chain, spikes of the readings, a gain or clock
    of one recording or what inputs did between their samples, or where accelerations lie at onsets
    of contacts that only a good model shows, and time allows, the search begins once more with
    that, from that model. It counts if it leaves nothing then, or if the first one was cut short
    for it.

    A search that has used up the `budget` begins no more refits, and names nothing that it has not
    compared with all that might do the same.
    """
    say = progress or (lambda message: None)
    search = _Search(effects, scales, rng, say, budget)
    if first is None:
        first = _beside_hums(fit, lambda: _Search(effects, scales, rng, say, search.budget))
    base, examined = search.found(fit, first)
    goes_on = bool(examined.candidate.effects) and search.budget.may_go_on()
    was_cut = search.revision is not None
    asks = goes_on or was_cut or search.budget.may_search_again()
    revision = revised(fit, examined, say, search.revision) if asks else None
    if revision is not None:
        again = _Search(effects, scales, rng, say, search.budget)
        again.is_last = True
        quiet = again.found(revision.base, revision.first)
        if was_cut or quiet[1].is_white:
            told = again.selection(*quiet)
            return replace(told, faults=revision.faults, band_limited=revision.band_limited)
    return search.selection(base, examined)


def _beside_hums(fit: Fit, begun: Callable[[], _Search]) -> Fit | None:
    """The model that the recordings less their hums ask for, fitted to them as they are; None where
    they have none or leave no large misfit, or where that model leaves one and there is as much
    time again to ask for another.
    """
    quiet = fit_without_hums(fit) if is_large(fit) else None
    if quiet is None:
        return None
    search = begun()
    at_first = search.budget.left
    search.progress("a hum is taken out of the recordings first")
    search.is_last = True
    base = search.examine(base_candidate(quiet))
    examined = search.asked_for(base)[0] if search.is_large else base
    left_large = is_large(examined.candidate.fit)
    if left_large and search.budget.may_search_on(search.look, at_first - search.budget.left):
        return None
    found = refitted(examined.candidate.fit, fit.density.oscillator.campaign)
    least = fit.log_posterior + DECISIVE if left_large else -np.inf
    return found if np.isfinite(found.log_posterior) and found.log_posterior > least else None


class _Search(Asking):
    """Which models to fit next, and their odds."""

    def found(self, fit: Fit, first: Fit | None) -> tuple[ExaminedModel, ExaminedModel]:
        """The base model of `fit`, and where a search from it, or from `first`, ends."""
        base = self.examine(base_candidate(fit))
        if first is not None:
            beam = [self.examine(base_candidate(first))]
        else:
            beam = self.asked_for(base) if self.is_large else [base]
        begun = set[frozenset[str]]()
        while True:
            examined = self.grown(beam)
            if self.has_bad_readings(examined):
                break
            with_term = self.with_a_term(examined, excess=1.0)
            if with_term is not examined:
                beam = [with_term]
                continue
            if not self.may_be_named(examined) or self.is_no_set(examined.candidate):
                break
            self.weigh_remainder()
            smaller = self.eliminated(examined)
            made_room = smaller is not examined and frozenset(smaller.candidate.ids) not in begun
            if not self.is_large or smaller.is_white or not made_room:
                examined = self.exchanged(smaller)
            else:
                examined = smaller
            key = frozenset(examined.candidate.ids)
            if examined.is_white or not self.is_large or key in begun or not self.may_go_on():
                break
            begun.add(key)
            beam = [examined]
        return base, self.at_its_mode(examined)

    def grown(self, beam: list[ExaminedModel]) -> ExaminedModel:
        """The model that ever more effects lead to from the first of a beam, or beside it."""
        first = examined = beam[0]
        self.left = None
        while not (examined.is_white or self.has_bad_readings(examined)) and self.may_go_on():
            if examined is not first and self.is_no_set(examined.candidate):
                break
            found, waiting = self.extensions([s for s in beam if self.may_grow(s)])
            better = self.best_first(examined, found)
            if not better or not self.leads_on(examined, better[0]):
                break
            examined = self.examine(better[0])
            if not examined.is_white:
                examined = self.restarted(examined)
            if not examined.is_white:
                beside = [self.examine(c) for c in self.beside(examined, better)]
                beam = [examined, *waiting, *beside]
        return examined

    def extensions(
        self, beam: Sequence[ExaminedModel]
    ) -> tuple[list[Candidate], list[ExaminedModel]]:
        """Models with one more effect than those of a beam, and what of the beam has to wait: where
        the misfit is large all after the first that one effect explains most of.
        """
        found = list[Candidate]()
        for i, examined in enumerate(beam):
            found += self.extended(examined)
            if any(explains_most(c, examined.candidate) for c in found):
                return found, list(beam[i + 1 :])
        return found, []

    def may_grow(self, examined: ExaminedModel) -> bool:
        """Whether a model may take in another effect."""
        return len(examined.candidate.effects) < self.most and not self.is_dominated(examined)

    def best_first(self, examined: ExaminedModel, found: Sequence[Candidate]) -> list[Candidate]:
        """Extensions of a model, the next one to examine first."""
        ranked = self.ranked(found)
        if not is_large(examined.candidate.fit):
            return ranked
        before, size = self.promise(examined.candidate), len(examined.candidate.effects)

        def gain_per_effect(candidate: Candidate) -> float:
            more = max(len(candidate.effects) - size, 1)
            return (self.promise(candidate) - before) / more

        return sorted(ranked, key=gain_per_effect, reverse=True)

    def extended(self, examined: ExaminedModel) -> list[Candidate]:
        """Models with one more effect; from the base model on also the most promising pairs.

        Only those that may overtake the best model so far, as far as scores tell; and up to the
        first that explains most of a large misfit: beside that one the others are scored anew, and
        scores tell more there.
        """
        chosen, found = examined.candidate, list[Candidate]()
        scores = self.refit_candidates(examined.scan, self.least_gain(chosen))
        asked = self.asked.first(chosen, chosen) if is_large(chosen.fit) else NOTHING
        for score in self.asked_beside(chosen, asked, examined.scan, scores):
            if not self.may_go_on():
                return found
            if is_redundant(chosen, score.effect):
                continue
            found.append(self.fit_one(chosen, examined.scan, score))
            if explains_most(found[-1], chosen):
                return found
        if not chosen.effects:
            best_single = max((c.log_evidence for c in found), default=-np.inf)
            for pair in promising_pairs(examined.scan, count=PAIRS):
                if chosen.log_evidence + pair.gain > best_single + self.cost:
                    found.append(self.fit_more(chosen, pair.scores))
        if is_large(chosen.fit) and not asked[1]:
            found += [self.fit_more(chosen, j) for j in families(examined.scan)]
        return found

    def least_gain(self, chosen: Candidate) -> float:
        """What an effect's score has to promise beside a model, nats: likelihood that makes up for
        its price and for what the best model is ahead, for no evidence gains more than that.
        """
        if is_large(chosen.fit):
            return 0.0
        behind = max(map(self.log_odds, self.tried.values())) - self.log_odds(chosen)
        return (behind + self.cost) / SCORE_UNDERESTIMATE

    def beside(self, examined: ExaminedModel, found: Sequence[Candidate]) -> list[Candidate]:
        """Single effects that are extended beside the best model: each may be half of a pair.

        Where the misfit is large every step gains much and the last ones repair the first, by
        exchanges: one model at a time is extended there.
        """
        if self.is_large:
            return []
        rest = [c for c in found if set(c.ids) != set(examined.candidate.ids)]
        kept = [c for c in rest if c.log_evidence > -np.inf and len(c.effects) == 1]
        return kept[: BEAM - 1]

    def is_dominated(self, examined: ExaminedModel) -> bool:
        """Whether a free force will explain what the effects still to come cannot, say the scores.

        Either one beside the model's effects, or one in the place of all of them. Problems
        linearised about a fit with a large misfit do not tell.
        """
        if not examined.candidate.effects or is_large(examined.candidate.fit):
            return False
        most = (
            SCORE_UNDERESTIMATE * max((s.gain for s in examined.scan.best()), default=0.0)
            + NEAR_MARGIN
        )
        more = self.most - len(examined.candidate.effects)
        if examined.unknown.log_evidence > more * most:
            return True
        return not self.is_large and self.force_gain() - self.log_odds(examined.candidate) > most

    def may_be_named(self, examined: ExaminedModel) -> bool:
        """Whether a search around a model may end with a name, white or not.

        Not where a free force wins anyhow, nor where one beside it still explains a lot.
        """
        if examined.is_white or self.is_large:
            return True
        return (
            self.log_odds(examined.candidate) > self.force_gain()
            and examined.unknown.log_evidence < UNCONVERGED_SHORTFALL
        )

    def restarted(self, examined: ExaminedModel) -> ExaminedModel:
        """The same model with the shapes of its effects sought anew beside all others.

        A frequency or a depth that was found while something else was missing may be a side
        minimum that no ascent leaves; where the misfit is large, growing stretches avoid those.
        """
        chosen = examined.candidate
        if self.is_large or len(chosen.effects) < 2:
            return examined
        if self.force_gain() > self.log_odds(chosen) + UNCONVERGED_SHORTFALL:
            return examined
        for effect in chosen.effects:
            if any(p.is_shape and not p.circular for p in effect.parameters):
                smaller = frozenset(chosen.ids) - {effect.id}
                rest = self.tried[smaller] if self.is_known(smaller) else self.drop(chosen, effect)
                found = self.scanned(rest, [effect])
                for score in found.best():
                    if score.effect.id == effect.id:
                        for start in found.starts(score, STARTS):
                            self.start(rest, [start])
        return self.examine(self.ranked([self.tried[frozenset(chosen.ids)]])[0])

    def selection(self, base: ExaminedModel, chosen: ExaminedModel) -> Selection:
        if self.may_be_named(chosen):
            best = self.best(len(chosen.candidate.effects))
            if set(best.ids) != set(chosen.candidate.ids):
                chosen = self.eliminated(self.examine(best))
        contact = missing_contact(base.candidate.fit, self.scales, rng=self.rng)
        odds = -np.inf
        tried = tuple(sorted(self.tried.values(), key=self.log_odds, reverse=True))
        many = len(chosen.candidate.effects) >= IMITATING_EFFECTS and not self.is_large
        if contact is not None and many:
            replaced = in_words(chosen.candidate.effects)
            self.progress(f"fitting a force in contact in place of {replaced}")
            fit = learn_force(base.candidate.fit, contact, self.scales)
            odds = model_evidence(fit) - base.candidate.log_evidence
        found = Selection(
            base, chosen, tried, self.cost, self.repetition(), contact, odds,
            dict(self.examined_models), {}, self.may_go_on(),
        )  # fmt: skip
        return found if chosen.is_white else self.with_residuals(found)
