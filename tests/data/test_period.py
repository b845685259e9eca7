"""The rough period against signals whose period is known."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.period import crossing_period


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("offset", [0.0, 3.0])
@pytest.mark.parametrize("decay", [0.0, 0.5])
def test_finds_the_period(noise: float, offset: float, decay: float) -> None:
    rng = np.random.default_rng(1)
    t = np.arange(3000) * 1e-3
    y = np.exp(-decay * t) * np.cos(2 * np.pi * 6.4 * t + 0.3) + offset
    found = crossing_period(y + noise * rng.standard_normal(t.size), 1e-3)
    assert found == pytest.approx(1 / 6.4, rel=0.02)


def test_asymmetric_signal() -> None:
    """A period of 0.1 s below and 0.04 s above, as with a stop."""
    below = -np.sin(np.pi * np.arange(100) / 100)
    above = 0.4 * np.sin(np.pi * np.arange(40) / 40)
    assert crossing_period(np.tile(np.concatenate([below, above]), 9), 1e-3) == pytest.approx(
        0.14, rel=0.02
    )


def test_coarse_sampling() -> None:
    assert crossing_period(np.cos(2 * np.pi * np.arange(80) / 8), 1.0) == pytest.approx(
        8.0, rel=0.02
    )


@pytest.mark.parametrize(
    "samples", [np.zeros(50), np.exp(-np.arange(50) / 9), np.cos(np.linspace(0, 4.5, 50))]
)
def test_no_oscillation_has_no_period(samples: np.ndarray) -> None:
    assert crossing_period(samples, 1.0) is None


def test_no_samples_have_no_period() -> None:
    assert crossing_period(np.array([]), 1e-3) is None
