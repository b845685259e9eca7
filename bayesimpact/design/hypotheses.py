"""The models that a diagnosis left open, as plain numbers: enough to simulate what each predicts.

They are kept in the results of a diagnosis and read back by `bayesimpact next`, which needs neither
the recordings nor the search.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.quantity import Quantity
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.refits.evidence import model_evidence
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.selection.decision import Verdict
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.fit import inverse
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]

MOST = 5
"""Models that are compared: ten pairs, whose simulation takes some seconds."""
OPEN: frozenset[Verdict] = frozenset(("ambiguous", "partly", "unknown"))
"""Verdicts with rivals."""


@dataclass(frozen=True, eq=False)
class FittedModel:
    """One fitted model.

    Attributes
    ----------
    effects : beside the base oscillator
    names, mode, covariance : (d,), (d,), (d, d) its posterior in Laplace's approximation, SI
    log_odds : posterior, against the base model, nats
    """

    effects: tuple[Effect, ...]
    names: tuple[str, ...]
    mode: Array
    covariance: Array
    log_odds: float

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the effects."""
        return tuple(e.id for e in self.effects)

    @cached_property
    def known(self) -> Mapping[str, int]:
        """Position of every parameter by its name."""
        return {name: i for i, name in enumerate(self.names)}

    @property
    def sd(self) -> Array:
        """Standard deviations, (d,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @cached_property
    def conditional_sd(self) -> Array:
        """The same with all other parameters known, (d,)."""
        return np.asarray(1.0 / np.sqrt(np.maximum(np.diag(inverse(self.covariance)), 1e-300)))


@dataclass(frozen=True)
class PastRelease:
    """How one of the campaign's recordings was made.

    Attributes
    ----------
    name, case : of the recording
    y0, v0 : displacement from true rest and velocity at its first sample, m and m/s
    reach : largest displacement from rest, m
    duration, interval : s
    """

    name: str
    case: str
    y0: float
    v0: float
    reach: float
    duration: float
    interval: float


@dataclass(frozen=True, eq=False)
class Rivalry:
    """What a diagnosis left open.

    Attributes
    ----------
    verdict : of the diagnosis
    hypotheses : one or more, the model that the verdict stands for first
    noise : of the recordings
    repetition : samples per independent one in what remains, at least 1; the evidence counts each
        once, and so does the comparison of designs
    mass, stop, quantity : of the campaign
    releases : of all recordings
    """

    verdict: Verdict
    hypotheses: tuple[FittedModel, ...]
    noise: Noise
    repetition: float
    mass: float
    stop: bool
    quantity: Quantity
    releases: tuple[PastRelease, ...]

    @property
    def probabilities(self) -> Array:
        """Of the hypotheses, (K,), sum 1.

        One that trails by more than the decisive odds counts as if it trailed by these: odds were
        computed as if one of the models were right, and where something remains none is.
        """
        odds = np.array([h.log_odds for h in self.hypotheses])
        weight = np.exp(np.maximum(odds - odds.max(), -DECISIVE))
        return np.asarray(weight / weight.sum())

    @property
    def is_open(self) -> bool:
        """Whether there are rivals to tell apart."""
        return self.verdict in OPEN and len(self.hypotheses) > 1

    @property
    def cases(self) -> tuple[str, ...]:
        """Obstacles, in the campaign's order; one nameless without a stop."""
        return tuple(dict.fromkeys(r.case for r in self.releases)) if self.stop else ("",)


def rivalry(d: Diagnosis) -> Rivalry:
    """The models that a diagnosis left open, with what a further recording would be made like."""
    chosen = candidates(d)
    oscillator = chosen[0].fit.density.oscillator
    first = oscillator.campaign.recordings[0]
    return Rivalry(
        d.verdict,
        tuple(
            FittedModel(
                c.fit.density.oscillator.acting,
                c.fit.names,
                c.fit.mode,
                c.fit.covariance,
                d.selection.log_odds(c),
            )
            for c in chosen
        ),
        chosen[0].fit.density.likelihood.noise.with_smoothing(oscillator.smoothing),
        max(1.0, d.selection.repetition),
        oscillator.campaign.mass,
        oscillator.campaign.stop,
        first.quantity,
        releases(chosen[0]),
    )


def candidates(d: Diagnosis) -> tuple[Candidate, ...]:
    """The model that the verdict stands for, then its rivals, likeliest first.

    Where something remains, these are the best models of all that were fitted, with and without a
    residual force.
    """
    fit = d.after
    own = Candidate(fit.density.oscillator.effects, fit, model_evidence(fit))
    if d.verdict not in OPEN:
        return (own,)
    others: Sequence[Candidate] = d.alternatives
    if d.verdict != "ambiguous":
        others = (*d.selection.residual.values(), d.selection.chosen.candidate, *d.selection.tried)
    distinct: dict[frozenset[str], Candidate] = {}
    for other in others:
        key = frozenset(other.ids)
        if key != set(own.ids) and usable(other):
            distinct.setdefault(key, other)
    ranked = sorted(distinct.values(), key=d.selection.log_odds, reverse=True)
    return (own, *ranked[: MOST - 1])


def usable(candidate: Candidate) -> bool:
    """Whether a model has a mode with a curvature."""
    fit = candidate.fit
    return bool(np.isfinite(candidate.log_evidence) and np.isfinite(fit.covariance).all())


def releases(candidate: Candidate) -> tuple[PastRelease, ...]:
    """How the recordings of a campaign were made, by a model's mode."""
    fit = candidate.fit
    o = fit.density.oscillator
    slots = o.layout.slots(fit.mode)
    y0, v0 = (slots[:, SLOTS.index(name)] for name in ("y0", "v0"))
    return tuple(
        PastRelease(
            r.name,
            r.case,
            float(y0[i]),
            float(v0[i]),
            float(np.max(np.abs(fit.displacements[i]))),
            r.duration,
            r.interval,
        )
        for i, r in enumerate(o.campaign.recordings)
    )
