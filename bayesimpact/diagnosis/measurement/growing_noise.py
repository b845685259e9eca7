"""Is what a model leaves noise that grows with the motion, and no force?

Where a period has few samples no short window tells such noise before a model is believed
(`noise.growth`), nor do accelerations, whose jumps would be taken for it. A model that leaves no
large misfit tells it of every reading: the variance of its residual is

    level^2 (1 + (a x)^2 + (b x')^2),

x the reading from where it settles and x' its rate, and the residual over its root is white. What a
force leaves grows with the motion as well, but follows it, and has its colour.

Of base models of drawn decays (300 readings, 12 to 50 a period) without such noise 0 of 147 showed
it, 107 of them without their cubic stiffness, dry friction or drag; with time stamps that jitter by
a tenth and a fifth of a step 6 and 15 of 20 did.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import chi2

from bayesimpact.data.faults.fault import gaussian_threshold
from bayesimpact.diagnosis.measurement.whiteness import combined, ljung_box
from bayesimpact.diagnosis.thresholds import ALPHA
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise.growth import BESIDE, GROWS, JITTER, RANGE, SHARE
from bayesimpact.inference.noise.remainders import KEPT
from bayesimpact.inference.noise.sd import smoothed
from bayesimpact.inference.noise.whitening import Noise

Array = NDArray[np.float64]

STARTS = (0.1, 0.3, 0.5)  # of the range below the largest variance


@dataclass(frozen=True, eq=False)
class _Readings:
    """Squares of what a model leaves of all readings (n,), of their sizes and their rates."""

    left: Array
    size: Array
    rate: Array

    def variance(self, terms: Array) -> Array:
        """Over the level's, (n,), with terms (2,) of size and rate."""
        return np.asarray(1.0 + terms[0] * self.size + terms[1] * self.rate)

    def level(self, terms: Array) -> float:
        """Mean square in units of the growth; a few readings that are off count up to a limit."""
        left = self.left / self.variance(terms)
        limit = np.median(left) / chi2.median(1) * chi2.ppf(KEPT, 1)
        return float(np.mean(np.minimum(left, limit)))

    def without_outliers(self, terms: Array) -> _Readings:
        """Those that noise of this growth explains: spikes tell nothing of it."""
        left = self.left / self.variance(terms)
        kept = left < gaussian_threshold(left.size) ** 2 * self.level(terms)
        return _Readings(self.left[kept], self.size[kept], self.rate[kept])

    def gained(self, terms: Array) -> float:
        """Log likelihood of Gaussian noise of this growth over that of none, nats."""
        variance = self.variance(terms)
        even, grown = np.mean(self.left), np.mean(self.left / variance)
        return float(0.5 * (self.left.size * np.log(even / grown) - np.sum(np.log(variance))))

    def log_likelihood(self, terms: Array) -> float:
        """At the best level, up to a constant, nats."""
        total = np.sum(np.log(self.variance(terms))) + self.left.size * np.log(self.level(terms))
        return float(-0.5 * total)


def growing_noise(fit: Fit) -> Noise | None:
    """The white noise that grows with the motion which is all that a fit leaves, where readings are
    decisively likelier under it than under noise alike everywhere; None where they are not, where
    the noise is stated, or known to be of another kind.
    """
    noise, campaign = fit.density.likelihood.noise, fit.density.oscillator.campaign
    other = noise.is_coloured or noise.grows or noise.forces is not None
    if other or noise.smoothing is not None or not noise.level_error or campaign.mixed:
        return None
    readings = _readings(fit)
    if not np.all(np.isfinite(readings.left)) or readings.level(np.zeros(2)) <= 0.0:
        return None
    interval = min(r.interval for r in campaign.recordings)
    largest = np.array([SHARE, JITTER * interval]) ** 2 / readings.level(np.zeros(2))
    terms = _grown(readings, largest)
    gained = readings.without_outliers(terms).gained(terms)
    if gained < GROWS or combined([ljung_box(x) for x in _standardised(fit, terms)]) < ALPHA:
        return None
    level = float(np.sqrt(readings.level(terms))) / noise.scales[campaign.recordings[0].order]
    error = float(np.sqrt(0.5 / readings.left.size))
    size, rate = (float(root) for root in np.sqrt(terms))
    told = replace(noise, level=level, level_error=error, growth=(size, rate), is_bound=False)
    return replace(told, source="residual of the model", is_independent=False)


def _readings(fit: Fit) -> _Readings:
    parts = []
    rows = zip(fit.density.oscillator.campaign.recordings, fit.residuals, strict=True)
    for recording, residual in rows:
        used = slice(None) if recording.used is None else recording.used
        size, rate = smoothed(recording)
        parts.append(np.array([residual[used], size[used], rate[used]]) ** 2)
    return _Readings(*np.concatenate(parts, axis=1))


def _standardised(fit: Fit, terms: Array) -> list[Array]:
    """What a fit leaves of every recording over the growth of its noise."""
    found = []
    rows = zip(fit.density.oscillator.campaign.recordings, fit.residuals, strict=True)
    for recording, residual in rows:
        used = slice(None) if recording.used is None else recording.used
        size, rate = smoothed(recording)
        sd = np.sqrt(1.0 + terms[0] * size**2 + terms[1] * rate**2)
        found.append(np.asarray((residual / sd)[used]))
    return found


def _grown(readings: _Readings, largest: Array) -> Array:
    """The terms (2,) of the likeliest growth."""
    size, rate = (_fitted(readings, largest, np.zeros(2), [i]) for i in (0, 1))
    best = max(size, rate, key=lambda one: one[0])
    both = _fitted(readings, largest, best[1], [0, 1])
    if both[0] > best[0] + BESIDE:
        best = both
    return best[1]


def _fitted(
    readings: _Readings, largest: Array, known: Array, free: list[int]
) -> tuple[float, Array]:
    """The likeliest growth with the terms `free`: log likelihood, terms (2,)."""
    most = np.log(largest[free])

    def terms(logs: Array) -> Array:
        full = known.copy()
        full[free] = np.exp(logs)
        return full

    starts = [
        np.where(known[free] > 0, np.log(np.maximum(known[free], 1e-300)), most - share * RANGE)
        for share in STARTS
    ]
    ends = [
        minimize(
            lambda logs: -readings.log_likelihood(terms(logs)), np.clip(start, most - RANGE, most),
            method="Nelder-Mead", bounds=[(top - RANGE, top) for top in most],
        )
        for start in starts
    ]  # fmt: skip
    best = min(ends, key=lambda end: float(end.fun))
    return -float(best.fun), np.asarray(terms(best.x))
