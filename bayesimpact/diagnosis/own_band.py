"""Is a harmonic force that a model holds one that the motion itself could pass for?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.directions import is_periodic
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]

OWN_BAND = 0.1  # of the spectrum's peak


def shakes_in_own_band(fit: Fit, gross: bool) -> bool:
    """True when the model has a harmonic force at a frequency at which the motion swings anyway.

    There a decaying motion and a forced one differ only by phase, and the force passes for any slow
    change of frequency or damping: over the whole band where the misfit is `gross`, and always
    where the recordings are too short to tell both frequencies apart.
    """
    names = [f"{e.id}.frequency" for e in fit.target.oscillator.effects if _is_force(e)]
    found = [float(fit.mode[fit.names.index(name)]) for name in names]
    recordings = fit.target.oscillator.campaign.recordings
    swings = _swings if gross else _is_unresolved
    return any(swings(recording, frequency) for frequency in found for recording in recordings)


def _is_force(effect: Effect) -> bool:
    return is_periodic(effect) and effect.observe is None


def _spectrum(recording: Recording) -> Array:
    """Amplitudes at multiples of the reciprocal of the duration, but for the mean."""
    return np.abs(np.fft.rfft(recording.samples - recording.samples.mean()))


def _swings(recording: Recording, frequency: float) -> bool:
    """Whether a recording has a good part of its spectrum's peak at a frequency, Hz."""
    spectrum = _spectrum(recording)
    at = frequency * recording.samples.size * recording.interval
    near = spectrum[max(1, int(at) - 1) : int(at) + 3]
    return bool(near.size and near.max() > OWN_BAND * spectrum[1:].max())


def _is_unresolved(recording: Recording, frequency: float) -> bool:
    """Whether a recording's strongest line lies closer to a frequency, Hz, than its duration can
    separate."""
    peak = 1 + int(np.argmax(_spectrum(recording)[1:]))
    return abs(frequency * recording.samples.size * recording.interval - peak) < 1.0
