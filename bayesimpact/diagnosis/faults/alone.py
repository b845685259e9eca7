"""Every recording identified on its own: what a faulty one says cannot spoil the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.refits.extend import campaign_scales, replaced_slot
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.errors import BayesimpactError
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]

NAMES = ("c1", "k1", "c2", "g", "k2")
UNKNOWN = 3.0  # standard error of a logarithm from which on a parameter was not measured


@dataclass(frozen=True, eq=False)
class Alone:
    """One recording's own parameters, in logarithms.

    Attributes
    ----------
    recording : its name
    log : (p,) logarithms of c1, k1 and, with a stop, c2, g, k2
    covariance : (p, p) of these
    reduced_chi2 : of the fit to this recording alone
    amplitude : half of what its readings span, in their unit
    fit : itself
    """

    recording: str
    log: Array
    covariance: Array
    reduced_chi2: float
    amplitude: float
    fit: Fit | None = None


@dataclass(frozen=True, eq=False)
class SharedModel:
    """What recordings are fitted with before they are compared.

    Attributes
    ----------
    noise : as the campaign shows it
    effects : of the catalogue, beside the base model, that hold for all recordings alike
    values : parameter -> value, where fits with effects begin
    """

    noise: Noise
    effects: tuple[Effect, ...] = ()
    values: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def fitted(self, campaign: Campaign) -> Fit | None:
        """The mode for a campaign; None where it allows no fit."""
        rng = np.random.default_rng(0)
        effects = [e for e in self.effects if len(campaign.cases) > 1 or not _is_by_case(e)]
        try:
            fit = identify(campaign, rng=rng, noise=self.noise, search=False, known=self.values).fit
            scales = campaign_scales(fit)
            if not all(effect.admissible(scales) for effect in effects):
                return None  # a recording that misses the obstacle shows nothing of contacts
            if effects:
                fit = fit_from(fit, effects, self.values, scales).fit
        except (BayesimpactError, ValueError, np.linalg.LinAlgError):
            return None
        return fit if np.isfinite(fit.reduced_chi2) else None


def _is_by_case(effect: Effect) -> bool:
    """Whether an effect only gives every stop a base parameter of its own."""
    parameters = effect.parameters
    return bool(parameters) and all(
        p.scope == "case" and replaced_slot(effect, p) for p in parameters
    )


def has_own_size(effect: Effect) -> bool:
    """Whether every recording has a size of its own."""
    return any(p.scope == "recording" and not p.initial for p in effect.parameters)


def inverted(recording: Recording) -> Recording:
    """The recording with the other sign."""
    return replace(recording, samples=-recording.samples)


def own_fit(campaign: Campaign, recording: Recording, model: SharedModel) -> Fit | None:
    """The model fitted to one recording; None where it allows no fit."""
    return model.fitted(replace(campaign, recordings=(recording,)))


def fit_alone(campaign: Campaign, recording: Recording, model: SharedModel) -> Alone | None:
    """The parameters that one recording shows; None where it allows no fit.

    A gap that is not positive has no logarithm: it counts as not measured, and so does what a law
    of the contact has replaced.
    """
    fit = own_fit(campaign, recording, model)
    if fit is None:
        return None
    chi2 = fit.reduced_chi2
    names = NAMES if campaign.stop else NAMES[:2]
    own = [_name(n, recording.case) for n in names]
    replaced = {replaced_slot(e, p) for e in model.effects for p in e.parameters}
    there = np.flatnonzero([n in fit.names and n not in replaced for n in own])
    at = [fit.names.index(own[i]) for i in there]
    values, known = np.zeros(len(names)), np.eye(len(names))
    values[there] = fit.mode[at]
    known[np.ix_(there, there)] = fit.covariance[np.ix_(at, at)]  # at the noise level it left
    if not np.isfinite(known).all():
        return None
    positive = values > 0.0
    scale = np.where(positive, values, 1.0)
    covariance = known / np.outer(scale, scale)
    lost = ~positive | (np.diag(covariance) > UNKNOWN**2)
    covariance[lost, :] = 0.0
    covariance[:, lost] = 0.0
    covariance[lost, lost] = 1e6
    amplitude = float(np.ptp(recording.samples)) / 2
    return Alone(recording.name, np.log(scale), covariance, chi2, amplitude, fit)


def _name(name: str, case: str) -> str:
    return f"k2[{case}]" if name == "k2" else name
