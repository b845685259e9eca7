"""Models that leave about as much as another: what they make of its parameters.

Where something remains, every model that was fitted is wrong, and odds between them say little of
which is nearer to the truth in a parameter: damping laws that explain a decay alike differ in c1 by
what each takes upon itself. The posterior is then that of a set of models, and its variance their
own and that between them (Draper 1995, J. R. Stat. Soc. B 57:45, Eq. 13), all models that do not
stand out from one another with the same weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.refits.extend import owner
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.diagnosis.selection.outcome import (
    Selection,
    doubtful_misfit,
    misfit_above_noise,
)
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.model.parameters import is_added

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Comparable:
    """Models beside a fit, with their weights.

    Attributes
    ----------
    fits : of M other models
    weights : (M,), with that of the fit itself they sum to one
    """

    fits: tuple[Fit, ...]
    weights: Array

    def between(self, fit: Fit) -> Array:
        """Mean products (d, d) of what parameters of `fit` differ by in models that have them."""
        roles = fit.density.oscillator.layout.roles("physical", "effect", "nuisance")
        change, share = np.zeros((len(self.fits), fit.mode.size)), np.zeros(fit.mode.size)
        for m, other in enumerate(self.fits):
            for i in roles:
                value = value_in(other, fit, fit.names[i])
                if value is not None:
                    change[m, i] = _difference(fit, i, value)
                    share[i] += self.weights[m]
        own = 1.0 - float(self.weights.sum())
        scaled = change * np.sqrt(self.weights)[:, None] / np.sqrt(own + share)
        return np.asarray(scaled.T @ scaled)


def alike_in_misfit(selection: Selection, fit: Fit) -> Comparable:
    """Where something remains: models without a free force that leave at most `EXCESS` times the
    misfit of `fit`, or as little as the noise level is uncertain by; all with the same weight.
    """
    most = EXCESS * max(misfit_above_noise(selection, fit), doubtful_misfit(selection))
    found = tuple(
        c.fit
        for c in selection.tried
        if c.fit is not fit
        and np.isfinite(c.log_evidence)
        and not any(name.startswith(LEARNED) for name in c.fit.names)
        and misfit_above_noise(selection, c.fit) <= most
    )
    return Comparable(found, np.full(len(found), 1.0 / (len(found) + 1)))


def alike_in_odds(
    selection: Selection, chosen: Candidate, rivals: Sequence[Candidate]
) -> Comparable:
    """Where nothing remains: rivals of the chosen model by their odds."""
    reached = selection.log_odds(chosen)
    odds = np.exp([min(selection.log_odds(c) - reached, 0.0) for c in rivals])
    return Comparable(tuple(c.fit for c in rivals), odds / (1.0 + odds.sum()))


def value_in(other: Fit, fit: Fit, name: str) -> float | None:
    """A parameter of `fit` in another model, None where it has none of this meaning.

    Of a base parameter that an effect splits per recording or obstacle the mean of its parts; of
    such a part the base parameter.
    """
    if name in other.names:
        return other.value(name)
    if not is_added(name):
        effects = other.density.oscillator.acting
        added = [n for n in other.names if is_added(n)]
        parts = [n for n in added if owner(effects, n)[1].replaces == name]
        return float(np.mean([other.value(n) for n in parts])) if parts else None
    slot = owner(fit.density.oscillator.acting, name)[1].replaces
    return other.value(slot) if slot in other.names else None


def _difference(fit: Fit, i: int, value: float) -> float:
    """What a value differs by from that of a fit; of phases modulo a turn."""
    apart, name = value - float(fit.mode[i]), fit.names[i]
    if is_added(name) and owner(fit.density.oscillator.acting, name)[1].circular:
        return float((apart + np.pi) % (2 * np.pi) - np.pi)
    return apart
