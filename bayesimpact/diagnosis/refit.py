"""Full nonlinear refits with added effects, started from what the scores predict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.evidence import model_evidence
from bayesimpact.diagnosis.extend import (
    difference_steps,
    extend,
    owner,
    transfer,
)
from bayesimpact.diagnosis.scores import Score
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.parameters import is_added

Array = NDArray[np.float64]

TOLERANCE = 0.02  # last step of a refit, standard deviations
ITERATIONS = 40


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model with added effects, fitted.

    Attributes
    ----------
    effects : ids, in the order in which they were added
    fit : its mode
    log_evidence : by Laplace's method, with the truncation of bounded parameters
    """

    effects: tuple[Effect, ...]
    fit: Fit
    log_evidence: float

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the effects."""
        return tuple(e.id for e in self.effects)


def base_candidate(fit: Fit) -> Candidate:
    """The base model as a candidate."""
    return Candidate(fit.target.oscillator.effects, fit, model_evidence(fit))


def refit(fit: Fit, scores: Sequence[Score], scales: Scales) -> Candidate:
    """Fit the model of `fit` with the effects of `scores` added."""
    effects = (*fit.target.oscillator.effects, *(s.effect for s in scores))
    shapes = {name: value for s in scores for name, value in s.shapes.items()}
    target = extend(fit, effects, scales)
    start = transfer(fit, target.oscillator.layout, effects, scales, shapes)
    _shift(fit, target.oscillator.layout.names, start, scores)
    sizes = step_sizes(target.oscillator.layout.names, effects, scales, scores)
    found = find_mode(
        target,
        start,
        steps=difference_steps(fit, target, sizes),
        tolerance=TOLERANCE,
        max_iterations=ITERATIONS,
    )
    return Candidate(effects, found, model_evidence(found))


def without(candidate: Candidate, effect: Effect, scales: Scales) -> Candidate:
    """The candidate's model without one of its effects, refitted."""
    effects = tuple(e for e in candidate.effects if e.id != effect.id)
    target = extend(candidate.fit, effects, scales)
    layout = target.oscillator.layout
    start = transfer(candidate.fit, layout, effects, scales, {})
    sizes = step_sizes(layout.names, effects, scales, ())
    steps = difference_steps(candidate.fit, target, sizes)
    found = find_mode(target, start, steps=steps, tolerance=TOLERANCE, max_iterations=ITERATIONS)
    return Candidate(effects, found, model_evidence(found))


def step_sizes(
    names: Sequence[str], effects: Sequence[Effect], scales: Scales, scores: Sequence[Score]
) -> dict[str, float]:
    """Expected standard deviations of effect parameters, for difference steps."""
    sizes: dict[str, float] = {}
    for name in names:
        if is_added(name):
            sizes[name] = 1e-4 * owner(effects, name)[1].scale(scales)
        elif "[" not in name:
            sizes[name] = 1e-6
    for score in scores:
        sizes.update(zip(score.names, map(float, score.size_sd), strict=True))
    return sizes


def _shift(fit: Fit, names: Sequence[str], start: Array, scores: Sequence[Score]) -> None:
    """Move the start to the sizes that the scores expect, and the shared parameters with them."""
    position = {name: i for i, name in enumerate(names)}
    for score in scores:
        for name, size in zip(score.names, score.size, strict=True):
            if name in position:
                null = start[position[name]]
                start[position[name]] = null + size
        for name, shift in zip(fit.names, score.bias * fit.sd, strict=True):
            if name in position:
                start[position[name]] -= shift


def tempered_evidence(candidate: Candidate, spread: float) -> float:
    """Log evidence when only one sample in `spread` tells something new.

    Where a gross misfit stays, residuals repeat themselves over many samples and the ordinary
    evidence counts every repetition. The likelihood to the power 1 / spread counts each once (a
    power posterior, Friel and Pettitt 2008); its curvature is flatter by the same factor.
    """
    fit = candidate.fit
    if spread <= 1.0 or not np.isfinite(candidate.log_evidence):
        return candidate.log_evidence
    lost = (1.0 - 1.0 / spread) * fit.log_likelihood
    return candidate.log_evidence - lost + 0.5 * fit.mode.size * float(np.log(spread))


def correlation_spread(fit: Fit) -> float:
    """Samples over which a residual repeats itself: 1 + 2 sum of its correlations, at least 1."""
    values = []
    for part in fit.linearisation:
        x = part.residual - part.residual.mean()
        power = np.abs(np.fft.rfft(x, 2 * x.size)) ** 2
        rho = np.fft.irfft(power)[: x.size]
        rho = rho / rho[0]
        below = np.flatnonzero(rho < 0.05)
        last = int(below[0]) if below.size else x.size
        values.append(1.0 + 2.0 * float(np.sum(rho[1:last])))
    return max(1.0, float(np.mean(values)))
