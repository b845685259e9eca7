"""How often residuals repeat themselves."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.measurement.repetition import residual_repetition

INTERVAL, SIZE = 1e-3, 4000
TIMES = INTERVAL * np.arange(SIZE)
MOTION = 1e-3 * np.exp(-TIMES) * np.cos(2 * np.pi * 28.0 * TIMES)


def repetition(residual: np.ndarray) -> float:
    recording = Recording("a", "", MOTION, INTERVAL)
    campaign = SimpleNamespace(recordings=(recording,))
    density = SimpleNamespace(oscillator=SimpleNamespace(campaign=campaign))
    part = SimpleNamespace(residual=residual)
    return residual_repetition(SimpleNamespace(density=density, linearisation=(part,)))


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_of_an_autoregressive_process_it_is_known(correlation: float) -> None:
    """1 + 2 sum rho^2k = (1 + rho^2) / (1 - rho^2)."""
    rng, found = np.random.default_rng(0), []
    for _ in range(10):
        x = rng.standard_normal(SIZE)
        for i in range(1, SIZE):
            x[i] += correlation * x[i - 1]
        found.append(repetition(x))
    expected = (1 + correlation**2) / (1 - correlation**2)
    assert np.mean(found) == pytest.approx(expected, rel=0.2)  # correlations of a sample err upward


def test_a_steady_hum_does_not_count_but_a_motion_s_own_frequency_does() -> None:
    """A hum of ten times the noise would leave one sample in some 1,900."""
    noise = np.random.default_rng(1).standard_normal(SIZE)
    hum = 10.0 * np.sin(2 * np.pi * 50.02 * TIMES + 0.3)
    assert repetition(noise + hum) < 1.5
    assert repetition(noise + 1e4 * MOTION) > 100.0
