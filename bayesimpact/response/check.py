"""The backbone as a posterior-predictive check: does the model move as the recording does?

The same extractor runs on the recording and on simulated recordings (noise included), so that its
bias is in both and cancels. The backbone discards the phase and most of the noise: it is no
likelihood, but it shows in which cycle and on which side a model goes wrong.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayesimpact.data.frozen import Picklable
from bayesimpact.data.short_repr import short_repr
from bayesimpact.errors import InputError
from bayesimpact.response.backbone import Backbone, Damping, backbone

Floats = NDArray[np.float64]

CURVES = tuple(
    f"{side} {quantity}"
    for quantity in ("frequency", "amplitude", "damping ratio")
    for side in ("upper", "lower")
)


@dataclass(frozen=True, eq=False)
class Band:
    """One curve of the recording against those of the simulations, (k,) arrays.

    Attributes
    ----------
    at : cycle number counted from 0
    recorded : the recording's curve
    low, median, high : 5 %, 50 % and 95 % quantiles of the simulations
    inside : fraction of the recorded points between `low` and `high`; NaN without points
    p_value : of the discrepancy, see `check_backbone`; NaN without points
    """

    at: Floats
    recorded: Floats
    low: Floats
    median: Floats
    high: Floats
    inside: float
    p_value: float

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class BackboneCheck(Picklable):
    """Bands for every curve, and the verdict over all of them.

    Attributes
    ----------
    bands : by the names in `CURVES`; frequencies in Hz, amplitudes in m, damping ratios of 1
    inside : fraction of all recorded points inside their 90 % band
    p_value : of the most unusual of the curves' discrepancies
    backbone : of the recording
    draws : number of simulated recordings that were used
    """

    bands: Mapping[str, Band]
    inside: float
    p_value: float
    backbone: Backbone
    draws: int

    __repr__ = short_repr


def check_backbone(
    samples: ArrayLike,
    draws: ArrayLike,
    interval: float,
    *,
    rest: float | None = None,
    noise: float | None = None,
    damping: Damping = "local",
) -> BackboneCheck:
    """Compare the backbone of a recording with those of simulated recordings.

    The discrepancy of a curve is the mean square of its deviations from the median curve, each in
    units of the scale (1.4826 x median absolute deviation) at its place; median and scale are
    taken over recording and simulations together. The p-value is the share of them with at least
    the recording's discrepancy. If the recording is one more draw from the same distribution, it is
    uniform exactly, whatever the extractor does; for draws from a posterior fitted to this very
    recording it leans to the large side a little (Gelman, Meng and Stern 1996).

    Parameters
    ----------
    samples : (n,) recording, m
    draws : (D, n) simulated recordings with noise and, where the chain has one, its filter; D >= 19
    interval : s
    rest, noise, damping : as for `backbone`; noise None takes the recording's for all

    Raises
    ------
    InputError : shapes that do not fit, too few draws
    """
    recording = np.asarray(samples, dtype=np.float64)
    simulated = np.asarray(draws, dtype=np.float64)
    if simulated.ndim != 2 or simulated.shape[1] != recording.size or simulated.shape[0] < 19:
        raise InputError("draws", f"shape {simulated.shape}", f"(19 or more, {recording.size})")

    def extract(signal: Floats, level: float | None) -> Backbone:
        return backbone(signal, interval, rest=rest, noise=level, damping=damping)

    own = extract(recording, noise)
    others = [extract(signal, own.noise) for signal in simulated]
    return compare(own, others)


def compare(recorded: Backbone, simulated: list[Backbone]) -> BackboneCheck:
    """The same from backbones that were extracted before; see `check_backbone`."""
    kept = np.ones(len(simulated), dtype=bool)
    counts = {side: _count(side, recorded, simulated, kept) for side in ("upper", "lower")}
    rows = [recorded, *(b for b, keep in zip(simulated, kept, strict=True) if keep)]
    bands, scores = {}, []
    for name in CURVES:
        side, quantity = name.split(" ", 1)
        table = np.array(
            [getattr(getattr(b, side), quantity.replace(" ", "_"))[: counts[side]] for b in rows]
        )
        usable = np.isfinite(table).all(axis=0)
        table, at = table[:, usable], np.flatnonzero(usable).astype(np.float64)
        score = _discrepancy(table)
        scores.append(score)
        bands[name] = _band(at, table, score)
    hits = np.concatenate([_inside(band) for band in bands.values()])
    return BackboneCheck(
        bands=MappingProxyType(bands),
        inside=float(hits.mean()) if hits.size else float("nan"),
        p_value=_p_value(_worst(np.array(scores))),
        backbone=recorded,
        draws=len(rows) - 1,
    )


def _count(
    side: str, recorded: Backbone, simulated: list[Backbone], kept: NDArray[np.bool_]
) -> int:
    """Cycles of one side that are compared; marks simulations that end too early."""
    sizes = np.array([getattr(b, side).times.size for b in simulated])
    count = min(int(getattr(recorded, side).times.size), int(np.quantile(sizes, 0.05)))
    kept &= sizes >= count
    return count


def _discrepancy(table: Floats) -> Floats:
    """Mean square standardised deviation of every row; NaN without columns."""
    if table.shape[1] == 0:
        return np.full(table.shape[0], np.nan)
    away = table - np.median(table, axis=0)
    scale = 1.4826 * np.median(np.abs(away), axis=0)
    safe = np.where(scale > 0, scale, np.abs(away).max(axis=0))
    safe = np.where(safe > 0, safe, 1.0)
    return np.asarray(np.mean((away / safe) ** 2, axis=1))


def _worst(scores: Floats) -> Floats:
    """The most unusual of the curves' discrepancies (curves, rows), each on its own scale."""
    known = scores[np.isfinite(scores).all(axis=1)]
    if known.size == 0:
        return np.full(scores.shape[1], np.nan)
    logs = np.log(known + 1e-300)
    away = logs - np.median(logs, axis=1, keepdims=True)
    scale = np.median(np.abs(away), axis=1, keepdims=True)
    return np.asarray((away / np.where(scale > 0, scale, 1.0)).max(axis=0))


def _p_value(scores: Floats) -> float:
    """Share of all rows, the recording (row 0) included, that are at least as far off as it is."""
    if not np.isfinite(scores[0]):
        return float("nan")
    return float(np.mean(scores >= scores[0]))


def _band(at: Floats, table: Floats, score: Floats) -> Band:
    if table.shape[1] == 0:
        nothing = np.empty(0)
        return Band(at, nothing, nothing, nothing, nothing, float("nan"), float("nan"))
    low, median, high = np.quantile(table[1:], [0.05, 0.5, 0.95], axis=0, method="weibull")
    band = Band(at, table[0], low, median, high, 0.0, _p_value(score))
    hits = _inside(band)
    return Band(at, table[0], low, median, high, float(hits.mean()), band.p_value)


def _inside(band: Band) -> NDArray[np.bool_]:
    return (band.recorded >= band.low) & (band.recorded <= band.high)
