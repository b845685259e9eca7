"""Noise that is slow as well as white, from all that a fit leaves.

Short windows show the white part and take the slow one for motion; above the motion (see
`noise.refined`) little of it is left. Here a fit's residual r, linear in a change x of the
parameters, is taken for noise of both kinds: r - J x ~ N(0, s^2 C), with C the covariance of white
and AR(1) noise, of one correlation time or, where that says much more, of two or three, as noise
that rises over decades of frequency (1/f) asks for; the parameters are integrated out. What physics
a fit may have left out is in the residual too: whether this noise explains it better is for the
caller to ask. That of an input, where it is known, stays beside both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import softmax

from bayesimpact.inference.fit import Fit, inverse
from bayesimpact.inference.likelihood import Likelihood, Linearisation
from bayesimpact.inference.noise.whitening import Noise

Array = NDArray[np.float64]
Index = NDArray[np.int64]

TIMES = 10.0  # in the longest recording, at least, that the slow part's correlation time fits
MOST = 1.0 - 1e-9  # of a correlation, whatever the recording
BAND = 0.05  # of a frequency: width of a band
STEP = 0.05  # of a standard deviation, for differences
STARTS: tuple[tuple[tuple[float, ...], ...], ...] = (
    ((0.9,), (0.99,), (0.5,)),
    ((0.6, 0.98),),
    ((0.5, 0.9, 0.99), (0.6, 0.98, 0.998)),
)
"""Correlations over the largest, beside white noise: of one process, of two, of three."""
PASSES = 2  # of random forces, given over a noise level that is only then known
ROUNDING = 1e-20  # of a parameter's information: rounding leaves its square, 1e-32, of what is none
TOLERANCE = 0.01  # nats, of the likelihood at its best


@dataclass(frozen=True, eq=False)
class SlowNoise:
    """What a fit's residual would be as noise that is white and slow.

    Attributes
    ----------
    noise : its shape, and level
    log_evidence_gain : log evidence over that of the fit with its own noise, nats
    residuals : per recording, whitened, the parameters at their best, (n,)
    """

    noise: Noise
    log_evidence_gain: float
    residuals: tuple[Array, ...] = field(repr=False)


def slow_noise(fit: Fit) -> SlowNoise | None:
    """The likeliest white and AR(1) noise of all that a fit leaves.

    None behind a filter, for recordings of several quantities, where the noise level is stated, and
    where the fitted motion runs away.
    """
    noise = fit.density.likelihood.noise
    found = _slow_noise(fit, noise)
    for _ in range(0 if noise.forces is None else PASSES):
        if found is None or noise.forces is None:
            return None
        as_large = noise.forces.in_other_units(noise.level / found.noise.level)
        found = _slow_noise(fit, replace(noise, forces=as_large))
    return found


def _slow_noise(fit: Fit, noise: Noise) -> SlowNoise | None:
    """The same beside random forces of so many noise levels."""
    likelihood = fit.density.likelihood
    known = not noise.level_error
    if noise.smoothing is not None or known or fit.density.oscillator.campaign.mixed:
        return None
    as_read = Likelihood(fit.density.oscillator, Noise(level=noise.level))
    linear = as_read.linearise(fit.mode, STEP * fit.sd)
    if not all(np.isfinite(x).all() for part in linear for x in (part.residual, part.jacobian)):
        return None
    recordings = fit.density.oscillator.campaign.recordings
    longest = max(r.duration / r.interval for r in recordings)
    most = min(float(np.exp(-TIMES / longest)), MOST)

    log_evidence = _Spectra(fit, linear).log_evidence
    if noise.forces is not None:  # what these move has no spectrum of its own

        def log_evidence(noise: Noise) -> float:
            return _Whole(fit, linear, noise).log_evidence

    def shape(place: Array) -> Noise:
        """From correlations and, of all AR(1) processes, the log of share over the white one."""
        count = place.size // 2
        white, *shares = softmax(np.append(0.0, place[count:]))
        parts = zip(most * np.tanh(place[:count]), shares, strict=True)
        (first, _), *others = ((float(rho), float(share)) for rho, share in parts)
        return replace(noise, correlation=first, others=((0.0, float(white)), *others))

    def likeliest(starts: Sequence[Array]) -> _Whole:
        def cost(place: Array) -> float:
            return -log_evidence(shape(place))

        rough = min(starts, key=cost)
        simplex = np.vstack([rough, rough + np.eye(rough.size)])
        options = {"fatol": TOLERANCE, "xatol": TOLERANCE, "initial_simplex": simplex}
        with np.errstate(invalid="ignore"):  # shapes of no noise cost infinity
            best = minimize(cost, rough, method="Nelder-Mead", options=options).x
        return _Whole(fit, linear, shape(best))

    first, *larger = (
        [np.append(np.arctanh(rho), np.zeros(len(rho))) for rho in starts] for starts in STARTS
    )
    found = likeliest(first)
    cost = float(np.log(likelihood.sizes.sum()))  # of two more parameters (Schwarz 1978)
    for starts in larger:
        more = likeliest(starts)
        if more.log_evidence <= found.log_evidence + cost:
            break
        found = more
    before = _Whole(fit, linear, likelihood.noise)
    level = noise.level * float(np.sqrt(found.variance))
    error = float(np.sqrt(0.5 / likelihood.sizes.sum()))
    told = replace(
        found.noise,
        level=level,
        level_error=error,
        source="residual of the model",
        is_independent=False,
    )
    return SlowNoise(told, found.log_evidence - before.log_evidence, found.residuals)


def _integrated(
    products: Array, free: Index, volume: float, total: int
) -> tuple[float, float, Array]:
    """Log evidence up to a constant, the noise's variance and the `free` parameters' step (k,).

    products : of whitened derivatives and, last, residual, (d + 1, d + 1)
    volume, total : log determinant of the whitening, and to how many numbers it leads
    """
    information, score = products[np.ix_(free, free)], products[free, -1]
    step = inverse(information) @ score
    variance = max(float(products[-1, -1] - score @ step) / total, 1e-300)
    _, log_determinant = np.linalg.slogdet(information / variance)
    value = volume - 0.5 * (total * np.log(variance) + float(log_determinant))
    return float(value) if np.isfinite(value) else -np.inf, variance, step


class _Spectra:
    """Products of all recordings' derivatives and residuals in narrow bands of frequency, in which
    the noise's spectrum is all but constant: its likelihood by Whittle's method, at once.

    Means are left out, and with them what changes nothing else, as an offset: what it tells of
    itself then is rounding, and so would be its part of the evidence.
    """

    def __init__(self, fit: Fit, linear: tuple[Linearisation, ...]) -> None:
        recordings = fit.density.oscillator.campaign.recordings
        noise, size = fit.density.likelihood.noise, fit.mode.size
        level = noise.level
        self.bands, whole, left = [], np.zeros(size), np.zeros(size)
        for part, recording in zip(linear, recordings, strict=True):
            rows = np.vstack([part.jacobian.T, part.residual]) / level
            if noise.grows:
                rows = rows / noise.relative_sd(recording)
            waves = np.fft.rfft(rows)[:, 1:] * np.sqrt(2.0 / rows.shape[1])
            number = np.arange(1, waves.shape[1] + 1)
            band = np.unique(np.round(np.log(number) / BAND).astype(int), return_index=True)[1]
            at = np.ix_(np.append(part.columns, size), np.append(part.columns, size))
            products = np.zeros((band.size, size + 1, size + 1))
            for i, some in enumerate(np.split(waves, band[1:], axis=1)):
                products[i][at] = (some @ some.conj().T).real
            whole[part.columns] += np.sum(rows[:-1] ** 2, axis=1)
            left[part.columns] += np.sum(np.abs(waves[:-1]) ** 2, axis=1)
            widths = np.diff(np.append(band, number.size))
            centres = np.exp(np.add.reduceat(np.log(number), band) / widths)
            frequencies = centres / (rows.shape[1] * recording.interval)
            self.bands.append((frequencies, recording.interval, widths, products))
        free = fit.density.oscillator.layout.roles("physical", "effect", "nuisance")
        self.free = free[left[free] > ROUNDING * whole[free]]

    def log_evidence(self, noise: Noise) -> float:
        """As `_Whole` has it, but for the ends of the recordings."""
        whole, volume, total = np.zeros(self.bands[0][-1].shape[1:]), 0.0, 0
        for frequencies, interval, widths, products in self.bands:
            power = noise.spectrum(frequencies, interval)
            whole += np.tensordot(1.0 / power, products, 1)
            volume += float(widths @ np.log(power))
            total += 2 * int(widths.sum())
        return _integrated(whole, self.free, -volume, total)[0]


class _Whole:
    """All recordings' residuals under one shape of the noise.

    Attributes
    ----------
    noise : that shape
    variance : of the noise over its estimate
    log_evidence : up to what no shape of the noise changes, nats
    residuals : per recording, (n,), of unit variance where the shape is right
    """

    def __init__(self, fit: Fit, linear: tuple[Linearisation, ...], noise: Noise) -> None:
        self.noise = noise
        recordings = fit.density.oscillator.campaign.recordings
        level, size = fit.density.likelihood.noise.level, fit.mode.size
        free = fit.density.oscillator.layout.roles("physical", "effect", "nuisance")
        products, volume, total, white = np.zeros((size + 1, size + 1)), 0.0, 0, []
        for part, recording in zip(linear, recordings, strict=True):
            rows = np.vstack([part.jacobian.T, part.residual]) / level
            white.append(noise.whitened(recording, rows))
            at = np.append(part.columns, size)
            products[np.ix_(at, at)] += white[-1] @ white[-1].T
            volume += noise.volume_of(recording)
            total += noise.size(recording.samples.size, recording.interval, recording.used)
        found = _integrated(products, free, volume, total)
        self.log_evidence, self.variance, step = found
        change = np.zeros(size)
        change[free] = step
        self.residuals = tuple(
            (rows[-1] - change[part.columns] @ rows[:-1]) / np.sqrt(self.variance)
            for rows, part in zip(white, linear, strict=True)
        )
