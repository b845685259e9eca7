"""One recording and what a fit makes of it, as reports hold it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import numpy as np

from bayesimpact.data.quantity import Quantity, unit_of
from bayesimpact.data.short_repr import short_repr
from bayesimpact.report.codec import Array as Array


@dataclass(frozen=True, eq=False)
class RecordingResult:
    """One recording and what the fit makes of it.

    Attributes
    ----------
    name, case : as in the campaign; case is "" without a stop
    interval, start : s
    samples, predicted : (n,) recorded, and read from the model at the mode; m (or rad)
    sigma : noise level of the fit, before any smoothing, m
    noise_rms : root mean square that the independently estimated noise has in the recording, m
    reduced_chi2 : whitened misfit against the noise level estimated from the recordings alone
    whiteness_p : p-value that the whitened residual is white
    excluded : first and last-plus-one sample of every span that is set aside
    quantity : what the probe reads
    displacement : (n,) of the model from the true rest, m; empty where the readings tell it
    scale : of its noise, over that of the first recording's quantity
    input : label of the measured input, "" for a free decay
    state : name of the recording that its y0 and v0 bear, where it is another channel of a motion
    """

    name: str
    case: str
    interval: float
    start: float
    samples: Array
    predicted: Array
    sigma: float
    noise_rms: float
    reduced_chi2: float
    whiteness_p: float
    excluded: tuple[tuple[int, int], ...] = ()
    quantity: str = "displacement"
    displacement: Array = field(default_factory=lambda: np.zeros(0))
    scale: float = 1.0
    input: str = ""
    state: str = ""

    __repr__ = short_repr

    def motion(self, predicted: Array, offset: float) -> Array:
        """Displacement (n,), m, of a model that reads `predicted` (n,), from the true rest.

        Where the readings do not tell it that of the model at the mode.
        """
        return self.displacement if self.displacement.size else predicted - offset

    @property
    def unit(self) -> str:
        """SI unit of the readings."""
        return unit_of(cast(Quantity, self.quantity))

    @property
    def times(self) -> Array:
        """Time since the first sample, (n,), s."""
        return np.arange(self.samples.size, dtype=np.float64) * self.interval

    @property
    def residual(self) -> Array:
        """Recorded minus predicted, (n,), m; 0 where samples are set aside."""
        residual = np.array(self.samples - self.predicted)
        for first, end in self.excluded:
            residual[first:end] = 0.0
        return residual

    @property
    def count(self) -> int:
        """Samples that count."""
        return self.samples.size - sum(end - first for first, end in self.excluded)

    @property
    def rms(self) -> float:
        """Root mean square of the residual, m."""
        return float(np.sqrt(np.sum(self.residual**2) / self.count))

    @property
    def share(self) -> float:
        """Root mean square of the residual over that of the signal about its mean."""
        return self.rms / float(np.std(self.samples))
