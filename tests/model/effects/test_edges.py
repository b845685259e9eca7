"""Situations in which event-driven integrators go wrong."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, MOVING, TestRig, by_hand, by_rig, moved, typical

from bayesimpact.inference.defaults import effect_prior
from bayesimpact.model.exact.simulate import simulate
from bayesimpact.model.general.loop import BAD_PARAMETERS, OK, integrate_many
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.model.parameters import SLOTS, WITHOUT

NO_LAWS = np.empty((0, 6), dtype=np.int64)


def slots(**values: float) -> np.ndarray:
    """Slot vector (1, Q) of the paper's rig with changes."""
    base = {"c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2": 5350.0, "y0": -6e-3}
    return np.array([[(WITHOUT | base | values).get(name, 0.0) for name in SLOTS]])


def run(q: np.ndarray, rate: float = 1000.0, n: int = 1000, mass: float = 0.503) -> np.ndarray:
    out = np.empty((q.shape[0], n))
    codes = integrate_many(q, mass, np.full(len(q), 1 / rate), np.full(len(q), n), NO_LAWS, out)
    assert np.all(codes == OK)
    return out[0]


def base_motion(rate: float = 1000.0, n: int = 1000, **values: float) -> np.ndarray:
    q = dict(zip(SLOTS, slots(**values)[0], strict=True))
    names = ("c1", "k1", "c2", "g", "k2", "y0", "v0")
    return simulate(mass=0.503, **{k: q[k] for k in names}, interval=1 / rate, n=n).displacement


@pytest.mark.parametrize(
    "start",
    [
        {"y0": 2e-3},  # in contact
        {"y0": 2e-3, "v0": -0.3},  # in contact, on the way out
        {"y0": 1.1e-3, "v0": 0.1},  # on the surface, inwards
        {"y0": 1.1e-3, "v0": -0.1},  # on the surface, outwards
        {"y0": 1.1e-3},  # on the surface, at rest
        {"y0": 0.0, "g": -1e-3},  # pressed, at rest
        {"y0": 0.0, "v0": 0.2, "g": 0.0},
        {"g": np.inf, "c2": 0.0, "k2": 0.0},
        {"g": 7e-3},  # out of reach
        {"k2": 0.0},  # a dashpot alone
        {"c2": 0.0},
        {"k2": 5e6, "c2": 20.0},  # contacts shorter than a sampling interval
        {"k2": 5e8, "c2": 100.0},
    ],
    ids=str,
)
def test_base_oscillator_on_the_general_path(start):
    np.testing.assert_allclose(run(slots(**start)), base_motion(**start), rtol=0, atol=1e-13)


@pytest.mark.parametrize("above", [1e-4, 1e-6, 1e-8, 1e-10])
def test_grazing(above):
    """Turning points just beyond the gap, inside a step of many samples: no touch is lost."""
    y0, c1 = -6e-3, 0.148
    top = base_motion(rate=20000.0, n=3000, y0=y0, g=1.0, c2=0.0, k2=0.0).max()
    values = {"y0": y0, "c1": c1, "g": top - above, "k2": 5e5}
    np.testing.assert_allclose(run(slots(**values)), base_motion(**values), rtol=0, atol=1e-13)
    free = base_motion(y0=y0, g=1.0, c2=0.0, k2=0.0)
    assert np.abs(run(slots(**values)) - free).max() > 0.5 * above


def test_grazing_from_below_at_a_low_rate():
    """At 40 Hz a whole contact fits between two samples."""
    values = {"y0": -6e-3, "k2": 5e5}
    np.testing.assert_allclose(
        run(slots(**values), rate=40.0, n=60), base_motion(rate=40.0, n=60, **values), atol=1e-13
    )


@pytest.mark.parametrize(
    "wrong",
    [
        {"k1": 0.0},
        {"k1": -1.0},
        {"c1": -0.1},
        {"c2": -0.1},
        {"k2": -1.0},
        {"friction": -0.1},
        {"contact_mass": -0.1},
        {"g": -np.inf},
        {"g": np.nan},
        {"y0": np.nan},
        {"v0": np.inf},
    ],
    ids=str,
)
def test_inadmissible_parameters(wrong):
    out = np.empty((1, 10))
    one = np.ones(1)
    codes = integrate_many(slots(**wrong), 0.503, 1e-3 * one, np.array([10]), NO_LAWS, out)
    assert codes[0] == BAD_PARAMETERS
    codes = integrate_many(slots(), 0.0, 1e-3 * one, np.array([10]), NO_LAWS, out)
    assert codes[0] == BAD_PARAMETERS


def test_motion_that_escapes_is_nan():
    """A softening spring can be left: then there is nothing to compare with, but no exception."""
    rig = TestRig(k2=(), y0=(-6e-3,), v0=(0.0,), duration=1.0)
    k3 = -2 * rig.k1 / rig.y0[0] ** 2
    assert np.all(np.isnan(moved([BY_ID["spring_cubic"]], {"spring_cubic.stiffness": k3}, rig)))


def test_threads_do_not_matter():
    q = np.repeat(slots(friction=0.01, no_tension=1.0), 12, axis=0)
    q[:, SLOTS.index("y0")] = np.linspace(-7e-3, 3e-3, 12)
    found = []
    for threads in (True, False):
        out = np.empty((12, 800))
        integrate_many(q, 0.503, np.full(12, 1e-3), np.full(12, 800), NO_LAWS, out, threads=threads)
        found.append(out)
    np.testing.assert_array_equal(*found)


def test_a_short_recording_is_the_start_of_a_long_one():
    effects = [BY_ID["contact_power_law"], BY_ID["spring_cubic"], BY_ID["coulomb_friction"]]
    long, short = TestRig(duration=2.0), TestRig(duration=0.413)
    values: dict[str, float] = {}
    for effect in effects:
        values |= typical(effect, long)
    whole, part = moved(effects, values, long), moved(effects, values, short)
    np.testing.assert_allclose(part, whole[: part.size], rtol=0, atol=5e-12)  # a shorter last step


def test_a_swing_that_grows():
    """Forced from rest near resonance: the cubic spring is nothing at first, then as strong as k1.

    Steps chosen once, at rest, would be too long at the end.
    """
    effects = [BY_ID["spring_cubic"], BY_ID["harmonic_forcing"]]
    rig = TestRig(k2=(), y0=(0.0,), v0=(0.0,), rate=200.0, duration=4.0)
    values = {
        "spring_cubic.stiffness": 9e5, "harmonic_forcing.amplitude": 2.0,
        "harmonic_forcing.frequency": 7.2, "harmonic_forcing.phase[r0]": 0.0,
    }  # fmt: skip
    y = moved(effects, values, rig)
    assert np.abs(y).max() > 0.025
    assert np.abs(y - by_rig(effects, values, rig)).max() < 5e-8


@pytest.mark.parametrize("name", ["contact_no_tension", "obstacle_mass"])
@pytest.mark.parametrize("start", [(2.5e-3, 0.1), (2.5e-3, -2.0), (1.2e-3, -0.9)])
def test_unilateral_start_in_contact(name, start):
    """The obstacle pushes, or has let go from the beginning."""
    rig = TestRig(k2=(5350.0,), y0=(start[0],), v0=(start[1],), duration=0.4)
    values = typical(BY_ID[name], rig)
    difference = moved([BY_ID[name]], values, rig) - by_hand([BY_ID[name]], values, rig)
    assert np.abs(difference).max() < 1e-12


def test_kinks_are_located():
    """A stop of 200 k1 on the other side, met between samples, for any phase of the sampling."""
    effect = BY_ID["opposite_stop"]
    values = {"opposite_stop.stiffness": 200 * 808.556, "opposite_stop.gap": 3.3e-3}
    for y0 in np.linspace(-2.6e-3, -3.2e-3, 5):
        rig = TestRig(k2=(5350.0,), y0=(y0,), v0=(-0.2,), rate=200.0, duration=0.5)
        difference = moved([effect], values, rig) - by_rig([effect], values, rig)
        assert np.abs(difference).max() < 1e-12


@pytest.mark.parametrize("effect", MOVING, ids=lambda e: e.id)
def test_finite_over_the_whole_prior_box(effect):
    """Two hundred draws, three rigs: always a motion, and never a large one."""
    rng = np.random.default_rng(20)
    rigs = (
        TestRig(duration=0.6),
        TestRig(duration=1.0, rate=200.0),
        TestRig(
            mass=0.02, c1=0.05, k1=5000.0, c2=1.0, g=2e-4, k2=(2e5, 6e4), y0=(-1e-3, -8e-4),
            v0=(0.0, 0.3), rate=5000.0, duration=0.05,
        ),
    )  # fmt: skip
    for rig in rigs:
        oscillator = build_oscillator(rig.campaign(), [effect])
        scales, thetas = rig.scales(), []
        for _ in range(200):
            values = {}
            for name in oscillator.layout.names:
                if "." in name:
                    parameter = effect.parameter(name.split(".")[1].split("[")[0])
                    drawn = float(effect_prior(parameter, scales).ppf(rng.uniform(0.1, 0.9)))
                    values[name] = min(max(drawn, parameter.lower), parameter.upper)
            thetas.append(rig.theta(oscillator, values))
        for y in oscillator.predict(np.array(thetas)):
            assert np.all(np.isfinite(y))
            assert np.abs(y).max() < 10 * max(map(abs, rig.y0))


@pytest.mark.parametrize("speed", [0.002, 0.01, 0.02, 0.04])
def test_touches_too_slow_for_the_obstacle_to_push(speed):
    """A heavy obstacle holds the mass back at first: contact ends once it has pushed, or at g."""
    rig = TestRig(k2=(5350.0,), y0=(1.0e-3,), v0=(speed,), duration=0.4)
    effects, values = [BY_ID["obstacle_mass"]], {"obstacle_mass.mass": 0.08}
    difference = moved(effects, values, rig) - by_rig(effects, values, rig)
    assert np.abs(difference).max() < 1e-12


def test_surfaces_at_one_place():
    """Two springs that begin together, beside a law that makes steps short: each is passed once."""
    names = ("opposite_stop", "spring_piecewise", "power_damping", "structural_damping")
    effects, rig, values = [BY_ID[n] for n in names], TestRig(duration=1.5), {}
    for effect in effects:
        values |= typical(effect, rig)
    assert values["opposite_stop.gap"] == values["spring_piecewise.gap"]
    assert np.abs(moved(effects, values, rig) - by_rig(effects, values, rig)).max() < 1e-9


def test_a_motion_that_takes_far_too_many_steps_is_given_up() -> None:
    """An ascent may ask for any size: a body so fast would take minutes for two seconds."""
    rig, effect = TestRig(duration=2.0), BY_ID["obstacle_mode"]
    values = {name: 1e4 * value for name, value in typical(effect, rig).items()}
    assert np.isnan(moved([effect], values, rig)).all()
    near = typical(effect, rig)
    near["obstacle_mode.frequency"] *= 100.0
    assert np.isfinite(moved([effect], near, rig)).all()
