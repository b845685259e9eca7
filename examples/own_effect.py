"""An effect of one's own: a magnet that pulls the mass towards its rest position from nearby.

Copy this file and change the force. Then

    bayesimpact effects --check own_effect.py
    bayesimpact diagnose CAMPAIGN --effects own_effect.py

and the diagnosis looks for it as it does for the effects of the catalogue.
"""

import math

from bayesimpact.model.effects import Effect, EffectParameter, Law


def force(y, v, d, t, z, touching, p, q):
    """What stands on the left-hand side of m y'' + c1 y' + k1 y + ... = 0, N.

    y, v, d: displacement, velocity, indentation y - g in SI; t: time since the first sample; p: the
    parameters below, in their order; q: c1, k1, c2, g, k2, ... It is compiled: only arithmetic on
    numbers and the functions of `math`.
    """
    return p[0] * y * math.exp(-((y / p[1]) ** 2))


def widths(s):
    """The widths that are tried, from the sizes of a campaign: shares of the amplitude."""
    return [s.amplitude * share for share in (0.1, 0.2, 0.3, 0.5)]


DETENT = Effect(
    id="magnetic_detent",
    family="free stiffness",  # its near neighbours
    title="magnetic detent",
    equation="k y exp(-(y / w)^2)",
    regime="free",  # where it acts: free, contact, everywhere, measurement
    energy="conserves",
    statement="A magnet near the rest position adds up to {size} ({share} of the elastic force).",
    parameters=(
        # a size: what would be plausible is its scale, and it vanishes at 0
        EffectParameter("stiffness", "N/m", scale=lambda s: 0.1 * s.stiffness),
        # a shape: it means nothing while the size is 0 (null=None); `grid` are the values to try
        EffectParameter(
            "width", "m", scale=lambda s: 0.2 * s.amplitude, lower=0.0, null=None, grid=widths
        ),
    ),
    law=Law(force, ignores_speed=True),
)
