"""A motion that loses much of itself within a cycle, from its velocity or its acceleration."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.quantity import Quantity
from bayesimpact.data.recording import Recording
from bayesimpact.inference.initial.estimates import Estimates, estimate

RATE = 2 * np.pi / 16  # rad a sample
BIAS = 3.0


def recording(quantity: Quantity, order: int, damping: float, phase: float) -> Recording:
    """The `order`-th derivative of a decay from one, with a frequency of 1 rad/s, about a bias."""
    rate = complex(-damping, np.sqrt(1.0 - damping**2))
    t = RATE * np.arange(110)
    noise = 0.01 * np.random.default_rng(0).standard_normal(t.size)
    samples = (np.exp(1j * phase + rate * t) * rate**order).real + BIAS + noise
    return Recording(quantity, "", samples, RATE, quantity=quantity)


def found(*recordings: Recording) -> Estimates:
    return estimate(Campaign("rig", 1.0, recordings, stop=False))


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0, 3.0])
@pytest.mark.parametrize(("quantity", "order"), [("velocity", 1), ("acceleration", 2)])
def test_strong_damping_is_read_off_the_readings(
    quantity: Quantity, order: int, phase: float
) -> None:
    """The mean over whole cycles is no bias there: the integral drifts by more than the motion."""
    damping = 0.12
    one = found(recording(quantity, order, damping, phase))
    assert one.k1 == pytest.approx(1.0, rel=0.02)
    assert one.c1 == pytest.approx(2 * damping, rel=0.1)
    assert one.offset[quantity] == pytest.approx(BIAS, abs=0.02)
    start = complex(-damping, np.sqrt(1.0 - damping**2)) * np.exp(1j * phase)
    assert one.y0[quantity] == pytest.approx(np.cos(phase), abs=0.05)
    assert one.v0[quantity] == pytest.approx(start.real, abs=0.05)


def test_recordings_of_several_quantities_tell_it_together() -> None:
    """Each at its own start and rest; that of a displacement is its rest reading."""
    kinds: list[tuple[Quantity, int]] = [("displacement", 0), ("acceleration", 2)]
    both = found(*(recording(q, order, 0.12, 1.0) for q, order in kinds))
    assert both.k1 == pytest.approx(1.0, rel=0.02)
    for quantity, _ in kinds:
        assert both.offset[quantity] == pytest.approx(BIAS, abs=0.02)
        assert both.y0[quantity] == pytest.approx(np.cos(1.0), abs=0.05)
