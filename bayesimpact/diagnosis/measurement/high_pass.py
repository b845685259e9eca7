"""A high-pass that the recordings came through, told before anything else is asked of them.

What a filter had settled on before a mass was let go is as large as the motion, and dies away in
the readings beneath it: a base model that knows nothing of it fits no motion at all, and what
follows from that fit (comparisons of recordings, scores, forces along the motion) means nothing.
But with a corner that is known the base model's own start values and fit serve as ever. So corners
are tried one by one, as if campaign.toml declared them, and the best of them is where a fit of the
effect begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.find import set_aside
from bayesimpact.diagnosis.faults.compare import base_failed
from bayesimpact.diagnosis.faults.recording_faults import Corrected, identified
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.outcome import is_large
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.errors import InputError
from bayesimpact.inference.defaults import default_priors
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.identify import first_estimates, initial_theta
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects import sensor_high_pass
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.oscillator import build_oscillator

START = "recording_start"
ID = sensor_high_pass.EFFECT.id
CORNERS = np.geomspace(0.01, 1.0, 7)
"""Over the natural frequency: neighbours are so close that a fit from one finds what lies between;
below the first one a base model still fits the motion."""

PERIODS = 10.0
"""Natural periods over which corners are tried: what a filter had settled on is gone by then, or
was no more than a drift."""


def behind_high_pass(
    cleaned: Corrected,
    as_read: Campaign,
    effects: Sequence[Effect],
    *,
    rng: np.random.Generator,
    search: bool,
) -> tuple[Corrected, Fit | None]:
    """The base model's fit with a high-pass, None where nothing asks for one; and the campaign,
    where starts were cut that are none in what came into that filter, with these.
    """
    passed = through_high_pass(cleaned.identification.fit, effects)
    if passed is None or not any(f.id == START for f in cleaned.own):
        return cleaned, passed
    measurement = cleaned.identification.fit.density.oscillator.campaign.measurement
    stated = _stated(as_read, passed.value(f"{ID}.corner"))
    kept, own = set_aside(replace(stated, measurement=measurement))
    again = identified(_stated(kept, 0.0), rng=rng, search=search)
    whole = through_high_pass(again.fit, effects)
    if whole is None:
        return cleaned, passed
    return replace(cleaned, identification=again, own=own), whole


def through_high_pass(base: Fit, effects: Sequence[Effect]) -> Fit | None:
    """The base model's fit with a high-pass, where this leaves `EXCESS` times less of a large
    misfit: no large one, or where the base model failed; None elsewhere.
    """
    chosen = [e for e in effects if e.id == ID]
    campaign, scales = base.density.oscillator.campaign, campaign_scales(base)
    declared = campaign.declared or any(r.high_pass for r in campaign.recordings)
    if not (chosen and is_large(base)) or declared or not chosen[0].admissible(scales):
        return None
    short = campaign.truncated(PERIODS / scales.natural_frequency)
    known = [_known(base, short, f * scales.natural_frequency) for f in CORNERS]
    nearest = min((k for k in known if k), key=lambda k: k.reduced_chi2, default=None)
    if nearest is None or not nearest.reduced_chi2 < base.reduced_chi2:
        return None
    found = fit_from(base, chosen, _values(nearest), scales).fit
    far_less = EXCESS * found.reduced_chi2 < base.reduced_chi2
    return found if far_less and (base_failed(base) or not is_large(found)) else None


def _known(base: Fit, campaign: Campaign, corner: float) -> Fit | None:
    """The base model's mode for recordings that came through a known high-pass, Hz, from their own
    start values; None where these show no oscillation.
    """
    noise, stated = base.density.likelihood.noise, _stated(campaign, corner)
    try:
        estimates = first_estimates(stated)
    except InputError:
        return None
    oscillator = replace(build_oscillator(stated), smoothing=base.density.oscillator.smoothing)
    priors = default_priors(oscillator, estimates, noise)
    density = PosteriorDensity(Likelihood(oscillator, noise), priors)
    return find_mode(density, initial_theta(oscillator, estimates, noise))


def _stated(campaign: Campaign, corner: float) -> Campaign:
    """The campaign as if campaign.toml stated this corner, Hz, for all recordings."""
    passed = tuple(replace(r, high_pass=corner) for r in campaign.recordings)
    return replace(campaign, recordings=passed)


def _values(known: Fit) -> dict[str, float]:
    """Values of the effect's and all other parameters that say the same as a known corner's."""
    values = dict(zip(known.names, map(float, known.mode), strict=True))
    for recording in known.density.oscillator.campaign.recordings:
        state = values.pop(f"high_pass_state[{recording.name}]")
        values[f"offset[{recording.name}]"] -= state
        values[f"{ID}.rate[{recording.name}]"] = 2 * np.pi * recording.high_pass * state
        values[f"{ID}.corner"] = recording.high_pass
    return values
