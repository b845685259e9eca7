"""What the strong trials plant: the catalogue in sorts, of which one trial holds at most one each.

Effects of one sort look so alike in a decay that two of them at once are one effect in practice.
Sizes are a share of the size beyond which the effect is no longer physical (`EffectForm.largest`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayesimpact.model.effects import UNTRIED
from bayesimpact.trial.draw.designs import DrawnRig, Range, log_uniform
from bayesimpact.trial.draw.planted_effects import PLANTED_EFFECTS, EffectForm, PlantedEffect
from bayesimpact.trial.draw.planted_outside import OUTSIDE_EFFECTS

Rng = np.random.Generator

SORTS: Mapping[str, tuple[str, ...]] = {
    "drag": ("quadratic_drag", "power_damping"),
    "dry": ("coulomb_friction", "structural_damping", "presliding_friction", "hysteresis_bouc_wen"),
    "odd spring": ("pendulum_sine", "spring_cubic", "spring_quintic"),
    "even spring": ("spring_quadratic", "spring_piecewise", "opposite_stop"),
    "slow change": ("stiffness_drift", "contact_stiffness_drift"),
    "forcing": ("harmonic_forcing", "sensor_hum"),
    "probe": ("sensor_quadratic", "sensor_cubic"),
    "probe drift": ("sensor_drift",),
    "contact spring": ("contact_hardening", "contact_power_law", "contact_second_stage",
                       "hunt_crossley"),
    "contact loss": ("contact_damping_indentation", "contact_damping_speed",
                     "contact_damping_per_case", "contact_relaxation"),
    "end of contact": ("contact_no_tension", "obstacle_mass", "adhesion"),
    "gap": ("gap_wear", "gap_per_recording"),
}  # fmt: skip
"""Sort -> effects that stand in for one another."""

WEIGHTS: Mapping[str, float] = {
    "drag": 2.0, "dry": 2.0, "odd spring": 2.0, "contact spring": 2.0, "contact loss": 2.0,
    "forcing": 0.7, "probe": 0.5, "probe drift": 0.5,
}  # fmt: skip
"""How often a sort is drawn, against 1 for those not listed: losses and springs are common."""

SHARES: Mapping[str, Range] = {
    "coulomb_friction": (0.01, 0.15), "quadratic_drag": (0.02, 0.4), "gap_wear": (2e-3, 0.03),
    "harmonic_forcing": (0.02, 0.3), "sensor_quadratic": (0.02, 0.3), "sensor_cubic": (0.02, 0.3),
    "sensor_drift": (0.02, 0.5), "sensor_hum": (0.02, 0.5), "stiffness_drift": (0.03, 0.5),
    "friction_pad": (0.01, 0.2), "damping_bump": (0.02, 0.5), "eddy_brake": (0.02, 0.5),
    "damping_drift": (0.1, 1.0), "contact_bump": (0.05, 1.0),
}  # fmt: skip
SHARE: Range = (0.05, 0.7)
"""Sizes of an effect, as shares of the largest physical one; `SHARE` for those not listed."""

TIMED = ("stiffness_drift", "contact_stiffness_drift", "sensor_drift", "damping_drift", "knock")
"""Effects that count time from the first sample: none in a recording that begins at rest."""


def _pendulum(design: DrawnRig, rng: Rng) -> EffectForm:
    """A plain pendulum: all of the linear stiffness is gravity's."""
    k1 = design.rig.k1
    return EffectForm(lambda size: {"stiffness": size}, 1e-4 * k1, largest=k1)


def _bump(design: DrawnRig, rng: Rng) -> EffectForm:
    depth = design.indentation * rng.uniform(0.3, 0.7)
    width = design.indentation * rng.uniform(0.03, 0.08)
    force = 0.1 * design.contact_stiffness * design.indentation
    place = design.rig.g + depth
    return EffectForm(
        lambda size: {"force": size, "depth": depth, "width": width},
        1e-3 * force,
        place=(place - 1.5 * width, place + 1.5 * width),
        largest=force,
    )


PENDULUM = PlantedEffect(("free",), _pendulum)

STRONG_OUTSIDE: Mapping[str, PlantedEffect] = {
    **{
        name: OUTSIDE_EFFECTS[name]
        for name in ("detent", "friction_pad", "damping_bump", "eddy_brake", "damping_drift",
                     "contact_friction", "contact_preload", "knock")
    },
    "contact_bump": PlantedEffect(("contact",), _bump, 1),
}  # fmt: skip
"""Forces that no effect of the catalogue describes, nor one that is about to join it."""

CATALOGUE_STRONG: Mapping[str, PlantedEffect] = {
    name: PENDULUM if name == "pendulum_sine" else PLANTED_EFFECTS[name]
    for sort in SORTS.values()
    for name in sort
    if name == "pendulum_sine" or (name in PLANTED_EFFECTS and name not in UNTRIED)
}
"""Effects of the catalogue that can be planted, by their id."""


@dataclass(frozen=True)
class Chosen:
    """An effect with its shape and size drawn."""

    effect: str
    form: EffectForm
    size: float
    entry: PlantedEffect
    outside: bool


def chosen(effect: str, design: DrawnRig, rng: Rng) -> Chosen:
    """Draw shape and size of one effect; a pendulum's gravity has its only size."""
    outside = effect in STRONG_OUTSIDE
    entry = STRONG_OUTSIDE[effect] if outside else CATALOGUE_STRONG[effect]
    form = entry.form(design, rng)
    if effect == "pendulum_sine":
        return Chosen(effect, form, form.largest, entry, outside)
    size = form.largest * log_uniform(rng, SHARES.get(effect, SHARE)) if form.start > 0 else 0.0
    return Chosen(effect, form, size, entry, outside)
