"""What a fit with a learned force says of every term of the grammar.

The fit supplies the motion, so that forces along it are right even where the base model's were not.
Its learned force, or the formula that the search has met, is then taken out: what its coefficients
explained is given back to the residual, and the terms of the grammar, with the other parameters
free, may explain it instead. A fit without such a force is scored as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.residual_force.gaussian_process import motion_range, whitened_one
from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.diagnosis.score_test.directions import sigma_of
from bayesimpact.formula.evidence import Problem, single_log_odds
from bayesimpact.formula.grammar import Term
from bayesimpact.formula.law import is_formula, is_formula_id, term_of
from bayesimpact.formula.library import library, local_starts, neighbours
from bayesimpact.formula.responses import motion_of, responses
from bayesimpact.inference.fit import Fit, inverse
from bayesimpact.model.effects.effect import Scales
from bayesimpact.model.linear_response.superposition import Motion

Array = NDArray[np.float64]

LEAST_KEPT = 1e-3  # of a response that other parameters must leave, for its size to mean something
REFINED = (0.25, 0.12, 0.06)  # steps of places, in widths; widths change by as many octaves
HEADS = 12  # terms whose shapes are refined
OF_A_KIND = 2
LONGEST = 60_000  # samples of a recording: responses of the whole library then take 0.25 GB
BEYOND_NOISE = 0.1  # norm of a response, noise = 1, at the plausible size, to be worth anything


@dataclass(frozen=True, eq=False)
class FormulaScores:
    """Scores of the K terms that the recordings can tell from the other parameters.

    Attributes
    ----------
    fit : where they were scored
    terms : the K of the library
    problem : what the recordings say of their sizes
    names : parameters of the fit beside those of the force that is taken out
    absorbed : (names, K) shift of these per unit of a term when it is ignored
    shift : (names,) of these when that force is taken out
    size : (K,) plausible sizes
    seen : (learned, K) coefficients of the learned force that would say the same as a term
    motions : of the recordings that were scored
    """

    fit: Fit
    terms: tuple[Term, ...]
    problem: Problem
    names: tuple[str, ...]
    absorbed: Array
    shift: Array
    size: Array
    seen: Array
    motions: tuple[Motion, ...]

    __repr__ = short_repr


def formula_scores(fit: Fit, scales: Scales, *, repetition: float = 1.0) -> FormulaScores:
    """Score the library on a fit; `repetition` samples are worth an independent one.

    The shapes of the likeliest local terms are refined: grids are coarse against what the
    recordings can tell. Recordings of more than `LONGEST` samples are left to the refits.
    """
    reach = motion_range(fit)
    met = tuple(formulas_met(fit))
    whole = (*library(scales, *reach), *met)
    counts = fit.density.oscillator.counts
    motions = {r: motion_of(fit, r) for r in range(counts.size) if counts[r] <= LONGEST}
    alone: dict[str, Any] = {"scales": scales, "repetition": repetition, "together": False}
    local = (*(t for t in whole if t.shapes and not t.width), *met, *local_starts(*reach))
    heads = _likeliest(score_terms(fit, motions, local, **alone))
    for step in REFINED:
        around = [n for t in heads for n in neighbours(t, step, max(-reach[0], reach[1]))]
        if around:
            heads = _likeliest(score_terms(fit, motions, (*heads, *around), **alone))
    added = tuple(t for t in heads if t not in whole)
    return score_terms(fit, motions, (*whole, *added), scales, repetition)


def formulas_met(fit: Fit) -> dict[Term, float]:
    """The terms of formulas that a fit has, with their shapes, and their sizes."""
    values = dict(zip(fit.names, map(float, fit.mode), strict=True))
    effects = [e for e in fit.density.oscillator.effects if is_formula(e)]
    return {term_of(e, values): values[f"{e.id}.size"] for e in effects}


def _likeliest(scores: FormulaScores) -> list[Term]:
    """The likeliest terms of all kinds that have a shape, a few of a kind at most."""
    odds = single_log_odds(scores.problem)
    taken: dict[object, int] = {}
    found: list[Term] = []
    for i in np.argsort(-odds):
        term = scores.terms[i]
        if odds[i] > 0.0 and taken.get(term.kind, 0) < OF_A_KIND and len(found) < HEADS:
            taken[term.kind] = taken.get(term.kind, 0) + 1
            found.append(term)
    return found


def score_terms(
    fit: Fit,
    motions: Mapping[int, Motion],
    terms: tuple[Term, ...],
    scales: Scales,
    repetition: float,
    together: bool = True,
) -> FormulaScores:
    """Score given terms on a fit, by the recordings whose motions are given.

    Without `together` each by itself: `information` is then diagonal.
    """
    noise = fit.density.oscillator.layout.roles("noise")
    others = np.setdiff1d(np.flatnonzero(~_of_a_force(fit)), noise)
    curvature = fit.density.priors.information(fit.mode)[others]
    slope = np.nan_to_num(fit.density.priors.gradient(fit.mode))[others]
    sums = _Sums(fit, others, len(terms), together)
    for r, motion in motions.items():
        sums.add(r, motion, terms)
    solve = inverse(sums.own + np.diag(curvature))
    own_score = sums.own_score + slope
    information = sums.terms - sums.cross.T @ solve @ sums.cross
    score = sums.score - sums.cross.T @ solve @ own_score
    plausible = plausible_sizes(terms, sums.largest, scales)
    unit = np.sqrt(np.maximum(np.diag(information), 0.0))
    whole = np.sqrt(np.maximum(np.diag(sums.terms), 1e-300))
    seen = (unit > LEAST_KEPT * whole) & (unit * plausible > BEYOND_NOISE) & np.isfinite(score)
    k = np.flatnonzero(seen)
    kept = tuple(terms[i] for i in k)
    takes = np.array([t.energy == "dissipates" for t in kept], dtype=bool)
    return FormulaScores(
        fit,
        kept,
        Problem(
            score[k] / repetition,
            information[np.ix_(k, k)] / repetition,
            float(sums.left - own_score @ solve @ own_score) / repetition,
            sums.samples / repetition,
            plausible[k],
            prices(terms)[k],
            np.where(takes, sums.power[k], 0.0),
        ),
        tuple(fit.names[i] for i in others),
        solve @ sums.cross[:, k],
        solve @ own_score,
        plausible[k],
        _seen(fit, sums, solve)[:, k],
        tuple(motions.values()),
    )


def _seen(fit: Fit, sums: _Sums, solve: Array) -> Array:
    """Posterior mean of the learned coefficients per unit of each term, (L, K).

    Of a recording without noise in which the term alone acts: what a(y) + b(y) v makes of |v| v,
    by least squares over the responses, under the prior that the learned force has.
    """
    learned = sums.learned
    if not learned.size:
        return np.zeros((0, sums.score.size))
    prior = fit.density.priors.information(fit.mode)[learned]
    through = solve @ sums.learned_own
    information = sums.learned_learned - sums.learned_own.T @ through + np.diag(prior)
    score = sums.learned_terms - through.T @ sums.cross
    return np.asarray(inverse(information) @ score)


def _learned(fit: Fit) -> NDArray[np.bool_]:
    """Which parameters are coefficients of a learned force, (d,)."""
    return np.array([n.startswith(f"{LEARNED}.") for n in fit.names])


def _of_a_force(fit: Fit) -> NDArray[np.bool_]:
    """Which parameters belong to a force that formulas stand for: learned, or a formula, (d,)."""
    return _learned(fit) | [is_formula_id(n.split(".")[0]) for n in fit.names]


class _Sums:
    """Products of whitened responses, noise = 1, summed over recordings."""

    def __init__(self, fit: Fit, others: NDArray[np.int64], count: int, together: bool) -> None:
        self.fit, self.others, self.together = fit, others, together
        learned = _learned(fit)
        self.coefficients = np.where(learned, fit.mode, 0.0)
        self.met = formulas_met(fit)
        self.sigma = sigma_of(fit)
        self.own = np.zeros((others.size, others.size))
        self.own_score = np.zeros(others.size)
        self.cross = np.zeros((others.size, count))
        self.terms = np.zeros((count, count))
        self.score = np.zeros(count)
        self.largest, self.power = np.zeros(count), np.zeros(count)
        self.left = self.samples = 0.0
        self.learned = np.flatnonzero(learned)
        size = self.learned.size
        self.learned_own = np.zeros((others.size, size))
        self.learned_learned = np.zeros((size, size))
        self.learned_terms = np.zeros((size, count))

    def add(self, r: int, motion: Motion, terms: Sequence[Term]) -> None:
        """Add recording r."""
        lin, sigma = self.fit.linearisation[r], self.sigma[r]
        taken = lin.residual + lin.jacobian @ self.coefficients[lin.columns]
        kept = np.isin(lin.columns, self.others)
        where = np.searchsorted(self.others, lin.columns[kept])
        j, z = lin.jacobian[:, kept] / sigma, taken / sigma
        out, largest, power = responses(motion, terms)
        d = whitened_one(self.fit, r, out, self.sigma)
        if self.met:  # as other terms would do it, so that none is better for how it is computed
            own = responses(motion, tuple(self.met))[0]
            z = z + np.array([*self.met.values()]) @ whitened_one(self.fit, r, own, self.sigma)
        self.own[np.ix_(where, where)] += j.T @ j
        self.own_score[where] += j.T @ z
        self.cross[where] += j.T @ d.T
        self.terms += d @ d.T if self.together else np.diag(np.einsum("kn,kn->k", d, d))
        self.score += d @ z
        free = np.isin(lin.columns, self.learned)
        if free.any():
            at, c = np.searchsorted(self.learned, lin.columns[free]), lin.jacobian[:, free] / sigma
            self.learned_own[np.ix_(where, at)] += j.T @ c
            self.learned_learned[np.ix_(at, at)] += c.T @ c
            self.learned_terms[at] += c.T @ d.T
        self.largest = np.maximum(self.largest, largest)
        self.power += power
        self.left += float(z @ z)
        self.samples += float(self.fit.density.likelihood.sizes[r])


def plausible_sizes(terms: Sequence[Term], largest: Array, scales: Scales) -> Array:
    """Sizes (K,) at which the largest force is what the catalogue's priors take for plausible:
    half the damping force of the suspension or the obstacle, a tenth of the elastic force.
    """
    contact_damping = max(scales.contact_damping * scales.impact_speed, scales.damping_force)

    def force(term: Term) -> float:
        if term.region == "contact":
            return 0.1 * scales.contact_force if term.speed.is_one else 0.5 * contact_damping
        return 0.1 * scales.force if term.speed.is_one else 0.5 * scales.damping_force

    return np.array([force(t) for t in terms]) / np.maximum(largest, 1e-300)


def prices(terms: Sequence[Term]) -> Array:
    """Nats per term: its share of a prior over the library that halves with every bit of its
    description, and ln 2 for being there at all, as effects of the catalogue pay it.
    """
    length = np.array([t.length for t in terms])
    return np.asarray(length + np.logaddexp.reduce(-length) + np.log(2.0))


def kind_prices(terms: Sequence[Term], price: Array) -> Array:
    """Price of every term with its shape free: that of all terms of its kind together, (K,)."""
    total: dict[object, float] = {}
    for term, part in zip(terms, np.exp(-price), strict=True):
        total[term.kind] = total.get(term.kind, 0.0) + float(part)
    return -np.log([total[term.kind] for term in terms])
