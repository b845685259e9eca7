"""The obstacle's stiffness changes slowly with time.

Equation: k2 (1 + r t) d in place of k2 d, so k2 r t d is added in contact; r in 1/s; t from the
recording's first sample.
At its null: r = 0 is the base model.
Energy: either: the obstacle is worked on from outside, power k2 r d^2 / 2.
Valid: a rubber or plastic stop that warms as it is struck, a bolt that settles; |r| times the
duration well below one; every recording starts anew. Of a change that levels off within a
recording it is the first term only.
Its absence shows as contacts that last ever longer (r < 0) than their depth says, while free
flights keep their time.
Source: Nashif, Jones and Henderson 1985, Vibration Damping (modulus against temperature); Landau
and Lifshitz 1976, Mechanics, section 49 (slow changes).
Status: depth of a contact checked against the closed form; compiled law against two independent
integrators.
"""

from __future__ import annotations

from bayesimpact.model.effects.effect import Effect, EffectParameter, Law, Numbers


def force(
    y: float, v: float, d: float, t: float, z: float, touching: float, p: Numbers, q: Numbers
) -> float:
    """Added elastic force k2 r t d, N; q[4] is k2."""
    return q[4] * p[0] * t * d


EFFECT = Effect(
    id="contact_stiffness_drift",
    family="contact stiffness",
    title="drift of the obstacle's stiffness",
    equation="k2 r t d in contact",
    regime="contact",
    energy="either",
    statement=(
        "The obstacle's stiffness drifts during a recording; the force changes by up to {size} "
        "({share} of the peak contact force)."
    ),
    parameters=(EffectParameter("rate", "1/s", scale=lambda s: 0.05 / s.duration),),
    law=Law(force, where="contact", polynomial=True, ignores_speed=True, of_time=True),
    needs_stop=True,
    condition=lambda s: s.impacts > 1,
)
