"""Default priors: wide, scaled by what the recordings show, the same for every model of a campaign.

| parameter | default prior |
|---|---|
| c1 | uniform, 0 to critical damping of the suspension |
| k1 | uniform, 0 to 100 times the initial estimate; less where that is an alias, 4 times at least |
| c2 | uniform, 0 to 20 times critical damping in contact |
| g, y0, offset | uniform, +- 20 times the largest displacement |
| v0 | uniform, +- 20 times the largest speed |
| k2 | uniform, 0 to 1000 times the larger of the initial estimates of k1 and k2 |
| sigma | log-uniform, eight decades about the estimate; log-normal, 10 %, about a stated noise |
| gain | normal, 1 with a standard deviation of 0.1 |
| input_gain | uniform, +- 100 times the initial estimate |
| added effects | half-Cauchy (Cauchy with both signs) of a physical scale |
| their shapes | log-normal, or log-uniform between two positive bounds or in their range |
| states in which recordings begin | normal about their null, of the largest that they can be |

Campaign.toml's [priors] replace any of them.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.inference.initial.estimates import Estimates
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.prior import (
    Cauchy,
    HalfCauchy,
    LogNormal,
    LogUniform,
    Normal,
    Prior,
    Uniform,
)
from bayesimpact.inference.priors import Priors, prior_from_table
from bayesimpact.model.effects.effect import EffectParameter, Scales
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import GAIN, HIGH_PASS_STATE, is_added

GAIN_WIDTH = 0.1  # a calibration that is farther off is a wrong unit, and a fault
SHAPE_WIDTH = 1.5  # of the log-normal prior of a depth, a time constant, a frequency


def default_priors(
    oscillator: Oscillator, estimates: Estimates, noise: Noise, scales: Scales | None = None
) -> Priors:
    """One prior per parameter in the order of the layout; added effects need `scales`."""
    campaign = oscillator.campaign
    return Priors(
        tuple(
            _stated(campaign, parameter.name)
            or _default(parameter.name, oscillator, estimates, noise, scales)
            for parameter in oscillator.layout.parameters
        )
    )


def _stated(campaign: Campaign, name: str) -> Prior | None:
    """The campaign's own prior: by the full name, or by the name without its case or recording."""
    for key in (name, name.split("[")[0]):
        if key in campaign.priors:
            return prior_from_table(key, dict(campaign.priors[key]))
    return None


def _default(
    name: str, oscillator: Oscillator, estimates: Estimates, noise: Noise, scales: Scales | None
) -> Prior:
    campaign = oscillator.campaign
    if is_added(name):
        assert scales is not None
        return effect_prior(_added(oscillator, name), scales)
    kind = name.split("[")[0]
    if kind == "sigma":
        if campaign.measurement.noise is not None:
            return LogNormal(campaign.measurement.noise, 0.1)
        return LogUniform(1e-4 * noise.level, 1e4 * noise.level)
    if kind == GAIN:
        return Normal(1.0, GAIN_WIDTH)
    if kind == HIGH_PASS_STATE:  # between the rest and where a mass was held
        own = {r.name: r.samples for r in campaign.recordings}[name[len(kind) + 1 : -1]]
        return Normal(0.0, float(np.ptp(own)))
    mass, k1 = campaign.mass, estimates.k1
    reach = 20 * max(r.motion(np.sqrt(k1 / mass)) for r in campaign.recordings)
    if kind == "offset":  # what is added to a reading is limited by the readings
        reach = 20 * max(float(np.ptp(r.samples)) for r in campaign.recordings)
    stiffest = max([k1, *estimates.k2.values()])
    fastest = mass * (np.pi / min(r.interval for r in campaign.recordings)) ** 2  # else an alias
    gain = 100 * abs(estimates.input_gain or 1.0)
    ranges = {
        "input_gain": (-gain, gain),
        "c1": (0.0, 2 * np.sqrt(k1 * mass)),
        "k1": (0.0, min(100 * k1, max(4 * k1, fastest))),
        "c2": (0.0, 40 * np.sqrt(stiffest * mass)),
        "k2": (0.0, 1000 * stiffest),
        "v0": (-reach * np.sqrt(stiffest / mass), reach * np.sqrt(stiffest / mass)),
    }
    return Uniform(*ranges.get(kind, (-reach, reach)))


def _added(oscillator: Oscillator, name: str) -> EffectParameter:
    effect_id, rest = name.split(".", 1)
    for effect in oscillator.acting:
        if effect.id == effect_id:
            return effect.parameter(rest.split("[")[0])
    raise KeyError(name)


def effect_prior(parameter: EffectParameter, scales: Scales) -> Prior:
    """Prior of an effect's parameter at its physical scale.

    Sizes have heavy tails, for on real rigs an effect may be many times what is usual. Values of
    one kind that replace a base parameter are normal about their common mean, states in which
    recordings begin about their null.
    """
    scale = parameter.scale(scales)
    if parameter.circular:
        return Uniform(-2 * np.pi, 4 * np.pi)
    if parameter.within is not None:
        return LogUniform(*parameter.within(scales))
    if parameter.is_shape and parameter.lower > 0.0 and parameter.upper < np.inf:
        return LogUniform(parameter.lower, parameter.upper)
    if parameter.is_shape:
        return LogNormal(scale, SHAPE_WIDTH)
    if parameter.lower == parameter.null == 0.0:
        return HalfCauchy(scale)
    if parameter.replaces or parameter.initial:
        return Normal(centre_of(parameter, scales), scale)
    return Cauchy(centre_of(parameter, scales), scale)


def centre_of(parameter: EffectParameter, scales: Scales) -> float:
    """Value about which a parameter is expected."""
    return parameter.null or 0.0 if parameter.centre is None else parameter.centre(scales)
