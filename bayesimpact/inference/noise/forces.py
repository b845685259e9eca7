"""Noise that reaches the readings through the oscillator, as that of a measured input does.

A random force changes the motion's two free changes, and these the readings. What the samples so
far say of both, and of the readings' own noise, is a normal distribution that one step of Kalman's
filter (Kalman 1960, J. Basic Eng. 82:35) carries on, as in `noise.prediction`: exact, over gaps
too, at a cost that grows with the number of samples.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.frozen import Picklable
from bayesimpact.inference.noise.prediction import Parts
from bayesimpact.model.jit.compiled import compiled
from bayesimpact.model.linear_response.superposition import StateSpace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RandomForces(Picklable):
    """A random force in every recording, of independent values from sample to sample.

    Attributes
    ----------
    paths : by recording, how forces change its readings
    sizes : by recording, standard deviation of the force, N, over the level of the noise
    share : of the input, for words: rms of the random force over that of the measured one
    """

    paths: Mapping[str, StateSpace] = field(repr=False)
    sizes: Mapping[str, float]
    share: float
    _known: dict[object, tuple[Array, Array]] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        whole = hashlib.sha256()
        for name, path in sorted(self.paths.items()):
            whole.update(name.encode())
            for array in (path.readings, path.increments, path.transitions):
                whole.update(np.ascontiguousarray(array).tobytes())
        sizes = dict(self.sizes)
        return f"RandomForces({sizes!r}, share={self.share!r}, {whole.hexdigest()[:16]})"

    def __getstate__(self) -> dict[str, Any]:
        return super().__getstate__() | {"_known": {}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self.__dict__["_known"] = {}

    def in_other_units(self, by: float) -> RandomForces:
        """The same forces, over a noise level that is smaller by a factor."""
        sizes = {name: by * size for name, size in self.sizes.items()}
        return RandomForces(self.paths, MappingProxyType(sizes), self.share)

    def innovations(self, name: str, x: Array, parts: Parts, used: Mask | None) -> Array:
        """Innovations of a recording's signals (..., n) over their standard deviation, (..., n).

        They have the variance of the readings' noise, whose processes are `parts`. 0 where `used`
        (n,) is False.
        """
        rows = np.ascontiguousarray(x.reshape(-1, x.shape[-1]))
        n, path = rows.shape[1], self.paths[name]
        sd, gains = self._steps(name, n, parts, used)
        correlations = np.array([correlation for correlation, _ in parts])
        white = _innovations(rows, path.readings[:n], path.transitions[:n], correlations, sd, gains)
        return np.asarray(white.reshape(x.shape))

    def log_determinant(self, name: str, n: int, parts: Parts, used: Mask | None) -> float:
        """Of the operator that makes `innovations` of the samples used."""
        sd, _ = self._steps(name, n, parts, used)
        return -float(np.sum(np.log(sd[np.isfinite(sd)])))

    def drawn(self, rng: np.random.Generator, name: str, n: int) -> Array:
        """A draw of what the force moves n readings by, over the level of the noise."""
        if name not in self.paths:
            return np.zeros(n)
        path, forces = self.paths[name], self.sizes[name] * rng.standard_normal(n)
        return np.asarray(
            _moved(forces, path.readings[:n], path.increments[:n], path.transitions[:n])
        )

    def _steps(self, name: str, n: int, parts: Parts, used: Mask | None) -> tuple[Array, Array]:
        key = name, n, parts, None if used is None else used.tobytes()
        if key not in self._known:
            path, kept = self.paths[name], np.ones(n, dtype=np.bool_) if used is None else used
            increments = self.sizes[name] * path.increments[:n]
            correlations, shares = np.array(parts).T
            self._known[key] = _filter(
                path.readings[:n], increments, path.transitions[:n], kept, correlations, shares
            )
        return self._known[key]


@compiled()
def _filter(readings, increments, transitions, used, correlations, shares):  # type: ignore[no-untyped-def]
    """Standard deviation of every innovation, infinite where there is none, and by how much of it
    both free changes and every process are to be corrected, (n, 2 + K).
    """
    n, size = used.size, 2 + shares.size
    sd, gains = np.empty(n), np.zeros((n, size))
    covariance, step, seen = np.zeros((size, size)), np.zeros((size, size)), np.ones(size)
    for j in range(2, size):
        covariance[j, j], step[j, j] = shares[j - 2], correlations[j - 2]
    for i in range(n):
        if i > 0:
            for a in range(2):
                for b in range(2):
                    covariance[a, b] += increments[i, a] * increments[i, b]
                    step[a, b] = transitions[i, a, b]
            covariance = step @ covariance @ step.T
            for j in range(2, size):
                covariance[j, j] += shares[j - 2] * (1.0 - correlations[j - 2] ** 2)
        seen[:2] = readings[i]
        along = covariance @ seen
        variance = seen @ along
        sd[i] = np.sqrt(variance) if used[i] else np.inf
        if used[i]:
            gains[i] = along / sd[i]
            for a in range(size):
                for b in range(size):
                    covariance[a, b] -= along[a] * along[b] / variance
    return sd, gains


@compiled()
def _innovations(rows, readings, transitions, correlations, sd, gains):  # type: ignore[no-untyped-def]
    white, size = np.empty_like(rows), gains.shape[1]
    expected = np.zeros(size)
    for r in range(rows.shape[0]):
        expected[:] = 0.0
        for i in range(rows.shape[1]):
            if i > 0:
                first, second = expected[0], expected[1]
                expected[0] = transitions[i, 0, 0] * first + transitions[i, 0, 1] * second
                expected[1] = transitions[i, 1, 0] * first + transitions[i, 1, 1] * second
                for j in range(2, size):
                    expected[j] *= correlations[j - 2]
            missed = rows[r, i] - readings[i, 0] * expected[0] - readings[i, 1] * expected[1]
            for j in range(2, size):
                missed -= expected[j]
            white[r, i] = missed / sd[i]
            for j in range(size):
                expected[j] += gains[i, j] * white[r, i]
    return white


@compiled()
def _moved(forces, readings, increments, transitions):  # type: ignore[no-untyped-def]
    """What forces in the interval before every sample move the readings by, (n,)."""
    moved, first, second = np.zeros(forces.size), 0.0, 0.0
    for i in range(1, forces.size):
        a, b = first + increments[i, 0] * forces[i], second + increments[i, 1] * forces[i]
        first = transitions[i, 0, 0] * a + transitions[i, 0, 1] * b
        second = transitions[i, 1, 0] * a + transitions[i, 1, 1] * b
        moved[i] = readings[i, 0] * first + readings[i, 1] * second
    return moved
