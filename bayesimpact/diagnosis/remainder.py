"""What stays unexplained beside the verdict: how large, where, and the best next guess."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesimpact.diagnosis.formulas.listing import Formulas, formula_text
from bayesimpact.diagnosis.location import locate
from bayesimpact.diagnosis.selection.outcome import ExaminedModel, Selection
from bayesimpact.formula.law import is_formula, term_of
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

MOST = 0.9  # of what is left beyond the noise: the recordings that hold it are named


@dataclass(frozen=True)
class Remainder:
    """What a fit leaves beyond the noise.

    Attributes
    ----------
    rms : of the residual less the noise, m; of all of it where of the noise only a bound is known
    share : the same over the rms of the signal about its mean
    over_noise : rms residual over the noise
    regime, displacement : where, from the force of the guess where that has effects, else from the
        free force that would explain it
    recordings : those that together hold most of it, most first
    guess : a formula, alone or with effects, ids that the likeliest larger model adds, or a form of
        force; "" for none
    """

    rms: float
    share: float
    over_noise: float
    regime: str
    displacement: tuple[float, float]
    recordings: tuple[str, ...]
    guess: str


def remainder(
    selection: Selection, after: Fit, left: ExaminedModel | None, formulas: Formulas | None = None
) -> Remainder | None:
    """What `after` leaves; `left` is the model whose remainder was examined, None for noise."""
    if left is None:
        return None
    over = float(np.sqrt(after.reduced_chi2))
    rms = beyond_noise(after)
    signal = after.signal
    guess = likeliest_formula(formulas)
    better = max(selection.tried, key=selection.log_odds).fit
    if formulas is not None and guess:
        better = formulas.fit
    have, effects = set(left.candidate.ids), better.density.oscillator.effects
    explains = bool(guess) or have < {e.id for e in effects}
    more = tuple(e for e in effects if e.id not in have) if explains else ()
    place = locate(left.candidate.fit, better, left.unknown, more)
    return Remainder(
        rms, rms / signal, over, place.regime, place.displacement, recordings_of(after),
        guess or next_guess(selection, left),
    )  # fmt: skip


def beyond_noise(fit: Fit) -> float:
    """Rms of what a fit leaves less the noise, m; all of it where the noise may be next to none."""
    if fit.density.likelihood.noise.is_bound:
        return fit.rms
    return fit.rms * float(np.sqrt(max(1.0 - 1.0 / max(fit.reduced_chi2, 1.0), 0.0)))


def recordings_of(fit: Fit) -> tuple[str, ...]:
    """Recordings that together hold `MOST` of what a fit leaves beyond the noise, most first."""
    likelihood, recordings = fit.density.likelihood, fit.density.oscillator.campaign.recordings
    beyond = np.maximum(fit.sums / likelihood.noise.level**2 - likelihood.sizes, 0.0)
    if not beyond.any():
        return ()
    order = np.argsort(-beyond, kind="stable")
    share = np.cumsum(beyond[order]) / beyond.sum()
    return tuple(recordings[i].name for i in order[: int(np.searchsorted(share, MOST)) + 1])


def likeliest_formula(formulas: Formulas | None) -> str:
    """The first formula, where it is likelier than all other models together; else ""."""
    if formulas is None or not formulas.ranked:
        return ""
    first, o = formulas.ranked[0], formulas.reference.density.oscillator
    if not (first.refitted and first.probability > 0.5):
        return ""
    return f"a force {formula_text(first.terms, angle=o.campaign.angular)}"


def next_guess(selection: Selection, left: ExaminedModel) -> str:
    """What the likeliest model tried has beyond `left`, a formula written out with the place and
    width that were fitted; else the likelier form of a free force.
    """
    have = set(left.candidate.ids)
    larger = [c for c in selection.tried if have < set(c.ids)]
    if larger and selection.log_odds(larger[0]) > selection.log_odds(left.candidate):
        more = [e for e in larger[0].effects if e.id not in have]
        return _in_formulas(more, larger[0].fit) or " + ".join(e.id for e in more)
    return (
        "a stiffness or damping that changes with time"
        if left.unknown.reach
        else "a force of displacement and velocity"
    )


def _in_formulas(effects: Sequence[Effect], fit: Fit) -> str:
    """Effects in words, those that are formulas first, as `fit` has them; "" where none is one."""
    values = dict(zip(fit.names, map(float, fit.mode), strict=True))
    terms = [term_of(e, values) for e in effects if is_formula(e)]
    if not terms:
        return ""
    text = formula_text(terms, angle=fit.density.oscillator.campaign.angular)
    others = [e.title for e in effects if not is_formula(e)]
    return f"a force {text}" + (f", with {' and '.join(others)}" if others else "")
