"""Noise models as whitening operators: a residual becomes independent numbers of equal variance.

Whitening is linear, so residuals and derivatives pass through the same operator and every later
stage (least squares, likelihood, scores) sees white noise. Three kinds:

- white: nothing to do;
- AR(1), or a sum of such: exact in the time domain (see `noise.prediction`);
- band: the recordings were smoothed. What the filter suppressed carries rounding and model error,
  no information, and its covariance has no inverse; so only the Fourier coefficients below the
  filter's half-power frequency are used, each divided by what the filter left of the noise (Whittle
  1953).

Where recordings are of several quantities, `sigma` is the level of the first one's, and the others'
levels stand in fixed ratios to it (`scales`), by which whitening divides them.

Samples that are set aside drop out. In the time domain they whiten to 0, so that shapes stay, and
the correlation over the gap is exact. Behind a filter every stretch between gaps, less what the
filter carried into it, is transformed on its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Smoothing
from bayesimpact.data.gaps import runs
from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.forces import RandomForces
from bayesimpact.inference.noise.prediction import Parts, innovations, log_determinant
from bayesimpact.inference.noise.sd import relative_sd
from bayesimpact.model.measurement import edge, magnitude_response

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SPECTRA = 64  # kept: recordings of so many lengths, and stretches between gaps
SPARED = 256  # samples for each of which one may be left out at an end
LEAST_STRETCH = 16  # samples between two gaps: fewer say nothing of a filter's passband


@dataclass(frozen=True)
class Noise:
    """Shape of the noise; its level is the unknown `sigma` (or this estimate of it).

    Equal means the same whitening; how well the level is known has no say in it.

    Attributes
    ----------
    correlation : between neighbouring samples of the raw noise (AR(1)), 0 for white noise
    smoothing : filter that the noisy recordings passed, or None
    level : standard deviation of the raw noise as estimated from the recordings alone, m
    level_error : relative standard error of `level`
    correlation_error : standard error of `correlation`
    source : how it was estimated, in words
    is_bound : the level is known to be no more than this; it may be less
    scales : level of readings that are a displacement, a velocity, an acceleration (or angles'),
        over that of the campaign's first quantity
    growth : by which it is larger away from rest, and where the reading changes: 1/m and s/m, over
        `level`, see `noise.growth`
    others : correlations of further AR(1) processes, 0 for white noise, each with its share of the
        raw noise's variance; what is left of it is that of `correlation`
    is_independent : its level is not that of what a model leaves of the motion
    forces : random ones, whose responses the readings hold beside noise of their own, or None
    """

    correlation: float = 0.0
    smoothing: Smoothing | None = None
    level: float = field(default=float("nan"), compare=False)
    level_error: float = field(default=float("nan"), compare=False)
    correlation_error: float = field(default=float("nan"), compare=False)
    source: str = "assumed"
    is_bound: bool = field(default=False, compare=False)
    scales: tuple[float, float, float] = (1.0, 1.0, 1.0)
    growth: tuple[float, float] = (0.0, 0.0)
    others: Parts = ()
    is_independent: bool = field(default=True, compare=False)
    forces: RandomForces | None = None

    @property
    def is_white(self) -> bool:
        """True when whitening does nothing."""
        plain = self.smoothing is None and self.forces is None
        return plain and not self.is_coloured and not self.grows

    @property
    def grows(self) -> bool:
        """True when the noise is not alike everywhere."""
        return any(self.growth)

    @property
    def kind(self) -> str:
        """In words, for reports."""
        raw = _kind(self.correlation)
        if self.others:
            shares = [f"{100 * share:.0f} % {_kind(rho)}" for rho, share in self.parts]
            raw = "of its variance " + ", ".join(shares)
        size, rate = self.growth
        if size:
            raw += f", growing with the reading ({100 * size * self.level:.2g} % of it)"
        if rate:
            jitter = f"{1e3 * rate * self.level:.2g} ms"
            raw += f", growing with its rate (as where time stamps jitter by {jitter})"
        if self.forces is not None:
            raw += f", and that of the measured input ({100 * self.forces.share:.2g} % of it)"
        return raw if self.smoothing is None else f"{raw}, smoothed ({self.smoothing.kind})"

    @property
    def parts(self) -> Parts:
        """Of all processes, correlation and share of the variance; those of no share left out."""
        rest = 1.0 - sum(share for _, share in self.others)
        return tuple(p for p in ((self.correlation, rest), *self.others) if p[1] > 0.0)

    @property
    def is_coloured(self) -> bool:
        """True when the raw noise is not white."""
        return self.correlation != 0.0 or bool(self.others)

    def whitened(self, recording: Recording, x: Array) -> Array:
        """Whitened signals of a recording: (..., n) samples to (..., m) numbers."""
        if self.grows:
            x = x / self.relative_sd(recording)
        if self.forces is not None and recording.name in self.forces.paths:
            x = x / self.scales[recording.order]
            return self.forces.innovations(recording.name, x, self.parts, recording.used)
        return self.whiten(x, recording.interval, recording.used, recording.order)

    def relative_sd(self, recording: Recording) -> Array:
        """Standard deviation at every sample of a recording over `level`, (n,)."""
        return relative_sd(self.growth, recording)

    def whiten(self, x: Array, interval: float, used: Mask | None = None, order: int = 0) -> Array:
        """Whitened x: (..., n) samples to (..., m) numbers of variance sigma^2.

        `used` (n,) is False where samples are set aside. m is n, or size(n) behind a filter. The
        samples are the `order`-th time derivative of a displacement.
        """
        if self.scales[order] != 1.0:
            x = x / self.scales[order]
        if self.smoothing is not None:
            if used is None:
                return self._band(x, interval)
            parts = [
                self._band(x[..., s], interval, False) for s in self._stretches(used, interval)
            ]
            return np.concatenate([x[..., :0], *parts], axis=-1)
        if not self.is_coloured:
            return x if used is None else np.where(used, x, 0.0)
        return innovations(x, self.parts, used)

    def size(self, n: int, interval: float, used: Mask | None = None) -> int:
        """To how many independent numbers `n` samples amount."""
        if self.smoothing is None:
            return n if used is None else int(used.sum())
        if used is None:
            return 2 * (self._band_size(n, interval) - 1) + 1
        return sum(
            2 * self._spectrum(s.stop - s.start, interval, False).size - 1
            for s in self._stretches(used, interval)
        )

    def in_time(
        self, white: Array, n: int, interval: float, used: Mask | None = None
    ) -> tuple[Array, float]:
        """Whitened numbers (..., size(n)) as signals in time with the same products: (them, start).

        `start` is the time of their first sample after the recording's, s.
        """
        if self.smoothing is None:
            return white, 0.0
        if used is not None:
            return self._stretches_in_time(white, used, interval), 0.0
        inner = self._interior(n, interval)
        signal = _signal(white, inner.stop - inner.start, self._band_size(n, interval))
        return signal, inner.start * interval

    def ordinates(
        self, white: Array, n: int, interval: float, used: Mask | None = None
    ) -> tuple[Array, Array]:
        """Frequencies (m,), Hz, rising, and powers (m,) of whitened numbers behind a filter.

        Of every stretch between gaps; sums of two squares.
        """
        whole = [self._interior(n, interval)]
        frequencies, powers, begin = [], [], 0
        for s in whole if used is None else self._stretches(used, interval):
            length = s.stop - s.start
            m = int(self._spectrum(length, interval, False).size) - 1
            real, imaginary = np.split(white[begin + 1 : begin + 1 + 2 * m], 2)
            frequencies.append(np.arange(1, m + 1) / (length * interval))
            powers.append(real**2 + imaginary**2)
            begin += 2 * m + 1
        order = np.argsort(np.concatenate(frequencies), kind="stable")
        return np.concatenate(frequencies)[order], np.concatenate(powers)[order]

    def highest(self, n: int, interval: float) -> float:
        """Highest frequency that the whitened numbers of n samples know, Hz."""
        if self.smoothing is None:
            return 0.5 / interval
        inner = self._interior(n, interval)
        return float((self._band_size(n, interval) - 1) / ((inner.stop - inner.start) * interval))

    def log_volume(
        self, n: int, interval: float, used: Mask | None = None, order: int = 0
    ) -> float:
        """Log determinant of the whitening operator (0 for the band: there it is a constant)."""
        if self.smoothing is not None:
            return 0.0
        scaled = self.size(n, interval, used) * float(np.log(self.scales[order]))
        if not self.is_coloured:
            return -scaled
        return log_determinant(n, self.parts, used) - scaled

    def coloured(
        self, rng: np.random.Generator, n: int, interval: float, sigma: float, order: int = 0
    ) -> Array:
        """A draw of n samples of raw noise of level `sigma` (before any smoothing), m."""
        sigma = sigma * self.scales[order]
        drawn = [_process(rng, n, rho, sigma * share**0.5) for rho, share in self.parts]
        return np.asarray(np.sum(drawn, axis=0))

    def spectrum(self, frequency: Array, interval: float) -> Array:
        """Power of the raw noise at frequencies, Hz, over that of white noise of its level."""
        cosine = np.cos(2 * np.pi * frequency * interval)
        powers = [
            share * (1.0 - rho**2) / (1.0 - 2 * rho * cosine + rho**2) for rho, share in self.parts
        ]
        return np.asarray(np.sum(powers, axis=0))

    def drawn(self, rng: np.random.Generator, recording: Recording, sigma: float) -> Array:
        """A draw of a recording's raw noise of level `sigma` (before any smoothing), (n,), m."""
        size, order = recording.samples.size, recording.order
        drawn = self.coloured(rng, size, recording.interval, sigma, order)
        if self.forces is not None:
            moved = self.forces.drawn(rng, recording.name, size)
            drawn = drawn + sigma * self.scales[order] * moved
        return drawn * self.relative_sd(recording) if self.grows else drawn

    def volume_of(self, recording: Recording) -> float:
        """Log determinant of `whitened`."""
        size, used = recording.samples.size, recording.used
        if self.forces is not None and recording.name in self.forces.paths:
            scaled = self.size(size, recording.interval, used) * np.log(
                self.scales[recording.order]
            )
            name = recording.name
            return self.forces.log_determinant(name, size, self.parts, used) - float(scaled)
        found = self.log_volume(size, recording.interval, used, recording.order)
        if not self.grows:
            return found
        sd = self.relative_sd(recording)
        return found - float(np.sum(np.log(sd if used is None else sd[used])))

    def with_smoothing(self, smoothing: Smoothing | None) -> Noise:
        """The same raw noise behind another filter."""
        return replace(self, smoothing=smoothing)

    def _stretches(self, used: Mask, interval: float) -> list[slice]:
        """Between gaps: what no set-aside sample and no end reaches through the filter."""
        reach = edge(self.smoothing, interval)
        lags = self.smoothing is not None and self.smoothing.kind == "lag"
        found = []
        for first, end in runs(used):
            last = end if lags else end - reach
            if last - (first + reach) >= max(2 * reach, LEAST_STRETCH):
                found.append(_shortened(first + reach, last))
        return [s for s in found if self._spectrum(s.stop - s.start, interval, False).size > 1]

    def _stretches_in_time(self, white: Array, used: Mask, interval: float) -> Array:
        signals = np.zeros((*white.shape[:-1], used.size))
        begin = 0
        for s in self._stretches(used, interval):
            m = int(self._spectrum(s.stop - s.start, interval, False).size)
            part = white[..., begin : begin + 2 * m - 1]
            signals[..., s] = _signal(part, s.stop - s.start, m)
            begin += 2 * m - 1
        return signals

    def _interior(self, n: int, interval: float) -> slice:
        cut = min(edge(self.smoothing, interval), n // 4)
        lags = self.smoothing is not None and self.smoothing.kind == "lag"
        return _shortened(cut, n if lags else n - cut)  # a lag has no second end

    def _spectrum(self, n: int, interval: float, ends: bool = True) -> Array:
        inner = self._interior(n, interval) if ends else slice(0, n)
        raw = Noise(self.correlation, self.smoothing, others=self.others)
        return _passed(raw, inner.stop - inner.start, interval)

    def _band_size(self, n: int, interval: float) -> int:
        return int(self._spectrum(n, interval).size)

    def _band(self, x: Array, interval: float, ends: bool = True) -> Array:
        """Scaled Fourier coefficients; `ends`: the ends, where the filter differs, are cut off."""
        from scipy.fft import rfft

        n = x.shape[-1]
        spectrum = self._spectrum(n, interval, ends)
        inner = x[..., self._interior(n, interval)] if ends else x
        coefficients = rfft(inner, axis=-1)[..., : spectrum.size]
        coefficients = coefficients / np.sqrt(0.5 * inner.shape[-1] * spectrum)
        head = coefficients[..., :1].real / np.sqrt(2.0)
        return np.concatenate(
            [head, coefficients[..., 1:].real, coefficients[..., 1:].imag], axis=-1
        )


def _kind(correlation: float) -> str:
    return "white" if correlation == 0.0 else f"AR(1), correlation {correlation:.3g}"


def _process(rng: np.random.Generator, n: int, correlation: float, sigma: float) -> Array:
    """A stationary draw of an AR(1) process, (n,)."""
    white = rng.standard_normal(n) * sigma
    if correlation == 0.0:
        return white
    from scipy.signal import lfilter

    white[1:] *= np.sqrt(1.0 - correlation**2)
    return np.asarray(lfilter([1.0], [1.0, -correlation], white), dtype=np.float64)


def _shortened(first: int, end: int) -> slice:
    """The samples from `first` to `end`, without the few whose transform would cost the most."""
    return slice(first, first + _fast_length(end - first))


@lru_cache(maxsize=SPECTRA)
def _fast_length(count: int) -> int:
    """A length up to `count`, less than one in `SPARED` shorter, without large prime factors.

    A transform of 5,981 samples, a prime, takes ten times as long as one of 5,967.
    """
    return min(range(count, count - count // SPARED - 1, -1), key=_largest_prime)


def _largest_prime(number: int) -> int:
    """The largest prime factor."""
    factor, largest = 2, 1
    while number > 1:
        if factor * factor > number:
            return max(largest, number)
        if number % factor:
            factor += 1
        else:
            number, largest = number // factor, factor
    return largest


@lru_cache(maxsize=SPECTRA)
def _passed(noise: Noise, count: int, interval: float) -> Array:
    """Power of the noise in the band that the filter lets through, relative to white noise, (m,).

    Every residual and derivative of a fit asks for it anew.
    """
    frequency: Array = np.fft.rfftfreq(count, interval).astype(np.float64)
    filtered = magnitude_response(noise.smoothing, interval, frequency) ** 2
    beyond = np.flatnonzero(filtered < 0.5)
    frequency = frequency[: beyond[0]] if beyond.size else frequency[:-1]
    found: Array = np.asarray(filtered[: frequency.size] * noise.spectrum(frequency, interval))
    found.setflags(write=False)
    return found


def _signal(white: Array, count: int, m: int) -> Array:
    """`count` samples in time with the same products as whitened coefficients (..., 2 m - 1)."""
    from scipy.fft import irfft

    coefficients = np.zeros((*white.shape[:-1], count // 2 + 1), dtype=complex)
    coefficients[..., 0] = np.sqrt(2.0) * white[..., 0]
    coefficients[..., 1:m] = white[..., 1:m] + 1j * white[..., m:]
    return np.asarray(irfft(coefficients * np.sqrt(0.5 * count), count, axis=-1))
