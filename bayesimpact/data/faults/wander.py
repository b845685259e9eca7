"""A zero that wanders: a slow curve beneath a velocity or an acceleration, which no motion makes.

Averaged over whole periods an acceleration, or a velocity, of an oscillation about a place is next
to none, whatever the spring: what remains would move the mass by its integral, ever farther the
slower it is. Where that is more than the motion itself, the curve is the measuring chain's: warmth,
a charge amplifier that settles, a tilt. It is taken off, and told.

A reading's own curvature (`sensor_quadratic`) and gravity on a swinging probe leave a mean as well,
which follows the square of the amplitude; that part stays. So does a straight line (`sensor_drift`)
where nothing more is there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.signal import fftconvolve

from bayesimpact.data.faults.fault import Array, Fault, amount, file_time
from bayesimpact.data.period import crossing_period, noise_level
from bayesimpact.data.recording import Recording

PERIODS = 4  # that are averaged at once: a Hann window of whole periods passes nothing of them
WINDOWS = 3  # for every coefficient of the curve, at least; windows overlap by half
MOST = 12  # order of the curve: three periods of a wander
LINE = 1  # order that `sensor_drift` has
PASSED = 0.01  # of an amplitude, by a window: of one that decays to 0.4 in a period
DECISIVE = 10.0  # of the Bayesian information criterion (Kass and Raftery 1995, their table)
GAIN = 2.0 * DECISIVE  # over a line
LEAST = 0.02  # of the readings' range: jumps of a tenth of it alias to half of this at 20 a period
STANDS_OUT = 2.0  # rms over that of what else windows pass: a lower mode, readings that alias
TURNS = 3  # each with the period of what is left


def without_wander(recording: Recording) -> tuple[Recording, Fault | None]:
    """A free motion's recording less such a curve, and the notice of it; as it is, and None, where
    it has none that stands out.

    Readings next to an obstacle, under an input, or of a displacement stay: there a mean that
    changes may be the motion's. So do those behind a stated high-pass, whose settling is known.
    """
    told = recording.input is not None or recording.high_pass > 0.0
    if recording.case or told or recording.order == 0:
        return recording, None
    left, curve, period = recording.samples, np.zeros(recording.samples.size), 0.0
    for _ in range(TURNS):  # of a large wander the first period is its own
        period = crossing_period(left, 1.0) or 0.0
        found = _curve(recording, period, noise_level(left)) if period else None
        if found is None:
            return recording, None
        settled = np.ptp(found - curve) <= 0.01 * np.ptp(found)
        curve, left = found, recording.samples - found
        if settled:
            break
    size = float(np.ptp(curve))
    if size < LEAST * np.ptp(left) or not _is_too_far(curve, left, period, recording.order):
        return recording, None
    return replace(recording, samples=left), _notice(recording, size, noise_level(left))


def _curve(recording: Recording, period: float, noise: float) -> Array | None:
    """The curve of a recording, without its mean, (n,); None for one that is a line, or none."""
    x, n = recording.samples, recording.samples.size
    used = np.ones(n) if recording.used is None else recording.used.astype(np.float64)
    length = 2 * max(round(0.5 * PERIODS * period), 2)
    window = np.hanning(length + 1)
    step = max(int(period / 8), 1)  # what a window passes would else be taken for a slow curve
    weight, first, second = (
        fftconvolve(used * values, window, "valid")[::step] for values in (1.0, x, x**2)
    )
    whole = weight > 0.5 * window.sum()
    count = float(whole.sum()) * step / (0.5 * length)  # that do not overlap by more than half
    if count < WINDOWS * (LINE + 3):
        return None
    mean = first[whole] / weight[whole]
    square = np.maximum(second[whole] / weight[whole] - mean**2, 0.0)
    known = noise**2 * float(window @ window) / window.sum() ** 2 + 2.0 * (PASSED**2) * square
    root = np.sqrt(1.0 / np.maximum(known / known.max(), 1e-12))
    centre = (0.5 * length + step * np.flatnonzero(whole)) / (0.5 * (n - 1)) - 1.0
    terms = np.polynomial.legendre.legvander(centre, min(MOST, int(count / WINDOWS) - 2))
    alike = (square / max(float(square.max()), 1e-300))[:, None]

    def fitted(order: int, own: int) -> tuple[float, Array]:
        """Criterion and curve at the windows, with `own` terms that follow the motion."""
        design = np.hstack([alike[:, :own], terms[:, : order + 1]])
        values = np.linalg.lstsq(root[:, None] * design, root * mean, rcond=1e-9)[0]
        rest = float(np.mean((root * (mean - design @ values)) ** 2))
        cost = design.shape[1] * float(np.log(count))
        return count * float(np.log(max(rest, 1e-300))) + cost, design @ values

    def best(orders: Iterable[int], own: int) -> tuple[float, Array]:
        return min((fitted(order, own) for order in orders), key=lambda found: found[0])

    without = min(fitted(LINE, own)[0] for own in (0, 1))
    orders = range(LINE + 1, terms.shape[1])
    alone, beside = best(orders, 0), best(orders, 1)
    follows = beside[0] < alone[0] - DECISIVE
    criterion, whole_curve = beside if follows else alone
    part = np.hstack([alike[:, :follows], terms[:, :1]])  # of it that may be the motion's
    curve = whole_curve - part @ np.linalg.lstsq(part, whole_curve, rcond=1e-9)[0]
    if criterion > without - GAIN or np.std(curve) < STANDS_OUT * np.std(mean - whole_curve):
        return None
    shape = np.polynomial.Legendre.fit(centre, curve, terms.shape[1] - 1, domain=[-1, 1])
    # beyond the middle of the outermost windows it goes on straight
    along, ends = np.linspace(-1.0, 1.0, n), centre[[0, -1]]
    slopes = shape.deriv()(ends)
    found = shape(np.clip(along, *ends)) + slopes[0] * np.minimum(along - ends[0], 0.0)
    return np.asarray(found + slopes[1] * np.maximum(along - ends[1], 0.0))


def _is_too_far(curve: Array, left: Array, period: float, order: int) -> bool:
    """Whether a curve, as a motion, would go farther than all of the motion that is left."""
    speed = float(np.std(np.gradient(curve)) / np.std(curve))  # its own frequency, per sample
    ratio = 2 * np.pi / period / speed
    return float(np.ptp(curve)) * ratio**order > float(np.ptp(left))


def _notice(recording: Recording, size: float, noise: float) -> Fault:
    n = recording.samples.size
    return Fault(
        id="recording_wander",
        recording=recording.name,
        spans=((0, n),),
        start_s=recording.start,
        end_s=file_time(recording, n - 1),
        size=size,
        unit=recording.unit,
        statement=f"its zero wanders by {amount(size, recording.unit)}, slower than a motion could;"
        " the curve is taken off",
        remedy="",
        strength=size / noise if noise else float("inf"),
        threshold=1.0,
        action="notice",
    )
