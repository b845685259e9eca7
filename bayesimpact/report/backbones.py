"""Recorded backbones against those of posterior-predictive recordings, ready for the report."""

from __future__ import annotations

import numpy as np

from bayesimpact.diagnosis.measurement.whiteness import combined
from bayesimpact.inference.initial.observe import DRIFT
from bayesimpact.inference.posterior import Posterior
from bayesimpact.model.measurement import smooth
from bayesimpact.report.results import Array, BackboneCurve, BackboneSummary
from bayesimpact.response.check import BackboneCheck, check_backbone
from bayesimpact.response.displacement import displacement

TOTAL = 600
"""Simulated recordings of all recordings together, about."""
_FEWEST, _MOST = 25, 200  # simulated for each
_SAMPLES = 50_000_000  # simulated, of all recordings together
_PROBABILITY = 0.9  # of the bands of `response.check`


def backbone_summary(posterior: Posterior, rng: np.random.Generator) -> BackboneSummary | None:
    """Bands, fraction inside and p-value per case; None when no recording has a complete cycle.

    Recordings with a measured input are left out: what shows in them is not the free motion.
    Damping ratios are those of Eq. 5, as in Fig. 13 of Tian et al. The p-values of the recordings
    of a case are combined by Fisher's method.
    """
    oscillator = posterior.fit.density.oscillator
    free = [r for r, one in enumerate(oscillator.campaign.recordings) if one.input is None]
    if not free:
        return None
    recordings = [oscillator.campaign.recordings[r] for r in free]
    size = len(recordings)
    room = min(TOTAL // size, _SAMPLES // int(oscillator.counts.sum()))
    count = max(_FEWEST, min(_MOST, room))
    found = [_checked(posterior, r, simulated(posterior, r, count, rng)) for r in free]
    curves = [
        curve
        for recording, check in zip(recordings, found, strict=True)
        for side in ("upper", "lower")
        if (curve := branch_curve(recording.name, recording.case, check, side)).times.size
    ]
    cases = oscillator.campaign.cases
    groups = {case: [c for c, r in zip(found, recordings, strict=True) if r.case == case]
              for case in cases}  # fmt: skip
    if len(cases) != 1:
        groups["all"] = found
    known = {k: [c for c in v if np.isfinite(c.p_value)] for k, v in groups.items()}
    known = {k: v for k, v in known.items() if v}
    if not curves or not known:
        return None
    return BackboneSummary(
        curves=tuple(curves),
        probability=_PROBABILITY,
        labels=tuple(known),
        inside=np.array([fraction_inside(checks) for checks in known.values()]),
        p_values=np.array([combined([c.p_value for c in checks]) for checks in known.values()]),
        replicates=count,
    )


def _checked(posterior: Posterior, r: int, draws: Array) -> BackboneCheck:
    """Bands of one recording; of a velocity or an acceleration, and of all simulated ones alike,
    of the displacement behind it.
    """
    recording = posterior.fit.density.oscillator.campaign.recordings[r]
    interval, order = recording.interval, recording.order
    if order == 0:
        rest = float(np.median(posterior.column(f"offset[{recording.name}]")))
        return check_backbone(recording.samples, draws, interval, rest=rest, damping="reference")
    own = displacement(recording.samples, interval, order).samples
    moved = np.array([displacement(one, interval, order).samples for one in draws])
    noise = DRIFT * float(np.ptp(own))
    return check_backbone(own, moved, interval, rest=0.0, noise=noise, damping="reference")


def simulated(posterior: Posterior, r: int, count: int, rng: np.random.Generator) -> Array:
    """Recordings `r` of drawn parameters, (count, n), with noise of the level that the
    recordings show by themselves.

    The level in the draws would not do: where a model fits badly it has swallowed the misfit, and
    recordings so noisy are like anything.
    """
    likelihood = posterior.fit.density.likelihood
    noise, recording = likelihood.noise, likelihood.oscillator.campaign.recordings[r]
    motion = likelihood.oscillator.predict_recording(r, posterior.thinned(count, rng))
    raw = [noise.drawn(rng, recording, noise.level) for _ in motion]
    return np.asarray(motion + smooth(np.array(raw), noise.smoothing, recording.interval))


def fraction_inside(checks: list[BackboneCheck]) -> float:
    """Share of all recorded points of several recordings that lie inside their band."""
    bands = [band for check in checks for band in check.bands.values() if band.at.size]
    inside = sum(band.inside * band.at.size for band in bands)
    return float(inside / sum(band.at.size for band in bands))


def branch_curve(recording: str, case: str, check: BackboneCheck, side: str) -> BackboneCurve:
    """Frequency and damping of one side with their bands, where frequencies can be compared."""
    branch = getattr(check.backbone, side)
    frequency, damping = check.bands[f"{side} frequency"], check.bands[f"{side} damping ratio"]
    cycles = frequency.at.astype(int)
    ratio = np.full(cycles.size, np.nan)
    ratio_band = np.full((cycles.size, 3), np.nan)
    _, here, there = np.intersect1d(cycles, damping.at.astype(int), return_indices=True)
    ratio[here] = damping.recorded[there]
    ratio_band[here] = _stacked(damping.low, damping.median, damping.high)[there]
    return BackboneCurve(
        recording=recording,
        case=case,
        branch=side,
        times=branch.times[cycles],
        amplitude=branch.amplitude[cycles],
        frequency=frequency.recorded,
        damping_ratio=ratio,
        frequency_band=_stacked(frequency.low, frequency.median, frequency.high),
        damping_band=ratio_band,
    )


def _stacked(low: Array, median: Array, high: Array) -> Array:
    return np.stack([low, median, high], axis=1)
