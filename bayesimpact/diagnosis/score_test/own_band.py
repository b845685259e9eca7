"""Is a harmonic force, or a hum, that a model holds one that the motion itself could pass for?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import hilbert

from bayesimpact.data.hum import find_hum
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.score_test.directions import is_periodic, is_steady
from bayesimpact.diagnosis.score_test.sidebands import is_sideband
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]

OWN_BAND = 0.1  # of the spectrum's peak
MULTIPLES = 5  # of the motion's frequency: quadratic to quintic laws
ALIKE = 0.87  # leaves a quarter of the power, as in `thresholds.EXCESS`
FINER = 8  # lines for one that the duration resolves
SLOWEST = 3.0  # periods in the longest recording: scans begin at five, refits may wander


def shakes_in_own_band(fit: Fit, remains: bool) -> bool:
    """True when the model has a harmonic force or a hum at a frequency of the motion itself.

    There a decaying motion and a steady one differ only by phase, and the steady one passes for any
    slow change of frequency or damping: over the whole band where something `remains`, and as far
    from its line as both decay. What a steady force makes the mass do is none of that. A mode that
    rings down there passes for a damping that changes with amplitude, whether anything remains or
    not; and so does a steady line where the recordings are too short to tell both frequencies
    apart: of a free motion and a steady one that beat nobody knows then which is which. At a
    multiple of the motion's frequency such a
    mode is what any law that is not linear makes of the motion, and so is a steady line where no
    recording decays enough to tell. A line too slow for any recording to show it come and go passes
    for a drift; and two that no recording tells apart, for one whose amplitude every recording sets
    anew, as what a motion makes does. Where something remains, a line whose mirror image about the
    motion's own is there too may be a sideband of it (`sidebands`).
    """
    recordings = fit.density.oscillator.campaign.recordings
    longest = max(r.duration for r in recordings)
    if any(frequency * longest < SLOWEST for _, frequency in _lines(fit)):
        return True
    if _is_one_line([f for e, f in _lines(fit) if is_steady(e)], longest):
        return True
    if remains and _has_sideband(fit):
        return True
    for effect, frequency in _lines(fit):
        steady = is_steady(effect)
        for recording in recordings:
            motion = recording if steady else _without(recording, effect, fit)
            decay = 0.0 if steady else fit.value(f"{effect.id}.decay")
            if remains and _moves_at(_unforced(motion, frequency, steady), frequency):
                return True
            if (remains or not steady) and _overlaps(motion, frequency, decay, steady=steady):
                return True
            if not remains and _is_unresolved(_unforced(motion, frequency, steady), frequency):
                return True
            if not steady and multiple_of(motion, frequency):
                return True
        if steady and all(_passes_for_harmonic(r, frequency) for r in recordings):
            return True
    return False


def _is_one_line(frequencies: list[float], longest: float) -> bool:
    """Whether two of some steady frequencies, Hz, differ by less than recordings of up to `longest`
    seconds resolve.
    """
    return bool(np.any(np.diff(np.sort(frequencies)) * longest < 1.0))


def _has_sideband(fit: Fit) -> bool:
    """Whether a line of a model has its mirror image in every recording that nothing drives."""
    frequencies = [f for _, f in _lines(fit)]
    pairs = zip(fit.density.oscillator.campaign.recordings, fit.residuals, strict=True)
    free = [(r, x) for r, x in pairs if r.input is None and r.samples.size == x.size]
    own = [_strongest(r) for r, _ in free] if frequencies else []
    return bool(own) and any(
        all(is_sideband(r, x, o, f, frequencies) for (r, x), o in zip(free, own, strict=True))
        for f in frequencies
    )


def _without(recording: Recording, effect: Effect, fit: Fit) -> Recording:
    """A recording without what an effect adds to its readings."""
    assert effect.observe is not None
    row = [
        fit.value(f"{effect.id}.{p.name}" + f"[{recording.name}]" * (p.scope == "recording"))
        for p in effect.parameters
    ]
    nothing = np.zeros((1, recording.samples.size))
    added = effect.observe(nothing, recording.times, np.array([row]))[0]
    return replace(recording, samples=recording.samples - added)


def _unforced(recording: Recording, frequency: float, steady: bool) -> Recording:
    """A recording without the sine of a steady frequency, Hz, that fits it best: the answer to a
    force that lasts. Of a motion that decays or slides through the frequency most is left.
    """
    if not steady:
        return recording
    angle = 2 * np.pi * frequency * recording.times
    columns = np.stack([np.ones(angle.size), np.cos(angle), np.sin(angle)], axis=1)
    found = np.linalg.lstsq(columns, recording.samples, rcond=None)[0]
    return replace(recording, samples=recording.samples - columns[:, 1:] @ found[1:])


def _lines(fit: Fit) -> list[tuple[Effect, float]]:
    """Periodic effects of a model and their frequencies, Hz."""
    effects = [e for e in fit.density.oscillator.acting if is_periodic(e)]
    return [(e, fit.value(f"{e.id}.frequency")) for e in effects]


def _spectrum(recording: Recording, finer: int = 1, *, window: bool = False) -> Array:
    """Amplitudes at multiples of the reciprocal of the duration, or `finer`, but for the mean;
    seen through a Hann window, or as recorded.

    Without a steady line beside the motion's band: that is no motion, unless something drives it.
    """
    samples = recording.samples
    hum = find_hum(samples, recording.interval) if recording.input is None else None
    if hum is not None:
        samples = samples - hum.readings(recording.times)
    samples = samples - samples.mean()
    if window:
        samples = samples * np.hanning(samples.size)
    return np.asarray(np.abs(np.fft.rfft(samples, finer * samples.size)))


def _strongest(recording: Recording) -> float:
    """Frequency of the strongest line, Hz."""
    duration = recording.samples.size * recording.interval
    return float(1.0 + int(np.argmax(_spectrum(recording, FINER)[FINER:])) / FINER) / duration


def _moves_at(recording: Recording, frequency: float) -> bool:
    """Whether a recording has a good part of its spectrum's peak at a frequency, Hz, or half a line
    that its duration resolves beside it.

    Seen through a Hann window: a motion that ends, or begins, at once has 1 / f of its peak
    everywhere (Harris 1978, Proc. IEEE 66:51), where nothing of it moves.
    """
    spectrum = _spectrum(recording, FINER, window=True)
    at = FINER * frequency * recording.samples.size * recording.interval
    near = spectrum[max(FINER, int(at) - FINER // 2) : int(at) + FINER // 2 + 2]
    return bool(near.size and near.max() > OWN_BAND * spectrum[FINER:].max())


def _overlaps(recording: Recording, frequency: float, decay: float, *, steady: bool) -> bool:
    """Whether a line at a frequency, Hz, that decays with a rate, 1/s, lies within both bandwidths,
    and that of the duration, from a recording's strongest line. How long that lasts is seen without
    what a steady force moves.
    """
    duration = recording.samples.size * recording.interval
    x = _unforced(recording, frequency, steady).samples
    own = _strongest(recording)
    energy = (x - x.mean()) ** 2
    # of exp(-a t), squared, the centroid is at 1 / (2 a); of what lasts throughout, in the middle
    lasts = 2.0 * float(recording.times @ energy / energy.sum())
    rates = decay + 1.0 / max(lasts, recording.interval)
    return bool(abs(frequency - own) < 1.0 / duration + rates / (2 * np.pi))


def _is_unresolved(recording: Recording, frequency: float) -> bool:
    """Whether a recording's strongest line lies closer to a frequency, Hz, than its duration can
    separate.
    """
    peak = 1 + int(np.argmax(_spectrum(recording)[1:]))
    return abs(frequency * recording.samples.size * recording.interval - peak) < 1.0


def multiple_of(recording: Recording, frequency: float) -> int:
    """Which multiple of that of the strongest line a frequency, Hz, is, 2 to `MULTIPLES`, as far as
    the duration can tell; else 0.
    """
    duration = recording.samples.size * recording.interval
    own = _strongest(recording)
    multiple = round(frequency / own)
    near = abs(frequency - multiple * own) * duration < 1.0
    return multiple if near and 2 <= multiple <= MULTIPLES else 0


def _passes_for_harmonic(recording: Recording, frequency: float) -> bool:
    """Whether a steady line is alike to what a power of the motion makes at a multiple of its
    frequency: the envelope to that power has a cosine of `ALIKE` with a steady one.
    """
    multiple = multiple_of(recording, frequency)
    if not multiple:
        return False
    envelope = np.abs(hilbert(recording.samples - recording.samples.mean())) ** multiple
    return bool(envelope.mean() > ALIKE * np.sqrt(np.mean(envelope**2)))
