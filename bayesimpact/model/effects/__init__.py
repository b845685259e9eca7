"""The catalogue: one effect, one file; `EFFECTS` is the only registration."""

from bayesimpact.model.effects import (
    base_motion,
    contact_damping_indentation,
    contact_damping_per_case,
    contact_damping_speed,
    contact_hardening,
    contact_no_tension,
    contact_power_law,
    contact_relaxation,
    contact_second_stage,
    coulomb_friction,
    gap_per_recording,
    gap_wear,
    harmonic_forcing,
    hunt_crossley,
    hysteresis_bouc_wen,
    obstacle_mass,
    obstacle_mode,
    opposite_stop,
    pendulum_sine,
    pendulum_with_spring,
    power_damping,
    presliding_friction,
    quadratic_drag,
    second_mode,
    sensor_cubic,
    sensor_drift,
    sensor_hum,
    sensor_quadratic,
    smoothing,
    spring_cubic,
    spring_piecewise,
    spring_quadratic,
    spring_quintic,
    stiffness_drift,
    structural_damping,
)
from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Scales, address

EFFECTS: tuple[Effect, ...] = (
    contact_damping_indentation.EFFECT,
    contact_damping_speed.EFFECT,
    contact_damping_per_case.EFFECT,
    contact_hardening.EFFECT,
    contact_power_law.EFFECT,
    contact_second_stage.EFFECT,
    hunt_crossley.EFFECT,
    contact_no_tension.EFFECT,
    contact_relaxation.EFFECT,
    obstacle_mass.EFFECT,
    obstacle_mode.EFFECT,
    second_mode.EFFECT,
    base_motion.EFFECT,
    gap_wear.EFFECT,
    gap_per_recording.EFFECT,
    coulomb_friction.EFFECT,
    quadratic_drag.EFFECT,
    spring_quadratic.EFFECT,
    spring_cubic.EFFECT,
    stiffness_drift.EFFECT,
    harmonic_forcing.EFFECT,
    opposite_stop.EFFECT,
    spring_piecewise.EFFECT,
    sensor_drift.EFFECT,
    sensor_quadratic.EFFECT,
    sensor_cubic.EFFECT,
    sensor_hum.EFFECT,
    smoothing.EFFECT,
    pendulum_sine.EFFECT,
    pendulum_with_spring.EFFECT,
    spring_quintic.EFFECT,
    power_damping.EFFECT,
    structural_damping.EFFECT,
    hysteresis_bouc_wen.EFFECT,
    presliding_friction.EFFECT,
)

UNTRIED = ("obstacle_mode", "base_motion")
"""Simulated and fitted like any, but not looked for unless asked: trials have not shown yet that
they are named rightly.
"""

SEARCHED: tuple[Effect, ...] = tuple(e for e in EFFECTS if e.id not in UNTRIED)
"""Effects that a diagnosis looks for by default."""

__all__ = [
    "EFFECTS",
    "SEARCHED",
    "UNTRIED",
    "Effect",
    "EffectParameter",
    "Law",
    "Scales",
    "address",
]
