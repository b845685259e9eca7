"""From parameter vectors to readings: the right numbers in the right recording, then the chain."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from effect_rigs import BY_ID
from scipy.signal import savgol_filter

from bayesimpact.data.campaign import Campaign, Measurement, Smoothing
from bayesimpact.data.recording import Recording
from bayesimpact.model.effects import Effect
from bayesimpact.model.exact.simulate import simulate
from bayesimpact.model.oscillator import Oscillator, build_oscillator
from bayesimpact.trial.rig.measuring_chain import Probe

SAVGOL = Smoothing("savgol", window=21, polyorder=2)
LAG = Smoothing("lag", time_constant=2e-3)
SHARED = {"c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2[x]": 5350.0, "k2[y]": 2959.0}
OWN = {
    "a": {"y0": -6.5e-3, "v0": 0.01, "offset": 2e-5},
    "b": {"y0": 4e-3, "v0": -0.1, "offset": -3e-5},
    "c": {"y0": -5e-3, "v0": 0.0, "offset": 0.0},
}
CASE = {"a": "x", "b": "y", "c": "x"}
SIZES = {"a": (400, 1e-3), "b": (700, 1e-3), "c": (150, 4e-3)}


def campaign(smoothing: Smoothing | None = None) -> Campaign:
    recordings = tuple(
        Recording(name, CASE[name], np.zeros(n), interval) for name, (n, interval) in SIZES.items()
    )
    return Campaign("test", 0.503, recordings, measurement=Measurement(smoothing=smoothing))


def vector(oscillator: Oscillator, **more: float) -> np.ndarray:
    values = SHARED | {"sigma": 1e-6}
    for name, own in OWN.items():
        values |= {f"{kind}[{name}]": value for kind, value in own.items()}
    values |= more
    return np.array([values[name] for name in oscillator.layout.names])


def motion(name: str, **changes: float) -> np.ndarray:
    """True displacement of one recording by the simulator's own door."""
    n, interval = SIZES[name]
    shared = {k: SHARED[k] for k in ("c1", "k1", "c2", "g")} | changes
    own = {k: OWN[name][k] for k in ("y0", "v0")}
    k2 = SHARED[f"k2[{CASE[name]}]"]
    return simulate(mass=0.503, **shared, k2=k2, **own, interval=interval, n=n).displacement


def close(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, atol=1e-15, rtol=0)


def test_each_recording_is_its_own_simulation_plus_its_rest_reading():
    oscillator = build_oscillator(campaign())
    readings = oscillator.predict(vector(oscillator))
    assert [r.shape for r in readings] == [(400,), (700,), (150,)]
    for name, reading in zip("abc", readings, strict=True):
        close(reading, motion(name) + OWN[name]["offset"])


def test_any_leading_shape_and_one_recording_alone():
    oscillator = build_oscillator(campaign())
    rng = np.random.default_rng(0)
    theta = vector(oscillator) * (1 + 0.01 * rng.standard_normal((2, 3, oscillator.layout.size)))
    readings = oscillator.predict(theta)
    assert [r.shape for r in readings] == [(2, 3, 400), (2, 3, 700), (2, 3, 150)]
    for r, reading in enumerate(readings):
        alone = oscillator.predict_recording(r, theta.reshape(6, -1))
        np.testing.assert_array_equal(reading.reshape(6, -1), alone)
        np.testing.assert_array_equal(reading[1, 2], oscillator.predict(theta[1, 2])[r])


@pytest.mark.parametrize("effects", [(), ("coulomb_friction",)])
@pytest.mark.parametrize("smoothing", [None, SAVGOL, LAG])
def test_what_cannot_be_simulated_is_nan_in_its_recordings_only(effects, smoothing):
    oscillator = build_oscillator(campaign(), [BY_ID[e] for e in effects], smoothing=smoothing)
    good = vector(oscillator, **{"coulomb_friction.force": 1e-4})
    bad = good.copy()
    bad[oscillator.layout.index("k2[y]")] = -1.0
    a, b, c = oscillator.predict(np.array([good, bad]))
    assert np.isnan(b[1]).all()
    assert np.isfinite(a).all() and np.isfinite(b[0]).all() and np.isfinite(c).all()


def test_smoothing_comes_last():
    oscillator = build_oscillator(campaign(), smoothing=SAVGOL)
    for name, reading in zip("abc", oscillator.predict(vector(oscillator)), strict=True):
        expected = savgol_filter(motion(name) + OWN[name]["offset"], 21, 2, mode="interp")
        close(reading, expected)


def test_declared_smoothing_is_taken_and_a_given_one_wins():
    assert build_oscillator(campaign(SAVGOL)).smoothing == SAVGOL
    assert build_oscillator(campaign(SAVGOL), smoothing=LAG).smoothing == LAG
    assert build_oscillator(campaign()).smoothing is None


def test_the_probe_reads_the_true_displacement_before_the_rest_reading():
    effects = [BY_ID["sensor_quadratic"], BY_ID["sensor_hum"], BY_ID["sensor_drift"]]
    oscillator = build_oscillator(campaign(), effects)
    hum = {"sensor_hum.amplitude": 1e-5, "sensor_hum.frequency": 13.0}
    phases = {f"sensor_hum.phase[{name}]": 0.5 + i for i, name in enumerate("abc")}
    other = {"sensor_quadratic.gain": 2.0, "sensor_drift.rate": 1e-5}
    for name, reading in zip(
        "abc", oscillator.predict(vector(oscillator, **hum, **phases, **other)), strict=True
    ):
        y, t = motion(name), np.arange(SIZES[name][0]) * SIZES[name][1]
        wave = 1e-5 * np.sin(2 * np.pi * 13.0 * t + phases[f"sensor_hum.phase[{name}]"])
        distorted = y + 2.0 * y**2
        close(reading, distorted + wave + 1e-5 * t + OWN[name]["offset"])


@pytest.mark.parametrize("turn", [1, -1])
def test_effects_of_the_probe_have_no_order(turn):
    """Each acts on the true displacement, as in the independent rig's chain."""
    effects = tuple(BY_ID[i] for i in ("sensor_drift", "sensor_cubic", "sensor_quadratic"))[::turn]
    oscillator = build_oscillator(campaign(), effects)
    own = {"sensor_drift.rate": 1e-4, "sensor_cubic.gain": 300.0, "sensor_quadratic.gain": -2.0}
    probe = Probe(quadratic=-2.0, cubic=300.0, drift=1e-4)
    theta = vector(oscillator, **own)
    for name, reading in zip("abc", oscillator.predict(theta), strict=True):
        n, interval = SIZES[name]
        expected = probe.reads(motion(name), interval * np.arange(n))
        close(reading, expected + OWN[name]["offset"])


def test_split_parameters_stay_in_the_exact_simulator():
    effects = (BY_ID["contact_damping_per_case"], BY_ID["gap_per_recording"])
    oscillator = build_oscillator(campaign(), effects)
    assert oscillator.is_base and oscillator.is_plain
    c2 = {"x": 1.0, "y": 3.0}
    gap = {"a": 1e-3, "b": 1.2e-3, "c": 0.5e-3}
    more = {f"contact_damping_per_case.c2[{k}]": v for k, v in c2.items()}
    more |= {f"gap_per_recording.g[{k}]": v for k, v in gap.items()}
    for name, reading in zip("abc", oscillator.predict(vector(oscillator, **more)), strict=True):
        close(reading, motion(name, c2=c2[CASE[name]], g=gap[name]) + OWN[name]["offset"])


def kinds(effects: tuple[Effect, ...], smoothing: Smoothing | None = None) -> tuple[bool, bool]:
    oscillator = build_oscillator(campaign(), effects, smoothing=smoothing)
    return oscillator.is_base, oscillator.is_plain


def test_which_simulator_runs():
    assert kinds(()) == (True, True)
    assert kinds((), SAVGOL) == (True, False)
    assert kinds((BY_ID["sensor_cubic"],)) == (True, False)
    for effect in ("coulomb_friction", "obstacle_mass", "contact_no_tension", "gap_wear"):
        assert kinds((BY_ID[effect],)) == (False, False)
    assert kinds((BY_ID["quadratic_drag"],)) == (False, False)


@pytest.mark.parametrize(
    "effects", [(), ("gap_per_recording",), ("sensor_hum", "quadratic_drag"), ("gap_wear",)]
)
def test_recording_columns_are_all_that_a_recording_depends_on(effects):
    oscillator = build_oscillator(campaign(), [BY_ID[e] for e in effects])
    layout = oscillator.layout
    values = {n: 0.3 for n in layout.names if "phase" in n}
    values |= {n: 1e-3 + 1e-5 * i for i, n in enumerate(layout.names) if ".g[" in n}
    values |= {"sensor_hum.amplitude": 1e-5, "sensor_hum.frequency": 13.0}
    values |= {"quadratic_drag.coefficient": 0.01, "gap_wear.step": 1e-7}
    theta = vector(oscillator, **values)
    before = oscillator.predict(theta)
    for r in range(3):
        moved = set()
        for i in range(layout.size):
            other = theta.copy()
            other[i] += 1e-4 * max(abs(other[i]), 1e-3)
            if not np.array_equal(oscillator.predict(other)[r], before[r]):
                moved.add(i)
        assert moved == set(oscillator.recording_columns(r))


def test_what_differs_in_the_measurement_alone_is_simulated_once(monkeypatch):
    effects = (BY_ID["sensor_quadratic"], BY_ID["quadratic_drag"])
    oscillator = build_oscillator(campaign(LAG), effects)
    null = {"sensor_quadratic.gain": 0.0, "quadratic_drag.coefficient": 0.0}
    theta = np.tile(vector(oscillator, **null), (6, 1))
    names = oscillator.layout.names
    changes = ("offset[b]", "k1", "sensor_quadratic.gain", "offset[b]", "y0[b]")
    for row, name in enumerate(changes, 1):
        theta[row, names.index(name)] += 1e-3
    expected = np.array([oscillator.predict(t)[1] for t in theta])
    simulated = []

    def counted(self, recordings, slots):
        simulated.append(recordings.size)
        return found(self, recordings, slots)

    found = Oscillator.motions_of
    monkeypatch.setattr(Oscillator, "motions_of", counted)
    close(oscillator.predict_recording(1, theta), expected)
    assert simulated == [3]  # the first, k1's and y0's


def test_a_first_row_that_cannot_be_simulated_stays_alone():
    oscillator = build_oscillator(campaign())
    theta = np.tile(vector(oscillator), (3, 1))
    theta[0, oscillator.layout.names.index("k1")] = np.nan
    readings = oscillator.predict_recording(0, theta)
    assert np.isnan(readings[0]).all() and np.isfinite(readings[1:]).all()


def test_addresses_of_compiled_laws_stay_in_their_process() -> None:
    """Another process would jump to them."""
    oscillator = build_oscillator(campaign(), (BY_ID["spring_cubic"],))
    laws = oscillator.laws
    again = pickle.loads(pickle.dumps(oscillator))
    assert "laws" in oscillator.__dict__ and "laws" not in again.__dict__
    np.testing.assert_array_equal(again.laws, laws)


def test_a_motion_that_grows_without_end_is_given_up():
    """A stiffness that drifts below zero: 1e16 m and more by the end, in ever more steps."""
    oscillator = build_oscillator(campaign(), (BY_ID["stiffness_drift"],))
    steady, growing = (vector(oscillator, **{"stiffness_drift.rate": r}) for r in (-0.5, -12.0))
    kept, lost = (oscillator.predict(theta) for theta in (steady, growing))
    assert all(np.isfinite(row).all() for row in kept)
    assert np.isnan(lost[1]).all()
