"""A mode that the release excites is found in free decays, and told from a steady hum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_rigs import BY_ID

import bayesimpact as bi
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.score_test.own_band import shakes_in_own_band

pytestmark = pytest.mark.usefixtures("catalogue_alone")

RATE, SECONDS, MAIN, NOISE = 500.0, 6.0, 4.1, 5e-6
FREQUENCY, DECAY = 17.3, 1.5
EFFECTS = tuple(
    BY_ID[i]
    for i in (
        "released_mode", "sensor_hum", "harmonic_forcing", "base_motion", "second_mode",
        "spring_quadratic", "spring_cubic", "coulomb_friction", "sensor_drift",
    )
)  # fmt: skip


def diagnosed(amplitudes: tuple[float, ...], decay: float, seed: int) -> Diagnosis:
    """Of free decays with a line of these amplitudes, m, that begins with every release."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(SECONDS * RATE)) / RATE
    recordings = []
    for i, amplitude in enumerate(amplitudes):
        y = (4e-3 + 1e-3 * i) * np.exp(-0.25 * t) * np.cos(2 * np.pi * MAIN * t)
        line = np.sin(2 * np.pi * FREQUENCY * t + rng.uniform(0.0, 2 * np.pi))
        y = y + amplitude * np.exp(-decay * t) * line + NOISE * rng.standard_normal(t.size)
        recordings.append({"name": f"r{i}", "samples": y, "unit": "m", "sample_rate_hz": RATE})
    campaign = bi.Campaign.from_arrays(recordings, name="beam", mass_kg=0.5, stop=False)
    return bi.diagnose(campaign, effects=EFFECTS, search=False)


@pytest.mark.parametrize("size", [1e-5, pytest.param(3e-4, marks=pytest.mark.long)])
def test_a_mode_that_rings_down_is_named_with_its_numbers(size: float) -> None:
    amplitudes = (size, 2.0 * size, 0.7 * size)
    found = diagnosed(amplitudes, DECAY, 1)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["released_mode"]
    fit = found.after
    for name, true in [("frequency", FREQUENCY), ("decay", DECAY)] + [
        (f"amplitude[r{i}]", a) for i, a in enumerate(amplitudes)
    ]:
        key = f"released_mode.{name}"
        sd = float(fit.sd[fit.names.index(key)])
        assert abs(fit.value(key) - true) < 4.0 * sd, name
    assert abs(fit.value("k1") / (0.5 * (2 * np.pi * MAIN) ** 2 + 0.5 * 0.25**2) - 1.0) < 1e-4


def test_the_mode_s_own_line_is_not_the_motion() -> None:
    """A strong one stands in the recordings' spectrum as the motion does."""
    found = diagnosed((1.5e-3, 1.5e-3, 1e-3), DECAY, 4)
    assert [e.id for e in found.effects] == ["released_mode"]
    assert not shakes_in_own_band(found.after, remains=True)
    at = found.after.names.index("released_mode.frequency")
    mode = found.after.mode.copy()
    mode[at] = 1.02 * MAIN
    assert shakes_in_own_band(replace(found.after, mode=mode), remains=True)


def test_a_steady_line_is_a_hum() -> None:
    found = diagnosed((2e-5, 2e-5, 2e-5), 0.0, 2)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["sensor_hum"]


def test_nothing_is_found_in_noise() -> None:
    assert diagnosed((0.0, 0.0, 0.0), 0.0, 3).verdict == "adequate"


def test_a_mode_at_a_multiple_of_the_motion_s_frequency_is_what_a_law_makes_of_it() -> None:
    """Once named for a string pendulum whose second harmonic a camera had made."""
    found = diagnosed((3e-4, 6e-4, 2e-4), DECAY, 1)
    at = found.after.names.index("released_mode.frequency")
    for multiple, refused in ((2.0, True), (3.02, True), (3.1, False), (6.0, False)):
        mode = found.after.mode.copy()
        mode[at] = multiple * MAIN
        assert shakes_in_own_band(replace(found.after, mode=mode), remains=False) == refused
