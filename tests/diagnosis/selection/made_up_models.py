"""Fits and scores that are looked up in a table of made-up evidences."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.score_test.scores import Score

A, B, C, D = "coulomb_friction", "quadratic_drag", "spring_cubic", "gap_wear"
S = "contact_second_stage"  # has a depth
N = "contact_no_tension"  # on or off
EFFECTS = tuple(BY_ID[i] for i in (A, B, C, D, S))
ENOUGH = 500.0  # a gain at which nothing is left
# behind a filter, where no residual is asked for its colour
NOISE = SimpleNamespace(level=1.0, level_error=0.01, is_coloured=False, smoothing="savgol")
TARGET = SimpleNamespace(likelihood=SimpleNamespace(sizes=np.array([1000]), noise=NOISE))


class Table:
    """Stands for the fits: a gain in log evidence over the base model for every set of effects.

    `forward` has what a fit reaches from a smaller model, where that ends in a worse place than
    one from a larger model. `unfinished` has what is gained beyond where an ascent did not
    converge, `once` where a model's first fit ends. `force` is the evidence of a free force in
    place of all effects, to which `beside` adds where there are effects that it may stand beside.
    `chi2` is that of every fit but those of `left`. `asked` are the sets that the equation of
    motion asks for, of all stretches and `asked_in_flight`, or about a model, `asked_about`, and
    `asked_ahead` those that periods ahead do, and `alone` effects that may be; `seen` what is
    gained by an effect, of which `first` are tried.
    """

    def __init__(
        self,
        gains: dict[str, float],
        force: float = 0.0,
        forward: dict[str, float] | None = None,
        unfinished: dict[str, float] | None = None,
        in_contact: float = 0.0,
        once: dict[str, float] | None = None,
        beside: float = 0.0,
        chi2: float = 1.0,
        asked: tuple[str, ...] = (),
        seen: dict[str, float] | None = None,
        asked_in_flight: tuple[str, ...] = (),
        asked_about: dict[str, tuple[str, ...]] | None = None,
        first: int = 4,
        asked_ahead: tuple[str, ...] = (),
        left: dict[str, float] | None = None,
        alone: tuple[str, ...] = (),
    ) -> None:
        self.alone = alone
        self.left = {frozenset(k.split()): v for k, v in (left or {}).items()}
        self.asked_in_flight, self.first = asked_in_flight, first
        self.asked_ahead = asked_ahead
        self.asked_about = {frozenset(k.split()): v for k, v in (asked_about or {}).items()}
        self.beside, self.chi2, self.asked, self.seen = beside, chi2, asked, seen or {}
        self.once = {frozenset(k.split()): v for k, v in (once or {}).items()}
        self.in_contact = in_contact
        self.gains = {frozenset(): 0.0} | {frozenset(k.split()): v for k, v in gains.items()}
        self.forward = {frozenset(k.split()): v for k, v in (forward or {}).items()}
        self.unfinished = {frozenset(k.split()): v for k, v in (unfinished or {}).items()}
        self.force = force
        self.fitted: list[frozenset[str]] = []
        self.goals: dict[frozenset[str], float] = {}
        self.finished: list[frozenset[str]] = []

    def gain(self, ids) -> float:
        """Sets that the table does not have are no better than their best part."""
        parts = [v for k, v in self.gains.items() if k <= frozenset(ids)]
        return max(parts)

    def candidate(self, ids, gain: float) -> Candidate:
        left = self.left.get(frozenset(ids), self.chi2)
        fit = SimpleNamespace(
            reduced_chi2=left, sums=np.array([1000.0 * left]),
            log_likelihood=gain + 10, log_posterior=gain, rms=1.0, ids=tuple(ids), gain=gain,
            converged=frozenset(ids) not in self.unfinished, density=TARGET,
        )  # fmt: skip
        return Candidate(tuple(BY_ID[i] for i in ids), fit, gain)

    def refit(self, fit, scores, scales, *, enough) -> Candidate:
        ids = (*fit.ids, *(s.effect.id for s in scores))
        self.fitted.append(key := frozenset(ids))
        self.goals[key] = enough.goal
        reached = self.forward.get(key, self.gain(ids))
        return self.candidate(ids, self.once.pop(key, reached))

    def fit_from(self, fit, effects, values, scales, *, goal) -> Candidate:
        self.fitted.append(frozenset(e.id for e in effects))
        return self.candidate([e.id for e in effects], self.gain(self.fitted[-1]))

    def asks(self, base, effects, scales):
        """What stands for the equation of motion."""

        def best(names):
            return [
                SimpleNamespace(effects=[BY_ID[i] for i in s.split()], values={}) for s in names
            ]

        def about(model, flight):
            again = self.asked_about.get(frozenset(model.ids), self.asked)
            names = self.asked_in_flight if flight else again
            return SimpleNamespace(fit=base, known=(), terms=(), best=lambda most: best(names))

        def ahead(model, about):
            return SimpleNamespace(
                fit=model.fit, best=lambda most: best(self.asked_ahead), starts=(), cost=1.0,
                gains=lambda ids, with_terms: {} if ids else {i: 1.0 for i in self.alone},
                shaped=lambda ids: ids, set_of=lambda ids, odds: best([" ".join(ids)])[0],
            )  # fmt: skip

        def first(model, about, instead=""):
            left = [i for i in self.seen if i not in model.ids]
            return set(sorted(left, key=lambda i: -self.seen[i])[: self.first]), set(self.seen)

        return SimpleNamespace(
            has_stop=bool(self.asked_in_flight), about=about, first=first,
            ahead=ahead, ahead_with_terms=lambda model: SimpleNamespace(
                fit=base, terms=(), starts=(), cost=1.0, gains=lambda ids, with_terms: {}
            ),
        )  # fmt: skip

    def without(self, candidate, effect, scales, *, enough) -> Candidate:
        ids = [i for i in candidate.ids if i != effect.id]
        return self.candidate(ids, self.gain(ids))

    def exchanged(self, candidate, old, new, scales, *, enough) -> Candidate:
        ids = [i for i in candidate.ids if i != old.id] + [new.id]
        return self.candidate(ids, self.gain(ids))

    def profiled(self, fit):
        self.finished.append(frozenset(fit.ids))
        return SimpleNamespace(
            **vars(fit)
            | {"converged": True, "gain": fit.gain + self.unfinished[frozenset(fit.ids)]}
        )

    def scan(self, fit, effects, scales, *, rng) -> Scan:
        scores = tuple(
            self.score(e, self.gain((*fit.ids, e.id)) - fit.gain)
            for e in effects
            if e.id not in fit.ids
        )
        p = 0.5 if fit.gain >= ENOUGH else 1e-6
        return Scan(scores, p, None, (), ())

    @staticmethod
    def score(effect, gain: float) -> Score:
        none = np.zeros(0)
        return Score(effect, {}, 0.0, 1.0, none, none, 0.0, none, 1.0, gain, ())

    def contact(self, fit, scales, *, rng):
        fit = SimpleNamespace(gain=self.in_contact)
        return SimpleNamespace(log_evidence=self.in_contact, fit=fit)

    def missing(self, fit, scales, *, rng):
        left = self.force - fit.gain + (self.beside if fit.ids else 0.0)
        return SimpleNamespace(p_value=0.5, log_evidence=left, gain=left + 20)


def chosen(selection) -> set[str]:
    return set(selection.chosen.candidate.ids)
