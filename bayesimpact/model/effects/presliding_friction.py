"""Dry friction that gives a little before it slides, by Dahl.

Equation: force z, z' = s v (1 - z / F sign v) with s = F / x; F in N, x in m (for angles N m, rad):
x is the way on which the friction builds up. z depends on the path alone. What it is at a
recording's first sample depends on what was before, so every recording has its own `start`, as a
share of F.
At its null: F = 0 is the base model; x and start then mean nothing. x -> 0 is coulomb_friction,
which is simpler and preferred; for x above 0.14 of the amplitude it is called hysteresis_bouc_wen,
the same law in other numbers.
Energy: dissipates; nearly 4 F (A - x) in a cycle of an amplitude A far above x.
Valid: bearings, guides and clamped joints; static and sliding friction equal, no creep under a
load at rest, no Stribeck effect.
Its absence shows as dry friction at large amplitude, and as a spring s beside k1 and a decay that
goes on once the amplitude is not larger than x.
Source: Dahl 1968, Aerospace Corporation report TOR-0158(3107-18)-1; Dahl 1976, AIAA Journal
14:1675.
Status: the path and its work checked in closed form; compiled law against two
independent integrators of its rate.
"""

from __future__ import annotations

import math

import numpy as np

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers

# Of the largest amplitude: below, coulomb_friction; above, hysteresis_bouc_wen. Set by hand: at the
# upper end friction has turned round after a twentieth of the way back and reaches 0.88 F after a
# fifth of it, so most of the way is sliding.
SHORTEST, LONGEST = 1e-3, 0.14

# of the largest force, which the state never passes
START = EffectParameter(
    "start", "-", lambda s: 1.0, lower=-1.0, upper=1.0, scope="recording", initial=True
)


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Friction force, N; z is its share of F."""
    return p[0] * z


def travel(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Share of F after a way y from a turning point, in the direction v."""
    return v - (v - z) * math.exp(-abs(y) / p[1]) if y != 0.0 else z


def first_at_turn(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Shortest step at a turning point over the usual one: as the time to build up the friction."""
    return math.sqrt(3.0 * p[1] / abs(y)) if abs(y) > 3.0 * p[1] else 1.0


EFFECT = Effect(
    id="presliding_friction",
    family="free damping",
    title="friction with presliding",
    equation="force z, z' = (F / x) v (1 - z / F sign v)",
    regime="free",
    energy="dissipates",
    statement=(
        "Friction of {size} ({share} of the peak elastic force) acts against the motion and gives "
        "a little before it slides."
    ),
    parameters=(
        EffectParameter("force", "N", scale=lambda s: 0.5 * s.damping_force, lower=0.0),
        EffectParameter(
            "displacement",
            "m",
            scale=lambda s: 0.03 * s.amplitude,
            lower=0.0,
            null=None,
            grid=lambda s: np.array([0.003, 0.01, 0.03, 0.1]) * s.amplitude,
            within=lambda s: (SHORTEST * s.amplitude, LONGEST * s.amplitude),
        ),
        START,
    ),
    law=Law(force, travel=travel, first_at_turn=first_at_turn, ignores_speed=True),
    prefer="coulomb_friction",
    restates="hysteresis_bouc_wen",
    size=lambda p, s: (p[0], "N", p[0] / s.force),
)
