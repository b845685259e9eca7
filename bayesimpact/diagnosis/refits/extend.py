"""From a fit to the same campaign with one more effect: parameters move between layouts by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.defaults import effect_prior
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.prior import Normal, Prior
from bayesimpact.inference.priors import Priors
from bayesimpact.model.effects.effect import Effect, EffectParameter, Scales
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.model.parameters import Layout, is_added

Array = NDArray[np.float64]


SOFTEST = 0.01  # of k1: a base fit that found no obstacle at all still leaves a scale for one
# Physical scales: values of one kind are pulled to the base fit's by next to nothing, which means
# little where the misfit is large; their evidence has a prior of its own (`evidence`).
WIDEST = 100.0


def campaign_scales(fit: Fit) -> Scales:
    """Physical sizes of a campaign from the fit of its base model."""
    o = fit.density.oscillator
    slots = o.layout.slots(fit.mode)
    c1, k1, c2, gap, k2 = slots[:, :5].T
    readings = [r.samples - b for r, b in zip(o.campaign.recordings, slots[:, 10], strict=True)]
    moved = readings if o.reads_displacements else fit.displacements
    reach = np.array([np.max(np.abs(y)) for y in moved])
    depth = np.array([np.max(y) for y in moved]) - gap
    speed = reach * np.sqrt(k1 / o.campaign.mass)
    contacts = [int(np.sum((y[:-1] < g) & (y[1:] >= g))) for y, g in zip(moved, gap, strict=True)]
    indentation = float(max(depth.max(), 0.0)) if o.campaign.stop else 0.0
    return Scales(
        mass=o.campaign.mass,
        stiffness=float(k1.mean()),
        damping=float(c1.mean()),
        contact_stiffness=float(max(k2.mean(), SOFTEST * k1.mean())),
        contact_damping=float(c2.mean()),
        amplitude=float(reach.max()),
        speed=float(speed.max()),
        indentation=indentation,
        impact_speed=float(speed.max()) if indentation > 0 else 0.0,
        duration=max(r.duration for r in o.campaign.recordings),
        interval=float(o.intervals.min()),
        impacts=max(contacts),
        gap=float(gap.mean()) if o.campaign.stop else 0.0,
        cases=len(o.campaign.cases),
        recordings=len(o.campaign.recordings),
        angle=o.campaign.angular,
        reading=float(max(np.max(np.abs(x)) for x in readings)),
        mixed=o.campaign.mixed,
        driven=any(r.input is not None for r in o.campaign.recordings),
    )


def owner(effects: Sequence[Effect], name: str) -> tuple[Effect, EffectParameter]:
    """Effect and parameter that a name `<effect>.<parameter>[...]` belongs to."""
    effect_id, rest = name.split(".", 1)
    for effect in effects:
        if effect.id == effect_id:
            return effect, effect.parameter(rest.split("[")[0])
    raise KeyError(name)


def replaced_slot(effect: Effect, parameter: EffectParameter) -> str | None:
    """The base parameter that an effect's parameter replaces (c2 per case: "c2"), or None."""
    for slot, name in effect.binds.items():
        if name == parameter.name and slot in ("c1", "k1", "c2", "g"):
            return slot
    return None


def extend(fit: Fit, effects: Sequence[Effect], scales: Scales) -> PosteriorDensity:
    """Posterior of the fit's campaign with exactly these `effects`; shared priors are kept."""
    old = fit.density
    per_recording = old.oscillator.layout.roles("noise").size > 1
    oscillator = build_oscillator(
        old.oscillator.campaign,
        effects,
        smoothing=old.oscillator.smoothing,
        sigma_per_recording=per_recording,
    )
    known = {**old.replaced, **dict(zip(fit.names, old.priors.parameters, strict=True))}
    priors = [known.get(n) or _prior(fit, effects, n, scales) for n in oscillator.layout.names]
    names = set(oscillator.layout.names)
    replaced = {n: p for n, p in known.items() if n not in names and not is_added(n)}
    return PosteriorDensity(
        Likelihood(oscillator, old.likelihood.noise), Priors(tuple(priors)), replaced
    )


def _prior(fit: Fit, effects: Sequence[Effect], name: str, scales: Scales) -> Prior:
    effect, parameter = owner(effects, name)
    slot_name = replaced_slot(effect, parameter)
    if slot_name is not None:
        centre = base_value(fit, slot_name)
        return Normal(centre, WIDEST * parameter.scale(scales))
    return effect_prior(parameter, scales)


def base_value(fit: Fit, slot: str) -> float:
    """Value of a shared base parameter in a fit: itself, or the mean over what replaced it."""
    layout = fit.density.oscillator.layout
    column = ("c1", "k1", "c2", "g").index(slot)
    return float(layout.slots(fit.mode)[:, column].mean())


def transfer(
    fit: Fit, layout: Layout, effects: Sequence[Effect], scales: Scales, shapes: Mapping[str, float]
) -> Array:
    """The fit's mode in another layout; new effects at their null, shape parameters from `shapes`.

    `shapes` maps `<effect>.<parameter>` to a value; other shape parameters take their scale.
    """
    known = dict(zip(fit.names, fit.mode, strict=True))
    theta = np.empty(layout.size)
    for i, name in enumerate(layout.names):
        theta[i] = known[name] if name in known else _start(fit, effects, name, scales, shapes)
    return theta


def _start(
    fit: Fit, effects: Sequence[Effect], name: str, scales: Scales, shapes: Mapping[str, float]
) -> float:
    if not is_added(name):
        return base_value(fit, name)
    bare = name.split("[")[0]
    if name in shapes or bare in shapes:
        return shapes.get(name, shapes.get(bare, 0.0))
    effect, parameter = owner(effects, name)
    slot = replaced_slot(effect, parameter)
    if slot is not None:
        return base_value(fit, slot)
    if parameter.circular:
        return 0.0
    return parameter.scale(scales) if parameter.null is None else parameter.null


def at_null(density: PosteriorDensity, theta: Array) -> Array:
    """Parameters (d,) with the sizes of all effects at their null."""
    o = density.oscillator
    null = theta.copy()
    for i, name in enumerate(o.layout.names):
        if is_added(name):
            parameter = owner(o.acting, name)[1]
            if parameter.null is not None and not parameter.is_shape:
                null[i] = parameter.null
    return null


def difference_steps(fit: Fit, density: PosteriorDensity, sizes: Mapping[str, float]) -> Array:
    """Steps (d,) for differences: a twentieth of the known standard deviations or of `sizes`."""
    known = zip(fit.names, fit.sd, np.abs(fit.mode), strict=True)
    sd = {n: s if s > 0 else 1e-6 * max(m, 1e-6) for n, s, m in known}
    names = density.oscillator.layout.names
    return np.array([0.05 * sd[n] if n in sd else 0.05 * sizes[n] for n in names])
