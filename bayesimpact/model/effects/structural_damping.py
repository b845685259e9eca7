"""Structural (hysteretic) damping: the loss of a cycle depends on its amplitude, not on its speed.

Equation: h k1 |y| sign(v), h without unit: a force in phase with the speed, as large as a share h
of the spring's.
At its null: h = 0 is the base model.
Energy: dissipates, power -h k1 |y v|; 2 h k1 a^2 in a cycle of amplitude a.
Valid: h well below one; joints, composites and metals over many decades of frequency. The loss
factor of a complex stiffness is eta = 2 h / pi.
Its absence shows as a decay that is exponential as that of c1 is, but equally fast against every
stiffness: next to c1 it is seen by the obstacle, where the frequency is another and the loss the
same, and by the shape of the cycle.
Source: Kimball and Lovell 1927, Phys. Rev. 30:948; Reid 1956, J. R. Aeronaut. Soc. 60:283 (this
law); Crandall 1970, J. Sound Vib. 11:3.
Status: ratio of successive amplitudes checked in closed form; compiled law against two independent
integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Force against the motion, N; z is the direction of the motion, q[1] is k1."""
    return z * p[0] * q[1] * abs(y)


def surface(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Where |y| has its kink."""
    return y


EFFECT = Effect(
    id="structural_damping",
    family="free damping",
    title="structural damping",
    equation="h k1 |y| sign(v)",
    regime="free",
    energy="dissipates",
    statement=(
        "The suspension loses the same share of its energy in every cycle, however fast; the force "
        "reaches {size} ({share} of the peak elastic force)."
    ),
    parameters=(
        EffectParameter(
            "loss", "-", scale=lambda s: 0.5 * s.damping_force / s.force, lower=0.0, upper=1.0
        ),
    ),
    law=Law(force, surface=surface, jump_at_turn=True, polynomial=True, ignores_speed=True),
)
