"""The score test of a change point: a column of the linear model that acts from a sample on.

For every sample at once by sums over what follows (Rao 1948), against what the model's parameters
do to all recordings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.fit import Fit

Array = NDArray[np.float64]

BEFORE = 3.0  # free periods: what ends sooner is a start that is not free (`forced_start`)
AFTER = 1.0  # free periods, of which the model has something to say
FEWEST = 16  # samples of either at least, of a motion that is hardly sampled
LEAST_FREE = 1e-6  # of a whole column squared, that parameters leave of it: less is rounding


@dataclass(frozen=True, eq=False)
class ChangeScores:
    """Scores of a change at every sample of a recording.

    Attributes
    ----------
    slope : (n,) product of the change from each sample on with the residual
    size : (n,) square of what no parameter does of it; 0 where that is rounding
    first : the sample of the recording that the first one is of
    """

    slope: Array
    size: Array
    first: int

    @property
    def explained(self) -> Array:
        """What a change at every sample takes off the sum of squares, (n,)."""
        told = self.size > 0.0
        return np.where(told, self.slope**2 / np.where(told, self.size, 1.0), 0.0)


def change_scores(fit: Fit, r: int, column: Array, bases: list[Array]) -> ChangeScores:
    """Scores of a change of recording `r` by a `column` (n,) of its readings, at a mode whose
    `parameter_basis` is `bases`.
    """
    noise = fit.density.likelihood.noise
    recording = fit.density.oscillator.campaign.recordings[r]
    parts = zip(bases, fit.linearisation, strict=True)
    absorbed = np.sum([basis.T @ part.residual for basis, part in parts], axis=0)
    residual = fit.linearisation[r].residual - bases[r] @ absorbed
    white = np.vstack([residual, noise.whitened(recording, column), bases[r].T])
    count = recording.samples.size
    signals, start = noise.in_time(white, count, recording.interval, recording.used)
    residual, moved, basis = signals[0], signals[1], signals[2:].T
    shared, whole = _from_here_on(moved[:, None] * basis), _from_here_on(moved**2)
    size = whole - np.einsum("np,np->n", shared, shared)
    size[size <= LEAST_FREE * whole[0]] = 0.0
    return ChangeScores(_from_here_on(moved * residual), size, round(start / recording.interval))


def change_window(fit: Fit, r: int) -> tuple[int, int]:
    """First and last-plus-one sample of recording `r` at which a change is told from a start that
    is not free, and from what the last readings are.
    """
    campaign = fit.density.oscillator.campaign
    recording, stiffness = campaign.recordings[r], max(fit.value("k1"), 1e-300)
    period = 2 * np.pi * float(np.sqrt(campaign.mass / stiffness)) / recording.interval
    before, after = (max(FEWEST, round(periods * period)) for periods in (BEFORE, AFTER))
    if recording.samples.size < 2 * (before + after):
        return 0, 0
    return before, recording.samples.size - after


def parameter_basis(fit: Fit) -> list[Array]:
    """Orthonormal columns of what the parameters do to all recordings, rows (n_r, p) of each."""
    ends = np.cumsum([part.residual.size for part in fit.linearisation])
    whole = np.concatenate([part.whole(fit.mode.size) for part in fit.linearisation])
    size = np.linalg.norm(whole, axis=0)
    basis = np.linalg.qr(whole[:, size > 0.0] / size[size > 0.0])[0]
    return np.split(basis, ends[:-1])


def _from_here_on(x: Array) -> Array:
    """Sums along the first axis from every row to the last."""
    return np.cumsum(x[::-1], axis=0)[::-1]
