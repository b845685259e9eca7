"""What the recordings say of one effect that the model leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]

LIMIT_SD = 5.0  # the detection limit is the size that stands out by so many standard errors


@dataclass(frozen=True, eq=False)
class Score:
    """What the recordings say of one effect at one point of its shape grid.

    Attributes
    ----------
    effect, shapes : which
    z : equivalent standard normal score (signed where the effect has one size)
    p_value : of this score alone
    size, size_sd : expected size of every size parameter and its standard error, (k,)
    limit : detection limit of the first size, LIMIT_SD standard errors
    bias : shift of the model's parameters that ignoring this size causes, (d,), in their standard
        deviations
    kept : fraction of the response that refitting the model cannot imitate
    gain : expected gain in log likelihood
    names : of the size parameters
    """

    effect: Effect
    shapes: Mapping[str, float]
    z: float
    p_value: float
    size: Array
    size_sd: Array
    limit: float
    bias: Array
    kept: float
    gain: float
    names: tuple[str, ...]

    __repr__ = short_repr
