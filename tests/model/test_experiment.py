"""Recordings simulated with effects: the base motion at their null, a naive solver beside it."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bayesimpact as bi
from bayesimpact.errors import InputError

RIG = {"mass": 0.503, "c1": 0.148, "k1": 808.6, "y0": -6e-3, "v0": 0.0}
STOP = {"c2": 2.085, "g": 1.1e-3, "k2": 5350.0}
GRID = {"interval": 1e-3, "n": 800}


def test_without_effects_the_motion() -> None:
    motion = bi.simulate(**RIG, **STOP, **GRID)
    recording = bi.simulate(**RIG, **STOP, **GRID, effects={}, offset=2e-6, name="a")
    assert (recording.name, recording.case, recording.interval) == ("a", "1", 1e-3)
    np.testing.assert_allclose(recording.samples, motion.displacement + 2e-6, atol=1e-15)


def test_drag_against_a_plain_solver() -> None:
    b = 3.0

    def slope(t: float, s: np.ndarray) -> list[float]:
        force = RIG["c1"] * s[1] + RIG["k1"] * s[0] + b * abs(s[1]) * s[1]
        return [s[1], -force / RIG["mass"]]

    times = np.arange(GRID["n"]) * GRID["interval"]
    start = [RIG["y0"], RIG["v0"]]
    plain = solve_ivp(slope, (0, times[-1]), start, t_eval=times, rtol=1e-11, atol=1e-14)
    recording = bi.simulate(**RIG, **GRID, effects={"quadratic_drag": {"coefficient": b}})
    assert np.abs(recording.samples - bi.simulate(**RIG, **GRID).displacement).max() > 1e-5
    np.testing.assert_allclose(recording.samples, plain.y[0], atol=2e-9)
    assert recording.case == ""


def test_effect_in_place_of_a_base_parameter() -> None:
    own = {"contact_damping_per_case": {"c2": STOP["c2"]}}
    stop = {k: v for k, v in STOP.items() if k != "c2"}
    recording = bi.simulate(**RIG, **stop, **GRID, effects=own)
    expected = bi.simulate(**RIG, **STOP, **GRID).displacement
    np.testing.assert_allclose(recording.samples, expected, atol=1e-12)


def test_simulated_recordings_make_a_campaign(tmp_path: Path) -> None:
    effects = {"sensor_drift": {"rate": 1e-5}}
    made = [bi.simulate(**RIG, **STOP, **GRID, effects=effects, name=n) for n in "ab"]
    campaign = bi.Campaign.from_arrays(made, name="simulated", mass_kg=0.503)
    assert bi.load(campaign.save(tmp_path)).cases == ("1",)
    assert len(bi.plot(campaign).axes) == 2
    assert len(bi.plot(made[0]).axes) == 1
    with pytest.raises(InputError, match="plot"):
        bi.plot([])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"effects": {"friction": {}}}, ("'friction'", "contact_damping_speed")),
        ({"effects": {"quadratic_drag": {}}}, ("quadratic_drag", "nothing", "coefficient")),
        ({"effects": {"quadratic_drag": {"coefficient": np.nan}}}, ("coefficient", "nan")),
        ({"A": 1.0, "effects": {}}, ("A", "harmonic_forcing")),
        ({"k1": -1.0, "effects": {}}, ("k1 is not positive",)),
        ({"k1": "8", "effects": {}}, ("k1", "'8'", "a number")),
        ({"n": 1, "effects": {}}, ("simulate, n", "2 or more")),
        ({"colour": 1, "effects": {}}, ("colour", "unknown argument")),
    ],
)
def test_refused(change: dict, words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refusal:
        bi.simulate(**{**RIG, **STOP, **GRID, **change})
    assert [word for word in words if word not in str(refusal.value)] == []


def test_effects_pickle_as_themselves() -> None:
    for effect in bi.EFFECTS:
        assert pickle.loads(pickle.dumps(effect)) is effect
