"""A model's mode for other readings of its campaign, or under another noise."""

from __future__ import annotations

from dataclasses import replace

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.declared import ascended
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import Oscillator


def refitted(
    fit: Fit, campaign: Campaign | None = None, noise: Noise | None = None, start: Fit | None = None
) -> Fit:
    """The model's mode, from where the fit stands or another one to start from.

    Parameters
    ----------
    campaign : of the same recordings with other readings, or others set aside; None for the fit's
    noise : None for the fit's
    start : a fit of the same parameters
    """
    oscillator, likelihood = fit.density.oscillator, fit.density.likelihood
    if campaign is not None:
        old = oscillator
        oscillator = Oscillator(campaign, old.effects, old.layout, old.smoothing)
    likelihood = Likelihood(oscillator, noise or likelihood.noise)
    return ascended(replace(fit.density, likelihood=likelihood), start or fit)
