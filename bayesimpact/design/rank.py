"""Designs ranked: by what they are expected to settle, or, where nothing is open, by k2's interval.

The score of a design is the criterion of Box and Hill (1967), the expected ln odds summed over
pairs of models with the product of their probabilities, over that sum for 1 nat. Before it counts
the chance that the verdict is then settled: that whichever model is right leads every rival by the
decisive odds. That is an average over draws of its parameters, for each of which a pair's ln odds
are normal about their mean over the noise; the nearest rival decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from bayesimpact.design.candidates import PlannedRecording, first_designs, repeats, variants
from bayesimpact.design.hypotheses import Rivalry
from bayesimpact.design.information import updated_covariance
from bayesimpact.design.odds import Odds
from bayesimpact.design.response import Response, odds_between, response
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.fit import Z90
from bayesimpact.model.parameters import bare_name

Array = NDArray[np.float64]
Progress = Callable[[str], None]

DRAWS = 256
"""Of each model's parameters: chances are then known to 0.03."""
SAME_CHANCE = 0.02
"""Chances to settle that differ by less rank by the ln odds."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """A design and what it is expected to bring.

    Attributes
    ----------
    design : the recording
    odds : (K, K) expected ln odds of row over column, were the row's model right, nats; 0 where
        there are no rivals
    log_odds : their mean over the pairs, by Box and Hill's weights; NaN without rivals
    chance : of settling an ambiguous verdict; NaN for others
    halves : stiffness -> half of its 90 % interval before and after, SI, in the first model
    narrowing : 1 less the geometric mean of after over before, over stiffnesses and models
    """

    design: PlannedRecording
    odds: Array
    log_odds: float
    chance: float
    halves: Mapping[str, tuple[float, float]]
    narrowing: float


def proposals(
    rivals: Rivalry, *, rng: np.random.Generator, progress: Progress | None = None
) -> tuple[Proposal, ...]:
    """All designs, best first.

    Releases from several heights against every obstacle come first; of the best of these, longer,
    faster sampled ones and ones with another gap. Of the repeats only the best one is kept. Designs
    for which a model's motion fails are left out.
    """
    say = progress or (lambda message: None)
    widest = max(len(h.names) for h in rivals.hypotheses)
    draws = rng.standard_normal((DRAWS, widest))

    def proposed(designs: Sequence[PlannedRecording]) -> list[Proposal]:
        found = [assess(design, rivals, draws) for design in designs]
        return ranked([p for p in found if p is not None], rivals)

    say("comparing repeats of the recordings")
    again = proposed(repeats(rivals))[:1]
    say("comparing releases")
    found = proposed(first_designs(rivals))
    best = next((p.design for p in found if p.design.joins), None)
    if best is not None:
        say("comparing longer and faster recordings, and other gaps")
        found += proposed(variants(best, rivals))
    return tuple(ranked([*again, *found], rivals))


def ranked(found: Sequence[Proposal], rivals: Rivalry) -> list[Proposal]:
    """Best first; those that would be a campaign of their own after all others."""

    def merit(p: Proposal) -> tuple[float, float]:
        if not rivals.is_open:
            return 0.0, p.narrowing
        chance = round(p.chance / SAME_CHANCE) if rivals.verdict == "ambiguous" else 0
        return chance, p.log_odds

    return sorted(found, key=lambda p: (p.design.joins, *merit(p)), reverse=True)


def assess(design: PlannedRecording, rivals: Rivalry, draws: Array) -> Proposal | None:
    """What a design is expected to bring; None where a model's motion fails or has no curvature.

    `draws` (S, at least d) are standard normal numbers, the same for all designs.
    """
    if not all(np.isfinite(h.covariance).all() for h in rivals.hypotheses):
        return None
    responses = [response(h, design, rivals) for h in rivals.hypotheses]
    if not all(r.is_finite for r in responses):
        return None
    halves, narrowing = intervals(rivals, responses)
    count = len(responses)
    mean = np.zeros((count, count))
    if not rivals.is_open:
        return Proposal(design, mean, float("nan"), float("nan"), halves, narrowing)
    pairs = {
        (i, j): odds_between(responses[i], responses[j], draws[:, : responses[i].shared.size])
        for i in range(count)
        for j in range(count)
        if i != j
    }
    for pair, odds in pairs.items():
        mean[pair] = odds.mean
    chance = decisive(rivals, pairs) if rivals.verdict == "ambiguous" else float("nan")
    return Proposal(design, mean, box_hill(rivals.probabilities, mean), chance, halves, narrowing)


def box_hill(probability: Array, odds: Array) -> float:
    """Expected ln odds (K, K) averaged over pairs of models with the product of probabilities."""
    weight = np.outer(probability, probability)
    np.fill_diagonal(weight, 0.0)
    return float(np.sum(weight * odds) / np.sum(weight))


def decisive(rivals: Rivalry, pairs: Mapping[tuple[int, int], Odds]) -> float:
    """Probability that the model that is right then leads every rival by the decisive odds."""
    now = [h.log_odds for h in rivals.hypotheses]
    total = 0.0
    for i, probability in enumerate(rivals.probabilities):
        reached = [
            (now[i] - now[j] + odds.means - DECISIVE) / np.maximum(odds.sds, 1e-9)
            for (right, j), odds in pairs.items()
            if right == i
        ]
        total += float(probability * norm.cdf(np.min(reached, axis=0)).mean())
    return total


def intervals(
    rivals: Rivalry, responses: Sequence[Response]
) -> tuple[dict[str, tuple[float, float]], float]:
    """Halves of the stiffnesses' intervals before and after in the first model, and `narrowing`."""
    first: dict[str, tuple[float, float]] = {}
    logs = []
    for k, (h, r) in enumerate(zip(rivals.hypotheses, responses, strict=True)):
        jacobian = r.at_mean[1]
        shared = jacobian[:, : r.shared.size]
        own = jacobian[:, r.shared.size :] * np.sqrt(np.diag(r.prior))[r.shared.size :]
        before = h.covariance * rivals.repetition
        after = updated_covariance(before, shared, r.known, own)
        at = stiffnesses(h.names)
        ratio = np.sqrt(np.diag(after)[at] / np.diag(before)[at])
        logs.append(float(np.mean(np.log(ratio))) if at else 0.0)
        if k == 0:
            halves = Z90 * h.sd[at]
            first = {
                h.names[i]: (float(half), float(half * q))
                for i, half, q in zip(at, halves, ratio, strict=True)
            }
    return first, float(1.0 - np.exp(rivals.probabilities @ np.array(logs)))


def stiffnesses(names: Sequence[str]) -> list[int]:
    """Positions of k2 of every obstacle; of k1 where there is none."""
    found = [i for i, n in enumerate(names) if bare_name(n) == "k2"]
    return found or [i for i, n in enumerate(names) if bare_name(n) == "k1"]
