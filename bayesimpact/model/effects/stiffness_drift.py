"""The suspension's stiffness changes slowly with time.

Equation: k1 (1 + r t) y in place of k1 y, so k1 r t y is added; r in 1/s; t from the recording's
first sample.
At its null: r = 0 is the base model.
Energy: either: the spring is worked on from outside, power k1 r y^2 / 2.
Valid: warming, a clamp that settles; |r| times the duration well below one; every recording
starts anew.
Its absence shows as a frequency that changes with time, not with amplitude: dw / w = r t / 2.
Source: Landau and Lifshitz 1976, Mechanics, section 49 (adiabatic invariants: amplitude as
k1^(-1/4)).
Status: amplitude and frequency checked against the adiabatic invariant; compiled law against two
independent integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Added elastic force k1 r t y, N; q[1] is k1."""
    return q[1] * p[0] * t * y


EFFECT = Effect(
    id="stiffness_drift",
    family="free stiffness",
    title="drift of the suspension's stiffness",
    equation="k1 r t y",
    regime="free",
    energy="either",
    statement=(
        "The suspension's stiffness drifts during a recording; the force changes by up to {size} "
        "({share} of the peak elastic force)."
    ),
    parameters=(EffectParameter("rate", "1/s", scale=lambda s: 0.02 / s.duration),),
    law=Law(force, polynomial=True, ignores_speed=True, of_time=True),
)
