"""A driven recording too short for bands of its spectrum has the noise that its remainders show."""

from __future__ import annotations

import numpy as np

from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.inference.noise.driven import driven_noise
from bayesimpact.inference.noise.whitening import Noise


def test_a_short_fast_recording_leaves_no_gap() -> None:
    t = np.arange(110) * 0.01
    rng = np.random.default_rng(0)
    force = Input(np.sin(40.0 * t), "force", free=False)
    moved = 1e-3 * np.sin(40.0 * t) + 1e-6 * rng.standard_normal(t.size)
    remainders = Noise(level=1e-6)
    found = driven_noise([Recording("a", "", moved, 0.01, input=force)], remainders)
    assert found.is_bound and found.level == remainders.level
