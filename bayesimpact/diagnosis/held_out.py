"""Does the added physics predict recordings that it has not seen?

Each recording is predicted from the others after its own first tenth has fixed its initial
conditions. The predictive density is a ratio of evidences, so nothing is plugged in:

    log p(rest of r | others, first tenth of r) = log Z(all) - log Z(all, r cut to its first tenth).

A gain shows that something was missing, never which effect: wrong names gain as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.refits.evidence import log_evidence
from bayesimpact.diagnosis.refits.extend import difference_steps
from bayesimpact.diagnosis.refits.refit import TOLERANCE
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.measurement import edge
from bayesimpact.model.oscillator import Oscillator

Array = NDArray[np.float64]

FIRST_PART = 0.1
LEAST_SAMPLES = 20
SMALL = 4.0  # nats; a smaller total gain is no evidence


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Predictive scores of one model, and of another beside it.

    Attributes
    ----------
    labels : recordings (or obstacles) held out in turn
    before, after : log predictive densities, (L,), nats
    """

    labels: tuple[str, ...]
    before: Array
    after: Array

    __repr__ = short_repr

    @property
    def gain(self) -> float:
        """Total difference, nats."""
        return float(np.sum(self.after - self.before))

    @property
    def standard_error(self) -> float:
        """Standard error of the total from its scatter over what was held out, nats."""
        difference = self.after - self.before
        if difference.size < 2:
            return float("nan")
        return float(np.std(difference, ddof=1) * np.sqrt(difference.size))

    @property
    def wins(self) -> int:
        """How many were predicted better."""
        return int(np.sum(self.after > self.before))

    @property
    def improved(self) -> bool:
        """True when the gain is large, beyond twice its standard error and nearly unanimous."""
        if self.gain <= SMALL or self.wins < len(self.labels) - len(self.labels) // 9:
            return False
        return len(self.labels) < 2 or self.gain > 2 * self.standard_error


def held_out_recordings(before: Fit, after: Fit) -> HeldOut:
    """Scores with each recording held out in turn."""
    recordings = before.density.oscillator.campaign.recordings
    groups = [[r] for r in range(len(recordings))]
    return _held_out(tuple(r.name for r in recordings), groups, before, after)


def held_out_cases(before: Fit, after: Fit) -> HeldOut:
    """Scores with all recordings of each obstacle held out in turn."""
    campaign = before.density.oscillator.campaign
    groups = [
        [i for i, r in enumerate(campaign.recordings) if r.case == case] for case in campaign.cases
    ]
    return _held_out(campaign.cases, groups, before, after)


def _held_out(
    labels: tuple[str, ...], groups: Sequence[Sequence[int]], before: Fit, after: Fit
) -> HeldOut:
    scores = [
        np.array([log_evidence(fit) - log_evidence(_without(fit, group)) for group in groups])
        for fit in (before, after)
    ]
    return HeldOut(labels, scores[0], scores[1])


def _without(fit: Fit, group: Sequence[int]) -> Fit:
    """The same model fitted with the recordings of `group` cut to their first part.

    The derivatives stay those of the whole fit: leaving data out moves the mode by little.
    """
    old = fit.density.oscillator
    campaign = _cut(old.campaign, group, old.smoothing)
    oscillator = Oscillator(campaign, old.effects, old.layout, old.smoothing)
    density = PosteriorDensity(
        Likelihood(oscillator, fit.density.likelihood.noise), fit.density.priors
    )
    cut = density.likelihood.linearise(fit.mode, difference_steps(fit, density, {}), group)
    slopes = list(fit.linearisation)
    for r, part in zip(group, cut, strict=True):
        slopes[r] = part
    return find_mode(
        density, fit.mode, slopes=tuple(slopes), tolerance=TOLERANCE, max_iterations=12
    )


def _cut(campaign: Campaign, group: Sequence[int], smoothing: Smoothing | None) -> Campaign:
    kept = list(campaign.recordings)
    for i in group:
        least = LEAST_SAMPLES + 2 * edge(smoothing, kept[i].interval)
        first = max(least, int(FIRST_PART * kept[i].samples.size))
        kept[i] = replace(kept[i], samples=kept[i].samples[:first])
    return replace(campaign, recordings=tuple(kept))
