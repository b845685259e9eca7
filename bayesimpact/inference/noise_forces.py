"""Noise that reaches the readings through the oscillator, as that of a measured input does.

With z independent normal values, whitened readings hold D z beside their own noise: their
covariance is sigma^2 (1 + D D'). The symmetric inverse root of that whitens them; it changes the
readings along the few directions only in which D D' is not small.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Turned = tuple[
    Array, Array
]  # directions (n, K), orthonormal; variance along each, over the noise's

SMALL = 0.01  # of the noise's variance: a direction that has less changes the likelihood by less


@dataclass(frozen=True, eq=False)
class RandomForces:
    """Responses to random forces.

    Attributes
    ----------
    responses : by recording, D (n, K), whitened, over the level of the noise
    raw : the same as read, not whitened
    share : of the input, for words: rms of the random one over that of the measured one
    """

    responses: Mapping[str, Array] = field(repr=False)
    raw: Mapping[str, Array] = field(repr=False)
    share: float
    _turned: dict[object, Turned] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        whole = hashlib.sha256()
        for name, rows in sorted(self.responses.items()):
            whole.update(name.encode() + np.ascontiguousarray(rows).tobytes())
        return f"RandomForces(share={self.share!r}, sha256={whole.hexdigest()[:16]})"

    def whitened(self, name: str, white: Array, used: Mask | None) -> Array:
        """(..., n) readings that their own noise's whitening has passed, of independent values."""
        if name not in self.responses:
            return white
        directions, variances = self._along(name, white.shape[-1], used)
        weights = 1.0 / np.sqrt(1.0 + variances) - 1.0
        return np.asarray(white + (white @ directions * weights) @ directions.T)

    def log_volume(self, name: str, n: int, used: Mask | None) -> float:
        """Log determinant of `whitened`."""
        if name not in self.responses:
            return 0.0
        return -0.5 * float(np.log1p(self._along(name, n, used)[1]).sum())

    def drawn(self, rng: np.random.Generator, name: str, n: int) -> Array:
        """A draw of what the forces move n readings by, over the level of the noise."""
        if name not in self.raw:
            return np.zeros(n)
        rows = self.raw[name][:n]
        return np.asarray(rows @ rng.standard_normal(rows.shape[1]))

    def _along(self, name: str, n: int, used: Mask | None) -> Turned:
        """Of a recording's first n readings, without those set aside."""
        key = name, n, None if used is None else used.tobytes()
        if key not in self._turned:
            rows = self.responses[name][:n]
            rows = rows if used is None else np.where(used[:, None], rows, 0.0)
            variances, vectors = np.linalg.eigh(rows.T @ rows)
            large = variances > SMALL
            directions = rows @ vectors[:, large] / np.sqrt(variances[large])
            self._turned[key] = directions, variances[large]
        return self._turned[key]
