"""From a live diagnosis to the arrays of its figures; `figures` draws from these alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy import stats

from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.residual_force.gaussian_process import trajectory_points
from bayesimpact.diagnosis.score_test.directions import sigma_of
from bayesimpact.inference.fit import Fit
from bayesimpact.model.parameters import SLOTS
from bayesimpact.report.build import recording_results
from bayesimpact.report.diagnosis.force_arrays import force_arrays
from bayesimpact.report.diagnosis.formula_arrays import formula_arrays
from bayesimpact.report.results import Array

_BANDS = 36  # of frequency
_LEAST = 8  # Fourier coefficients in a band
_GAP = SLOTS.index("g")


def diagnosis_arrays(d: Diagnosis) -> dict[str, Array]:
    """Arrays by name; recordings and cases in the campaign's order.

    force_*, left_*, learned_*, gap : see `force_arrays`
    reference_*, formula_* : see `formula_arrays`
    gain : (R, bins) log likelihood gained per recording and stretch of time, nats
    impact_gain : (R, K) the same from each contact onset to the next, NaN after the last
    before_predicted : (N,) reading of the base model, recordings one after the other, m
    before_chi2 : (R,) reduced chi2 of the base model
    spectrum : (k, 5) frequency, Hz; power of the whitened residual over that of the noise before
        and after; ends of the 90 % band for white noise
    held_out_recordings, held_out_cases : (L, 2) log score before and after, nats
    before_mode, before_covariance : (d,), (d, d) of the base model, SI
    """
    arrays = {
        **force_arrays(d),
        **formula_arrays(d),
        "before_mode": d.before.mode,
        "before_covariance": d.before.covariance,
    }
    if d.verdict == "adequate":
        return arrays
    if d.location is not None and d.location.gain.shape[1] > 1:
        arrays["gain"] = d.location.gain
    arrays |= _impacts(d)
    arrays["before_predicted"] = np.concatenate(d.before.predicted)
    arrays["before_chi2"] = np.array([r.reduced_chi2 for r in recording_results(d.before)])
    arrays["spectrum"] = spectrum(d.before, d.after)
    for name, held in (("recordings", d.held_out), ("cases", d.held_out_cases)):
        if held is not None:
            arrays[f"held_out_{name}"] = np.stack([held.before, held.after], axis=1)
    return arrays


def _impacts(d: Diagnosis) -> dict[str, Array]:
    """Gain from contact onset to contact onset, where residuals have a time and there is a stop."""
    base, better = d.selection.base.candidate.fit, d.after
    oscillator = base.density.oscillator
    banded = base.density.likelihood.noise.smoothing is not None
    if banded or better is base or not oscillator.campaign.stop:
        return {}
    gaps = oscillator.layout.slots(base.mode)[:, _GAP]
    rows = []
    for r, (y, _) in enumerate(trajectory_points(base)):
        old, new = (f.linearisation[r].residual / sigma_of(base)[r] for f in (base, better))
        total = np.concatenate([[0.0], np.cumsum(0.5 * (old**2 - new**2))])
        onsets = np.flatnonzero((y[1:] >= gaps[r]) & (y[:-1] < gaps[r]))
        rows.append(np.diff(total[onsets]))
    if not max(row.size for row in rows):
        return {}
    table = np.full((len(rows), max(row.size for row in rows)), np.nan)
    for held, row in zip(table, rows, strict=True):
        held[: row.size] = row
    return {"impact_gain": table}


def spectrum(before: Fit, after: Fit) -> Array:
    """Power of the whitened residuals in bands of frequency, all recordings together, (k, 5)."""
    frequency, old = _power(before)
    other, new = _power(after)
    edges = np.geomspace(max(frequency.min(), other.min()), frequency.max(), _BANDS + 1)
    rows = []
    for low, high in pairwise(edges):
        inside, inside_new = ((f >= low) & (f <= high) for f in (frequency, other))
        count = int(inside.sum())
        if count < _LEAST or inside_new.sum() < _LEAST:
            continue
        ends = [stats.chi2.ppf(q, 2 * count) / (2 * count) for q in (0.05, 0.95)]
        rows.append([np.sqrt(low * high), old[inside].mean(), new[inside_new].mean(), *ends])
    return np.array(rows).reshape(-1, 5)


def _power(fit: Fit) -> tuple[Array, Array]:
    """Frequencies, Hz, and powers over that of the noise estimated from the recordings alone."""
    noise = fit.density.likelihood.noise
    frequencies, powers = [], []
    for part, recording in zip(
        fit.linearisation, fit.density.oscillator.campaign.recordings, strict=True
    ):
        white = part.residual / noise.level
        if noise.smoothing is None:
            power = np.abs(np.fft.rfft(white)[1:-1]) ** 2 / white.size
            frequency = np.arange(1, power.size + 1) / recording.duration
        else:
            n, interval = recording.samples.size, recording.interval
            frequency, power = noise.ordinates(white, n, interval, recording.used)
            power = 0.5 * power
        frequencies.append(frequency)
        powers.append(power)
    return np.concatenate(frequencies), np.concatenate(powers)
