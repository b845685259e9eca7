"""Evidence and posterior of a force's coefficients in the linearised problem, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTHS = np.concatenate(
    [[0.0], np.geomspace(1e-6, 1.0, 13)]
)  # of a and b, relative to the elastic force


class ForceEvidence:
    """Closed-form evidence of normal coefficients with information S about them."""

    def __init__(self, information: Array, unit: Array, knots: int) -> None:
        self.knots, self.unit = knots, unit
        self.scaled = information * np.outer(unit, unit)
        self.modes: dict[float, tuple[Array, Array]] = {}
        self.pairs = [(a, b) for a in WIDTHS for b in WIDTHS if a > 0 or b > 0]

    def _ratio(self, a: float, b: float) -> float:
        """Key of the eigenvectors and eigenvalues that widths of one ratio share."""
        ratio = round(float(np.arctan2(a, b)), 12)
        if ratio not in self.modes:
            width = np.repeat([a, b], self.knots) / max(a, b)
            values, vectors = np.linalg.eigh(self.scaled * np.outer(width, width))
            self.modes[ratio] = np.maximum(values, 0.0), vectors.T * width
        return ratio

    def _factor(self, a: float, b: float) -> tuple[Array, float]:
        """Root of the posterior covariance (K, K), in units, and the evidence's penalty."""
        values, root = self.modes[self._ratio(a, b)]
        scale = max(a, b)
        root = root * scale / np.sqrt(1.0 + values * scale**2)[:, None]
        return root, 0.5 * float(np.log1p(values * scale**2).sum())

    def maximum(self, scores: Array) -> tuple[Array, NDArray[np.intp]]:
        """Largest log evidence over the widths, and which pair gives it, for scores (n, K)."""
        scaled = (scores * self.unit).T
        ratios = [self._ratio(a, b) for a, b in self.pairs]
        energies = {r: (self.modes[r][1] @ scaled) ** 2 for r in set(ratios)}
        gains = np.empty((len(self.pairs), scores.shape[0]))
        for i, (ratio, pair) in enumerate(zip(ratios, self.pairs, strict=True)):
            values, squared = self.modes[ratio][0], max(pair) ** 2
            weights = 0.5 * squared / (1.0 + values * squared)
            gains[i] = weights @ energies[ratio] - 0.5 * np.log1p(values * squared).sum()
        return gains.max(axis=0), gains.argmax(axis=0)

    def posterior(self, score: Array, a: float, b: float) -> tuple[Array, Array]:
        """Mean and covariance of the coefficients."""
        factor, _ = self._factor(a, b)
        root = factor.T * self.unit[:, None]
        covariance = root @ root.T
        return covariance @ score, covariance

    def null_draws(self, rng: np.random.Generator, count: int) -> Array:
        """Scores under the model, (count, K)."""
        values, vectors = np.linalg.eigh(self.scaled)
        root = vectors * np.sqrt(np.maximum(values, 0.0)) / self.unit[:, None]
        return np.asarray(rng.standard_normal((count, values.size)) @ root.T)
