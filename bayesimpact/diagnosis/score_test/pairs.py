"""Pairs of effects, ranked in the linearised problem from one information matrix."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.score_test.scores import Score


@dataclass(frozen=True, eq=False)
class Pair:
    """Two effects and the gain in log likelihood expected of both together, nats."""

    scores: tuple[Score, Score]
    gain: float


def promising_pairs(scan: Scan, *, count: int) -> tuple[Pair, ...]:
    """The `count` best pairs whose gain is not explained by one of the two alone."""
    best = {id(s) for s in scan.best()}
    chosen = [i for i, s in enumerate(scan.scores[: len(scan.groups)]) if id(s) in best]
    pairs = []
    for i, j in itertools.combinations(chosen, 2):
        first, second = scan.scores[i], scan.scores[j]
        if not first.effect.stands_beside(second.effect):
            continue
        gain, admissible = _gain(scan, i, j)
        if admissible and gain > max(first.gain, second.gain) + 4.0:
            pairs.append(Pair((first, second), gain))
    return tuple(sorted(pairs, key=lambda p: -p.gain)[:count])


def _gain(scan: Scan, i: int, j: int) -> tuple[float, bool]:
    index = np.concatenate([scan.groups[i], scan.groups[j]])
    part = scan.projection.subset(index)
    scale = np.sqrt(np.maximum(np.diag(part.information), 1e-300))
    scaled = part.information / np.outer(scale, scale)
    size = np.linalg.pinv(scaled, rcond=1e-6, hermitian=True) @ (part.score / scale)
    gain = 0.5 * float(size @ (part.score / scale))
    ends = np.cumsum([0, scan.groups[i].size, scan.groups[j].size])
    for direction, low, high in zip(
        (scan.found[i], scan.found[j]), ends[:-1], ends[1:], strict=True
    ):
        if direction.one_sided and np.any(size[low:high] < 0):
            return gain, False
    return gain, True
