"""What short polynomials leave of recordings: noise, where nothing else is rough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from bayesimpact.data.campaign import Smoothing
from bayesimpact.data.hum import Hum
from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.windows import Windows, centred, smooth_parts, windows
from bayesimpact.model.measurement import edge, smooth

Array = NDArray[np.float64]

WINDOWS_PER_PERIOD = (12.0, 9.0, 7.0, 5.5, 4.5, 3.6, 3.0)
DEGREE = 5
SMALLEST, LARGEST = 12, 64
KEPT = 0.999  # fraction of undisturbed windows that the outlier test keeps
LEAST_NUMBERS = 60  # remainders that the free side must give
LEAST_OFF = 24  # remainders off turning points, better than many across a jump: the level to 14 %


@dataclass(frozen=True)
class PolynomialRemainder:
    """What polynomials leave of one window length: (windows, freedom) numbers and their basis."""

    values: Array
    basis: Array


def remainder_of(
    recordings: Sequence[Recording],
    hums: Sequence[Hum | None],
    length: int,
    turns: bool,
    smoothing: Smoothing | None = None,
) -> PolynomialRemainder | None:
    """What polynomials leave of windows of `length` samples; None where there are too few.

    turns : also of windows across turning points, where dry friction would show
    smoothing : the filter that the recordings passed, and with them what an input makes of them
    """
    degree = DEGREE if length >= SMALLEST else DEGREE - 1
    basis = null_space(np.vander(np.linspace(-1, 1, length), degree + 1).T)
    side = any(r.case for r in recordings)

    def left(side: bool) -> Array:
        rows = [
            _without_shapes(_shapes(r, hum, smoothing), r, windows(length, parts), basis)
            for r, hum in zip(recordings, hums, strict=True)
            for parts in (
                smooth_parts(r, side=side, turns=turns, reach=edge(smoothing, r.interval)),
            )
        ]
        return np.concatenate(rows)

    values = left(side)
    if not turns:
        return PolynomialRemainder(values, basis) if values.size >= LEAST_OFF else None
    if side and values.size < LEAST_NUMBERS:  # hardly any free cycle: windows at the stop too
        values = left(False)
    return PolynomialRemainder(values, basis) if values.shape[0] >= 4 else None


def _shapes(recording: Recording, hum: Hum | None, smoothing: Smoothing | None) -> list[Array]:
    """Signals (n,) that no polynomial follows, known but for their sizes.

    A steady hum, whose amplitude and phase may drift by a line through the recording: an error of
    the frequency, to first order. The roughness of a reading under an input: for a displacement
    that of the input's double integral and, by the damping, of the triple one; for a derivative of
    it, that of as many integrals fewer.
    """
    if recording.input is not None:
        shown = recording.input.shown(1.0, recording.interval)
        u = recording.input.force(1.0, recording.interval)
        u = u - u.mean()
        once = np.concatenate([[0.0], np.cumsum(0.5 * (u[1:] + u[:-1]))])
        # exact for lines between samples
        twice = np.concatenate([[0.0], np.cumsum(once[:-1] + u[:-1] / 3 + u[1:] / 6)])
        integrals = [shown - shown.mean(), once, twice, np.cumsum(twice)]
        return [smooth(x, smoothing, recording.interval) for x in integrals[2 - recording.order :]]
    if hum is None:
        return []
    times = recording.times
    angle = 2 * np.pi * hum.frequency * times
    place = times / times[-1]
    return [f * p for f in (np.cos(angle), np.sin(angle)) for p in (np.ones(place.size), place)]


def _without_shapes(
    shapes: Sequence[Array], recording: Recording, windows: Windows, basis: Array
) -> Array:
    """What polynomials leave of windows (count, length) of a recording, less these shapes."""
    values = centred(recording.samples)[windows] @ basis
    if not shapes or values.size < 8 * len(shapes):
        return np.asarray(values)
    columns = np.stack([(shape[windows] @ basis).ravel() for shape in shapes], axis=1)
    columns /= np.maximum(np.sqrt(np.sum(columns**2, axis=0)), 1e-300)
    found = np.linalg.lstsq(columns, values.ravel(), rcond=None)[0]
    return np.asarray(values - (columns @ found).reshape(values.shape))
