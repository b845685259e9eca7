"""Hysteresis of the suspension by Bouc and Wen: a spring that slips the more the further it goes.

Equation: force z, z' = a v - b |v| z (A = 1: only the product of a and A means something); a in
N/m, b in 1/m (for angles N m/rad, 1/rad). z depends on the path alone and never passes a / b. What
it is at a recording's first sample depends on what was before, so every recording has its own
`start`, as a share of a / b.
At its null: a = 0 is the base model; b and start then mean nothing. b -> 0 is a spring, part of k1;
a large b with F = a / b is coulomb_friction, which is simpler and preferred; between them, for 1 /
b below 0.14 of the amplitude, it is called presliding_friction, the same law in other numbers.
Energy: dissipates; 4 a (A b - tanh(A b)) / b^2 in a cycle of amplitude A.
Valid: joints, wire ropes and elastomers whose loop does not depend on the speed; n = 1, loading
and unloading alike (beta = b, gamma = 0).
Its absence shows as a frequency that falls, and a damping that changes, with amplitude, on both
sides alike, with a loss per cycle that does not depend on the stiffness.
Source: Bouc 1967, Proc. 4th Conf. Nonlinear Oscillations, Prague; Wen 1976, J. Eng. Mech. Div. ASCE
102:249.
Status: the path and its work checked in closed form; compiled law against two
independent integrators of its rate.
"""

from __future__ import annotations

import math

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers, Scales, Size
from bayesimpact.model.effects.presliding_friction import LONGEST, START

SMALLEST = 0.1  # over one over the amplitude: a spring with a loss factor of 4 %, hard to tell


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Restoring force, N; z is its share of the limit a / b."""
    return p[0] / p[1] * z if p[1] > 0.0 else 0.0


def travel(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Share of the limit after a way y from a turning point, in the direction v."""
    return z - (z - v) * -math.expm1(-p[1] * abs(y)) if y != 0.0 else z


def first_at_turn(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Shortest step at a turning point over the usual one: 1 for loops as wide as the amplitude."""
    return min(1.0, math.sqrt(3.0 / (p[1] * abs(y)))) if p[1] * abs(y) > 3.0 else 1.0


def size(p: Numbers, s: Scales) -> Size:
    """Force at the ends of the largest loop."""
    slips = p[1] * s.amplitude
    peak = p[0] * (s.amplitude if slips < 1e-6 else math.tanh(slips) / p[1])
    return peak, "N", peak / s.force


EFFECT = Effect(
    id="hysteresis_bouc_wen",
    family="free damping",
    title="hysteresis of the suspension",
    equation="force z, z' = a v - b |v| z",
    regime="free",
    energy="dissipates",
    statement=(
        "The suspension is hysteretic: a spring that slips adds up to {size} ({share} of the peak "
        "elastic force)."
    ),
    parameters=(
        EffectParameter("stiffness", "N/m", scale=lambda s: 0.1 * s.stiffness, lower=0.0),
        EffectParameter(
            "decay",
            "1/m",
            scale=lambda s: 1.0 / s.amplitude,
            lower=0.0,
            null=None,
            grid=lambda s: np.array([0.3, 1.0, 2.0, 4.0, 6.5]) / s.amplitude,
            within=lambda s: (SMALLEST / s.amplitude, 1.0 / (LONGEST * s.amplitude)),
        ),
        START,
    ),
    law=Law(force, travel=travel, first_at_turn=first_at_turn, ignores_speed=True),
    prefer="coulomb_friction",
    size=size,
)
