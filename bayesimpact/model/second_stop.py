"""The second stop of `stop = "two-sided"`: part of the base model, with a damper as the first has.

`opposite_stop` under its own name and in its own numbers, and one more: the damping of
`spring_piecewise`, whose law this is. Where nothing declares it, a second stop that takes energy
goes by that name.
"""

from __future__ import annotations

from dataclasses import replace

from bayesimpact.model.effects import opposite_stop, spring_piecewise

DECLARED = replace(
    opposite_stop.EFFECT,
    equation="ks (y + gs) + cs v where y < -gs",
    energy="dissipates",
    parameters=(*opposite_stop.EFFECT.parameters, spring_piecewise.EFFECT.parameter("damping")),
    law=spring_piecewise.EFFECT.law,
)
