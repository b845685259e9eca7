"""The catalogue: one effect, one file; `EFFECTS` is the only registration."""

from bayesimpact.model.effects import (
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
    obstacle_mass,
    opposite_stop,
    quadratic_drag,
    sensor_cubic,
    sensor_drift,
    sensor_hum,
    sensor_quadratic,
    spring_cubic,
    spring_quadratic,
    stiffness_drift,
)
from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Scales, address

EFFECTS: tuple[Effect, ...] = (
    contact_damping_indentation.EFFECT,
    contact_damping_speed.EFFECT,
    contact_damping_per_case.EFFECT,
    contact_hardening.EFFECT,
    contact_power_law.EFFECT,
    contact_second_stage.EFFECT,
    contact_no_tension.EFFECT,
    contact_relaxation.EFFECT,
    obstacle_mass.EFFECT,
    gap_wear.EFFECT,
    gap_per_recording.EFFECT,
    coulomb_friction.EFFECT,
    quadratic_drag.EFFECT,
    spring_quadratic.EFFECT,
    spring_cubic.EFFECT,
    stiffness_drift.EFFECT,
    harmonic_forcing.EFFECT,
    opposite_stop.EFFECT,
    sensor_drift.EFFECT,
    sensor_quadratic.EFFECT,
    sensor_cubic.EFFECT,
    sensor_hum.EFFECT,
)

__all__ = ["EFFECTS", "Effect", "EffectParameter", "Law", "Scales", "address"]
