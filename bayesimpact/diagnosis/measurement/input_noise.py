"""The noise of a measured input, which moves the model and not the mass.

An input's readings hold noise of their own, and the model's response to that is part of what it
leaves: independent random forces, one a sample, along the fitted motion (`noise.forces`). Their
size is what the remainder of a fit asks for, the parameters at their best, but no more than the
floor of the input's own spectrum: a missing law of the motion, which may ask for more, is no noise
of the input's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from scipy.optimize import minimize_scalar

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.selection.outcome import is_large
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.responses import motion_of
from bayesimpact.inference.fit import Fit, inverse
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.likelihood import Linearisation
from bayesimpact.inference.noise.driven import BANDS, MEDIAN, SILENT, TOP, powers
from bayesimpact.inference.noise.forces import RandomForces
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.refitted import refitted
from bayesimpact.model.linear_response.superposition import state_space

QUIETEST = 0.1  # of an input's bands: the loudest one of these is its floor
# ... but for what the median of a band of m ordinates errs by, 1 / (ln 2 m^(1/2)) of itself: the
# quietest tenth of equal ones lies 1.28 of that too low
ERROR = 1.28 / np.log(2.0)
MANY = 0.5  # of the bands: the loudest one of these is still the floor, beside a large misfit
# standard deviations of a band's median over the root of the number of bands: three of the
# difference of two quantiles, the median of all bands (1.25) and the quietest tenth (1.7)
CHANCE = 3.0 * (1.25**2 + 1.7**2) ** 0.5
SMALLEST = 1e-3  # of the floor: a size that is sought down to there
CLOSE = 0.02  # of ln size
STEP = 0.05  # of a standard deviation, other parameters as they are: for differences


def under_input_noise(fit: Fit) -> Fit | None:
    """A model's mode under the noise of its inputs, where that leaves no large misfit; None where
    it leaves one, or nothing is told of it.
    """
    noise = input_noise(fit)
    found = None if noise is None else refitted(fit, noise=noise)
    return None if found is None or is_large(found) else found


def with_input_noise(before: Identification) -> Identification:
    """The same with the noise of the measured inputs, if they have any that matters; not beside a
    large misfit: what that is comes first.
    """
    noise = None if is_large(before.fit) else input_noise(before.fit)
    if noise is None:
        return before
    return replace(before, fit=refitted(before.fit, noise=noise), noise=noise)


def input_noise(fit: Fit) -> Noise | None:
    """The noise with that of the measured inputs, as a fit tells it; None where it does not matter,
    cannot be told from the input, or is known already.

    Beside readings of growing or filtered noise, channels of one motion, which it moves together,
    or a base's displacement, whose second derivative is the force, it is not looked for. Beside a
    large misfit, which asks for all that a floor allows, half of an input's bands must be its
    floor: that of an input with content at all frequencies is no noise.
    """
    noise, campaign = fit.density.likelihood.noise, fit.density.oscillator.campaign
    share = MANY if is_large(fit) else QUIETEST
    floors = {r.name: _force(fit, r) * _floor(r, share) for r in campaign.recordings}
    floors = {name: floor for name, floor in floors.items() if floor > 0.0}
    known = noise.forces is not None or noise.grows or noise.smoothing is not None
    if known or not floors or any(r.motion_name for r in campaign.recordings):
        return None
    moves = all(np.isfinite(y).all() and np.ptp(y) for y in fit.displacements)
    if not (moves and fit.value("k1") > 0):
        return None
    try:
        whole, linear = _of_floors(fit, floors), _as_read(fit)
    except np.linalg.LinAlgError:
        return None  # a motion that no small force changes

    def minus(log_size: float) -> float:
        return -_log_likelihood(fit, linear, _scaled(noise, whole, float(np.exp(log_size))))

    bounds = float(np.log(SMALLEST)), 0.0
    best = minimize_scalar(minus, bounds=bounds, method="bounded", options={"xatol": CLOSE})
    if -float(best.fun) < _log_likelihood(fit, linear, noise) + DECISIVE:
        return None
    return _scaled(noise, whole, float(np.exp(best.x)))


def _of_floors(fit: Fit, floors: Mapping[str, float]) -> RandomForces:
    """Random forces as large as the inputs' floors, N."""
    noise, recordings = fit.density.likelihood.noise, fit.density.oscillator.campaign.recordings
    paths, sizes, shares = {}, {}, []
    for r, one in enumerate(recordings):
        if one.name in floors and one.input is not None:
            paths[one.name] = state_space(motion_of(fit, r))
            sizes[one.name] = floors[one.name] / (noise.level * noise.scales[one.order])
            measured = _force(fit, one) * float(np.sqrt(np.mean(one.input.samples**2)))
            shares.append(floors[one.name] / measured)
    return RandomForces(MappingProxyType(paths), MappingProxyType(sizes), max(shares))


def _scaled(noise: Noise, forces: RandomForces, by: float) -> Noise:
    """The noise with forces of another size."""
    return replace(noise, forces=replace(forces.in_other_units(by), share=by * forces.share))


def _as_read(fit: Fit) -> tuple[Linearisation, ...]:
    """The fit's residuals and derivatives, not whitened."""
    likelihood = fit.density.likelihood
    plain = replace(likelihood, noise=Noise(level=likelihood.noise.level))
    steps = STEP / np.sqrt(np.diag(inverse(fit.covariance)))
    return plain.linearise(fit.mode, steps, roughly=True)


def _log_likelihood(fit: Fit, linear: tuple[Linearisation, ...], noise: Noise) -> float:
    """Of what a fit leaves under a noise, its level and, to first order, all parameters at their
    best; up to a constant.
    """
    size, total, volume = fit.mode.size, 0.0, 0.0
    products = np.zeros((size + 1, size + 1))
    recordings = fit.density.oscillator.campaign.recordings
    for recording, lin in zip(recordings, linear, strict=True):
        at = np.append(lin.columns, size)
        white = noise.whitened(recording, np.column_stack([lin.jacobian, lin.residual]).T)
        products[np.ix_(at, at)] += white @ white.T / noise.level**2
        total += noise.size(recording.samples.size, recording.interval, recording.used)
        volume += noise.volume_of(recording)
    prior = np.array(fit.density.priors.information(fit.mode))
    prior[fit.density.oscillator.layout.roles("noise")] = 1.0
    score = products[:-1, -1]
    moved = float(score @ inverse(products[:-1, :-1] + np.diag(prior)) @ score)
    rest = max(float(products[-1, -1]) - moved, 1e-300)
    return volume - 0.5 * total * float(np.log(rest / total))


def _floor(recording: Recording, share: float = QUIETEST) -> float:
    """Standard deviation of white noise as loud as an input's quietest bands, in its own unit; 0
    where these are not far below its loudest, a `share` of its bands is louder than they are by
    more than chance, or there is no input of a force.
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
    most = floor * (1.0 + CHANCE / np.log(2.0) / (width * bands.size) ** 0.5)
    loudest = float(driving.max())
    is_floor = share <= QUIETEST or float(np.quantile(bands, share)) < most
    return float(np.sqrt(floor)) if is_floor and floor < SILENT * loudest else 0.0


def _force(fit: Fit, recording: Recording) -> float:
    """Size of the force, N, of an input of 1."""
    given = recording.input
    if given is None:
        return 0.0
    gain = abs(fit.value("input_gain")) if given.free else 1.0
    return gain * (fit.density.oscillator.campaign.mass if given.kind == "base_m_s2" else 1.0)
