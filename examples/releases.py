"""The stiffness that the paper reads off the backbone after a large release (Figs 14 and 15)."""

from __future__ import annotations

import numpy as np

from bayesimpact.model.exact.simulate import simulate
from bayesimpact.response.backbone import backbone

SAMPLES_PER_PERIOD = 1000


def read_stiffness(
    release: float, *, mass: float, c1: float, k1: float, c2: float, g: float, k2: float
) -> float:
    """k2 = m (pi / T)^2 - k1 with T the first half cycle above rest, N/m.

    The mass is released at rest, `release` m away from the beam. SI units.
    """
    interval = 2 * np.pi * np.sqrt(mass / k1) / SAMPLES_PER_PERIOD
    motion = simulate(
        mass=mass, c1=c1, k1=k1, c2=c2, g=g, k2=k2, y0=-release, v0=0.0, interval=interval,
        n=int(1.5 * SAMPLES_PER_PERIOD),
    )  # fmt: skip
    upper = backbone(motion.displacement, interval, rest=0.0, noise=0.0).upper
    return float(mass * (2 * np.pi * upper.frequency[0]) ** 2 - k1)
