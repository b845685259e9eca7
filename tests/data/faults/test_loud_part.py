"""Part of a short recording with louder noise, and what only looks like it."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.faults.loud_part import find_loud_part
from bayesimpact.data.recording import Recording

NUMBER, PERIOD, LEVEL = 540, 90, 0.02
AT = np.arange(NUMBER)
DECAY = np.exp(-0.3 * AT / PERIOD) * np.cos(2 * np.pi * AT / PERIOD)


def noise(seed: int) -> np.ndarray:
    return LEVEL * np.random.default_rng(seed).standard_normal(NUMBER)


def recording(samples: np.ndarray, case: str = "") -> Recording:
    return Recording("a", case, samples, 0.1)


@pytest.mark.parametrize("first", [0, 230])
def test_louder_noise_for_a_while_is_set_aside(first: int) -> None:
    """A hand on a seismometer: four effects of the catalogue once stood for its noise."""
    loud = np.where((first <= AT) & (AT - first < 85), 6.0, 1.0)
    found = recording_faults(recording(DECAY + loud * noise(1)))
    (fault,) = [f for f in found if f.id == "recording_noise"]
    ((begin, end),) = fault.spans
    assert fault.action == "exclude" and 3.0 < fault.size < 9.0
    assert begin <= first + 5 and first + 80 <= end <= first + 85 + 2 * NUMBER // 12


def test_readings_without_it_show_none() -> None:
    """Plain ones, ones in steps, and ones with spikes, which are told as such."""
    rng = np.random.default_rng(2)
    for seed in range(60):
        readings = DECAY + noise(seed)
        stepped = np.round(readings / (3 * LEVEL)) * 3 * LEVEL
        spiked = readings.copy()
        spiked[rng.integers(0, NUMBER, 3)] += 40 * LEVEL
        for samples in (readings, stepped, spiked):
            ids = {f.id for f in recording_faults(recording(samples))}
            assert "recording_noise" not in ids


@pytest.mark.parametrize(
    ("frequency", "samples", "size", "level"),
    [
        (0.392, 90.0, 0.24, 0.06), (0.336, 121.0, 0.74, 0.05),  # falls from block to block
        (0.401, 6.8, 0.33, 0.11), (0.413, 14.4, 0.057, 0.045),  # its own line
        (0.203, 98.0, 0.27, 0.20), (0.299, 5.9, 0.72, 0.03),  # slower than noise
    ],
)  # fmt: skip
def test_a_fast_mode_that_decays_is_no_noise(
    frequency: float, samples: float, size: float, level: float
) -> None:
    """`samples` is the time it falls by e in."""
    mode = size * np.exp(-AT / samples) * np.sin(2 * np.pi * frequency * AT)
    assert not find_loud_part(recording(DECAY + mode + level * noise(3)))


def test_contacts_that_ring_are_no_noise() -> None:
    """An acceleration beside a stop is as loud as noise where its contacts are."""
    loud = np.where(AT < 85, 6.0, 1.0) * noise(4)
    ringing = Recording("a", "1", DECAY + loud, 0.1, quantity="acceleration")
    assert not find_loud_part(ringing)
