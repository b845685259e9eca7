"""Is anything missing at all? One score per effect, one p-value for all of them together.

Every direction gives a p-value of its own (normal, half-normal where only one sign is physical,
chi-squared where an effect has a size per obstacle or recording). The smallest one is judged
against its own law under the model, simulated from the joint normal law of all scores: neighbours
that overlap are not counted twice (maxT of Westfall and Young 1993, with Gaussian multipliers).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.score_test.directions import Direction, directions
from bayesimpact.diagnosis.score_test.frequency_scan import periodic_scores
from bayesimpact.diagnosis.score_test.projection import Projection, project
from bayesimpact.diagnosis.score_test.scores import LIMIT_SD, Score
from bayesimpact.diagnosis.score_test.steady import steadiness
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]

DRAWS = 4000  # of the joint law; resolves p down to 1/4000, beyond that Bonferroni bounds it
RANK_TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class Scan:
    """Scores of everything that was tried on one fit.

    Attributes
    ----------
    scores : one per direction
    p_value : of the smallest p over all of them, corrected for their number
    projection, groups, found : the raw material, for pairs and limits
    """

    scores: tuple[Score, ...]
    p_value: float
    projection: Projection
    groups: tuple[NDArray[np.int64], ...]
    found: tuple[Direction, ...]

    __repr__ = short_repr

    def best(self) -> tuple[Score, ...]:
        """The best score of every effect, strongest first."""
        by_id: dict[str, Score] = {}
        for score in self.scores:
            best_so_far = by_id.get(score.effect.id)
            if best_so_far is None or score.gain > best_so_far.gain:
                by_id[score.effect.id] = score
        return tuple(sorted(by_id.values(), key=lambda s: -s.gain))

    def starts(self, score: Score, count: int) -> tuple[Score, ...]:
        """A score and the next best ones of its effect with other shapes, `count` at most.

        Those that promise less than half as much are left out.
        """
        own = [s for s in self.scores if s.effect.id == score.effect.id and s is not score]
        others = sorted((s for s in own if s.gain > 0.5 * score.gain), key=lambda s: -s.gain)
        return (score, *others[: count - 1])


def scan(fit: Fit, effects: Sequence[Effect], scales: Scales, *, rng: np.random.Generator) -> Scan:
    """Score every effect that the fit's model does not contain."""
    single = score_directions(fit, directions(fit, effects, scales), rng=rng)
    periodic = periodic_scores(fit, effects, scales)
    families = [single.p_value, *(s.p_value for s in periodic), *steadiness(fit, scales)]
    p_value = min(1.0, len(families) * min(families))
    return replace(single, scores=(*single.scores, *periodic), p_value=p_value)


def score_directions(fit: Fit, found: tuple[Direction, ...], *, rng: np.random.Generator) -> Scan:
    """Scores of given directions on a fit."""
    if not found:
        empty = np.zeros(0)
        nothing = Projection(empty, np.zeros((0, 0)), np.zeros((fit.mode.size, 0)), empty)
        return Scan((), 1.0, nothing, (), ())
    parts = [
        np.concatenate([d.parts[r] for d in found], axis=1) for r in range(len(found[0].parts))
    ]
    projection = project(fit, parts)
    ends = np.cumsum([len(d.names) for d in found])
    groups = tuple(np.arange(end - len(d.names), end) for d, end in zip(found, ends, strict=True))
    tests = [_Test(projection, g, d) for g, d in zip(groups, found, strict=True)]
    scores = tuple(
        _score(fit, projection, d, g, test) for d, g, test in zip(found, groups, tests, strict=True)
    )
    p_value = _corrected(projection, tests, min(s.p_value for s in scores), rng)
    return Scan(scores, p_value, projection, groups, found)


class _Test:
    """Test statistic of one direction, the same for data and for simulated scores."""

    def __init__(
        self, projection: Projection, group: NDArray[np.int64], direction: Direction
    ) -> None:
        basis = _contrasts(group.size) if direction.contrast else np.eye(group.size)
        information = projection.information[np.ix_(group, group)]
        block = basis.T @ information @ basis
        alone = np.diag(information) @ basis**2  # were the sizes of a group not alike
        scale = np.sqrt(np.maximum(alone, 1e-300))
        values, vectors = np.linalg.eigh(block / np.outer(scale, scale))
        kept = values > RANK_TOLERANCE * max(values[-1], 1.0)
        root = basis @ (vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None])
        self.group, self.rank = group, int(kept.sum())
        self.one_sided = direction.one_sided and group.size == 1 == self.rank
        self.weights, self.size_map = root, root @ root.T

    def whitened(self, score: Array) -> Array:
        """Independent standard normal numbers (..., rank) from scores (..., K)."""
        return np.asarray(score[..., self.group] @ self.weights)

    def p_values(self, score: Array) -> Array:
        """p-value of this direction alone for scores (..., K)."""
        w = self.whitened(score)
        if self.rank == 0:  # the fitted parameters absorb all of it
            return np.ones(w.shape[:-1])
        if self.rank == 1:
            z = w[..., 0]
            return np.asarray(stats.norm.sf(z) if self.one_sided else 2 * stats.norm.sf(np.abs(z)))
        return np.asarray(stats.chi2.sf(np.sum(w * w, axis=-1), self.rank))


def _contrasts(size: int) -> Array:
    """Orthonormal basis (size, size - 1) of differences."""
    return np.linalg.qr(np.eye(size) - 1.0 / size)[0][:, : size - 1]


def _score(
    fit: Fit, projection: Projection, direction: Direction, group: NDArray[np.int64], test: _Test
) -> Score:
    w = test.whitened(projection.score)
    p_value = float(test.p_values(projection.score))
    size = test.size_map @ projection.score[group]
    sd = np.sqrt(np.diag(test.size_map))
    gain = 0.5 * float(w @ w)
    if test.one_sided:
        gain *= float(w[0] > 0)
    two_sided = float(stats.norm.isf(max(p_value, 1e-300) / 2))
    z = float(w[0]) if test.rank == 1 == group.size else two_sided
    bias = projection.absorbed[:, group] @ size / fit.sd
    return Score(
        direction.effect,
        direction.shapes,
        z if group.size == 1 else max(z, np.sqrt(2 * gain) - np.sqrt(test.rank)),
        p_value,
        size,
        sd,
        float(LIMIT_SD * sd[0]),
        bias,
        float(projection.kept[group].max()),
        gain,
        direction.names,
    )


def _corrected(
    projection: Projection, tests: list[_Test], smallest: float, rng: np.random.Generator
) -> float:
    bound = min(1.0, smallest * len(tests))
    if bound < 1.0 / DRAWS:
        return bound
    scale = np.sqrt(np.maximum(np.diag(projection.information), 1e-300))
    values, vectors = np.linalg.eigh(projection.information / np.outer(scale, scale))
    root = vectors * np.sqrt(np.maximum(values, 0.0)) * scale[:, None]
    draws = rng.standard_normal((DRAWS, scale.size)) @ root.T
    lowest = np.min([t.p_values(draws) for t in tests], axis=0)
    return float((1 + np.sum(lowest <= smallest)) / (1 + DRAWS))
