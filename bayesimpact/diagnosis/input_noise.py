"""The noise of a measured input, which moves the model and not the mass.

An input's readings hold noise of their own, and the model's response to that is part of what it
leaves. A white error e of every reading is a force of time (`discrepancy`) of power e^2 dt per
hertz; so strong are independent values at knots h apart of variance e^2 dt / h. Its size is what
the remainder of a fit asks for, but no more than the floor of the input's own spectrum: a missing
law of the motion, which may ask for more, is no noise of the input's.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.discrepancy import Discrepancy, discrepancy, force_responses, free_period
from bayesimpact.diagnosis.naming import is_large
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.noise import Noise
from bayesimpact.inference.noise_driven import BANDS, MEDIAN, SILENT, TOP, powers
from bayesimpact.inference.noise_forces import SMALL, RandomForces
from bayesimpact.inference.refitted import refitted

Array = NDArray[np.float64]

QUIETEST = 0.1  # of an input's bands: the loudest one of these is its floor
# ... but for what the median of a band of m ordinates errs by, 1 / (ln 2 m^(1/2)) of itself: the
# quietest tenth of equal ones lies 1.28 of that too low
ERROR = 1.28 / np.log(2.0)
FEWEST = 4.0  # knots in a period that tell a force at the oscillator's own frequency


def with_input_noise(before: Identification) -> Identification:
    """The same with the noise of the measured inputs, if they have any that matters."""
    noise = None if is_large(before.fit) else input_noise(before.fit)
    if noise is None:
        return before
    return replace(before, fit=refitted(before.fit, noise=noise), noise=noise)


def input_noise(fit: Fit) -> Noise | None:
    """The noise with that of the measured inputs, as a fit without a large misfit tells it; None
    where it does not matter, cannot be told from the input, or is known already.

    Beside readings of growing or filtered noise, or a base's displacement, whose second derivative
    is the force, it is not looked for.
    """
    noise, campaign = fit.target.likelihood.noise, fit.target.oscillator.campaign
    floors = {r.name: _floor(r) for r in campaign.recordings}
    known = noise.forces is not None or noise.grows or noise.smoothing is not None
    if known or not any(floors.values()):
        return None
    force = discrepancy(fit)
    if force is None or force.gain(fit, fit.log_posterior) < DECISIVE or not _tells(fit, force):
        return None
    responses, raw, shares = {}, {}, []
    for r, part, motion in zip(campaign.recordings, force.parts, force.motions, strict=True):
        floor = _force(fit, r) * floors[r.name]
        between = float(motion.t[-1]) / (part.squares.size - 1)
        k = min(force.k, floor**2 * r.interval / between)
        if r.input is not None and k * float(part.squares.max()) > SMALL:
            responses[r.name] = np.sqrt(k) * part.responses
            rows = force_responses(fit, motion, free_period(fit)).T
            raw[r.name] = np.sqrt(k) / noise.level * rows
            error = float(np.sqrt(k * between / r.interval)) / _force(fit, r)
            shares.append(error / float(np.sqrt(np.mean(r.input.samples**2))))
    if not responses:
        return None
    forces = RandomForces(MappingProxyType(responses), MappingProxyType(raw), max(shares))
    return replace(noise, forces=forces)


def _tells(fit: Fit, force: Discrepancy) -> bool:
    """Whether the force's knots are dense enough in every recording."""
    return all(
        (part.squares.size - 1) * free_period(fit) >= FEWEST * float(motion.t[-1])
        for part, motion in zip(force.parts, force.motions, strict=True)
    )


def _floor(recording: Recording) -> float:
    """Standard deviation of white noise as loud as an input's quietest bands, in its own unit; 0
    where these are not far below its loudest, or there is no input of a force.
    """
    if recording.input is None or recording.input.kind == "base_m":
        return 0.0
    driving = powers(recording.input.samples)
    width = next((w for w in BANDS if driving.size // w >= 1 / QUIETEST), None)
    if width is None:
        return 0.0
    count = int(TOP * driving.size) // width
    bands = np.median(driving[: count * width].reshape(count, width), axis=1) / MEDIAN
    floor = float(np.quantile(bands, QUIETEST)) / (1.0 - ERROR / width**0.5)
    loudest = float(driving.max())
    return float(np.sqrt(floor)) if floor < SILENT * loudest else 0.0


def _force(fit: Fit, recording: Recording) -> float:
    """Size of the force, N, of an input of 1."""
    given = recording.input
    if given is None:
        return 0.0
    gain = abs(fit.value("input_gain")) if given.free else 1.0
    return gain * (fit.target.oscillator.campaign.mass if given.kind == "base_m_s2" else 1.0)
