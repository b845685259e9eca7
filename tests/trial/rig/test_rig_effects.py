"""Every effect and every outside force: equations, null values, energy, closed-form cases."""

from __future__ import annotations

from functools import cache
from math import asin, pi, sqrt

import numpy as np
import pytest
from naive_rig import NaiveRig

from bayesimpact.trial.bundle import PAPER_RIG
from bayesimpact.trial.rig.catalogue import CATALOGUE
from bayesimpact.trial.rig.outside import OUTSIDE
from bayesimpact.trial.rig.recordings import Release, Rig, motion

# strong enough to move the displacement by more than 10 um within 0.35 s
STRONG = {
    "contact_damping_indentation": {"coefficient": 300.0},
    "contact_damping_speed": {"coefficient": 3.0},
    "contact_damping_per_case": {"c2": {"1": 3.0, "2": 1.0}},
    "contact_hardening": {"stiffness": 3e8},
    "contact_power_law": {"exponent": 1.2},
    "contact_second_stage": {"stiffness": 2000.0, "depth": 0.5e-3},
    "contact_stiffness_drift": {"rate": 0.3},
    "hunt_crossley": {"exponent": 1.4, "damping": 0.9},
    "contact_no_tension": {},
    "obstacle_mass": {"mass": 0.01},
    "adhesion": {"force": 1.0},
    "obstacle_restitution": {"coefficient": 0.9},
    "contact_relaxation": {"stiffness": 600.0, "time": 5e-3},
    "second_mode": {"frequency": 25.0, "damping": 0.03, "gain": 1.5},
    "obstacle_mode": {"mass": 0.03, "frequency": 40.0, "damping": 0.03},
    "base_motion": {"frequency": 15.0, "damping": 0.03, "mass_ratio": 0.05},
    "gap_wear": {"step": 2e-5},
    "gap_per_recording": {"g": {"r": 1.3e-3}},
    "coulomb_friction": {"force": 0.4},
    "quadratic_drag": {"coefficient": 1.0},
    "spring_quadratic": {"stiffness": 1e4},
    "spring_cubic": {"stiffness": 3e6},
    "stiffness_drift": {"rate": 0.1},
    "harmonic_forcing": {"amplitude": 0.3, "frequency": 9.0, "phase": {"r": 0.7}},
    "opposite_stop": {"stiffness": 1500.0, "gap": 3e-3},
    "spring_piecewise": {"stiffness": 1500.0, "gap": 3e-3, "damping": 4.0},
    "pendulum_with_spring": {"stiffness": 3e6},
    "spring_quintic": {"stiffness": 5e10},
    "power_damping": {"coefficient": 0.5, "exponent": 1.5},
    "structural_damping": {"loss": 0.05},
    "hysteresis_bouc_wen": {"stiffness": 150.0, "decay": 1e3},
    "presliding_friction": {"force": 0.3, "displacement": 2e-4},
    "detent": {"stiffness": 400.0, "place": -1e-3, "width": 1e-3},
    "friction_pad": {"force": 0.3, "extra": 0.2, "speed": 0.05, "low": -2e-3, "high": 0.5e-3},
    "damping_bump": {"coefficient": 2.0, "place": -2e-3, "width": 1e-3},
    "eddy_brake": {"coefficient": 2.0, "low": -2e-3, "high": -1e-3},
    "resonator": {"mass": 0.02, "frequency": 30.0, "damping_ratio": 0.05},
    "damping_drift": {"rate": 3.0},
    "contact_friction": {"force": 0.4},
    "contact_preload": {"force": 0.1},
    "knock": {"impulse": 0.02, "time": 0.1, "width": 0.01},
}
MODES = {
    "second_mode",
    "obstacle_mode",
    "base_motion",
}  # the naive twin's steps are coarse for them
SENSOR = (
    "sensor_drift", "sensor_quadratic", "sensor_cubic", "sensor_hum", "sensor_high_pass",
    "released_mode",
)  # fmt: skip
CHAIN = ("smoothing", "noise_correlated")
SINE = "pendulum_sine"  # nothing at these amplitudes, and pendulum_with_spring with K = k1
RELEASE = Release("r", "1", -6e-3, 0.01)


def test_every_effect_is_in_the_lists_of_these_tests():
    assert set(STRONG) == (set(CATALOGUE) | set(OUTSIDE)) - set(SENSOR) - set(CHAIN) - {SINE}


@cache
def plain(rate, duration):
    """Displacement of the rig without any effect."""
    return motion(PAPER_RIG, RELEASE, rate=rate, duration=duration).displacement


def against_naive(effects, release, *, duration, step, tolerance):
    run = motion(PAPER_RIG, release, effects, rate=1 / step, duration=duration)
    naive = NaiveRig(PAPER_RIG, release, effects).run(duration, step)
    assert np.abs(run.displacement - naive).max() < tolerance
    return run


@pytest.mark.parametrize("effect", STRONG)
def test_equation_against_the_naive_twin(effect):
    # the naive twin loses its order at the root of d^n
    rooted = effect in ("contact_power_law", "power_damping", "hunt_crossley")
    tolerance = 5e-10 if rooted else 1e-10 if effect in MODES else 1e-11
    effects = {effect: STRONG[effect]}
    run = against_naive(effects, RELEASE, duration=0.35, step=1e-4, tolerance=tolerance)
    assert np.abs(run.displacement - plain(1e4, 0.35)).max() > 1e-5


@pytest.mark.parametrize(
    "combination",
    [
        ("contact_damping_indentation", "contact_no_tension", "gap_wear", "quadratic_drag"),
        ("obstacle_mass", "contact_relaxation", "coulomb_friction", "spring_cubic"),
        ("contact_second_stage", "contact_damping_speed", "opposite_stop", "stiffness_drift"),
        (
            "contact_no_tension",
            "contact_relaxation",
            "resonator",
            "hysteresis_bouc_wen",
            "friction_pad",
        ),
        ("obstacle_mass", "contact_preload", "contact_friction", "knock", "eddy_brake"),
        ("contact_second_stage", "gap_wear"),
        ("contact_stiffness_drift", "obstacle_mass", "quadratic_drag"),
        ("second_mode", "obstacle_mass", "contact_relaxation", "coulomb_friction"),
        ("obstacle_mode", "base_motion", "contact_no_tension", "quadratic_drag"),
        ("base_motion", "obstacle_mass", "second_mode", "spring_cubic"),
        ("contact_damping_per_case", "gap_per_recording", "gap_wear", "contact_hardening"),
    ],
)
def test_combinations_against_the_naive_twin(combination):
    effects = {effect: STRONG[effect] for effect in combination}
    tolerance = 2e-10 if MODES & set(effects) else 1e-11
    against_naive(effects, RELEASE, duration=0.35, step=1e-4, tolerance=tolerance)


def test_stick_and_slip_under_forcing_against_the_naive_twin():
    effects = {
        "coulomb_friction": {"force": 1.0},
        "harmonic_forcing": {"amplitude": 2.0, "frequency": 3.0, "phase": {"r": 1.0}},
        "contact_no_tension": {},
    }
    run = against_naive(effects, RELEASE, duration=0.8, step=1e-4, tolerance=1e-11)
    held = run.velocity == 0
    assert 1000 < held.sum() < 7000
    assert np.diff(held.astype(int)).clip(0).sum() >= 3  # it sticks several times
    assert len(run.onsets) > 1


NULL = {
    "contact_damping_indentation": {"coefficient": 0.0},
    "contact_damping_speed": {"coefficient": 0.0},
    "contact_damping_per_case": {"c2": {"1": 2.085}},
    "contact_hardening": {"stiffness": 0.0},
    "contact_power_law": {"exponent": 1.0},
    "contact_second_stage": {"stiffness": 0.0, "depth": 1e-4},
    "contact_stiffness_drift": {"rate": 0.0},
    "contact_relaxation": {"stiffness": 0.0, "time": 1e-3},
    "second_mode": {"frequency": 70.0, "damping": 0.03, "gain": 0.0},
    "obstacle_mode": {"mass": 0.0, "frequency": 70.0, "damping": 0.03},
    "base_motion": {"frequency": 15.0, "damping": 0.03, "mass_ratio": 0.0},
    "obstacle_restitution": {"coefficient": 1.0},
    "gap_wear": {"step": 0.0},
    "gap_per_recording": {"g": {"r": 1.1e-3}},
    "coulomb_friction": {"force": 0.0},
    "quadratic_drag": {"coefficient": 0.0},
    "spring_quadratic": {"stiffness": 0.0},
    "spring_cubic": {"stiffness": 0.0},
    "stiffness_drift": {"rate": 0.0},
    "harmonic_forcing": {"amplitude": 0.0, "frequency": 9.0, "phase": {"r": 0.7}},
    "opposite_stop": {"stiffness": 0.0, "gap": 3e-3},
    "spring_piecewise": {"stiffness": 0.0, "gap": 3e-3, "damping": 0.0},
    "pendulum_with_spring": {"stiffness": 0.0},
    "spring_quintic": {"stiffness": 0.0},
    "power_damping": {"coefficient": 0.0, "exponent": 0.5},
    "structural_damping": {"loss": 0.0},
    "hysteresis_bouc_wen": {"stiffness": 0.0, "decay": 1e3},
    "presliding_friction": {"force": 0.0, "displacement": 1e-4},
}


@pytest.mark.parametrize("effect", NULL)
def test_null_value_is_the_base_oscillator(effect):
    run = motion(PAPER_RIG, RELEASE, {effect: NULL[effect]}, rate=1000, duration=1)
    assert np.abs(run.displacement - plain(1000, 1)).max() < 1e-12


def test_a_plain_pendulum_is_one_whose_weight_is_all_of_k1():
    rig, release = Rig(mass=0.1, c1=0.01, k1=1.0), Release("r", "", 1.5)
    spring = {"pendulum_with_spring": {"stiffness": 1.0}}
    one = motion(rig, release, {SINE: {}}, rate=50, duration=9)
    assert np.array_equal(
        one.displacement, motion(rig, release, spring, rate=50, duration=9).displacement
    )
    assert (
        np.abs(one.displacement - motion(rig, release, rate=50, duration=9).displacement).max() > 1
    )


def test_an_obstacle_that_does_not_stick_is_one_that_cannot_pull():
    dry = motion(PAPER_RIG, RELEASE, {"adhesion": {"force": 0.0}}, rate=1000, duration=1)
    none = motion(PAPER_RIG, RELEASE, {"contact_no_tension": {}}, rate=1000, duration=1)
    assert np.array_equal(dry.displacement, none.displacement)


def test_massless_obstacle_is_one_that_cannot_pull():
    light = motion(PAPER_RIG, RELEASE, {"obstacle_mass": {"mass": 0.0}}, rate=1000, duration=1)
    none = motion(PAPER_RIG, RELEASE, {"contact_no_tension": {}}, rate=1000, duration=1)
    assert np.array_equal(light.displacement, none.displacement)


LOSSLESS = Rig(mass=0.5, c1=0.0, k1=800.0, c2=0.0, g=1e-3, k2={"1": 5000.0})
POTENTIALS = {
    "spring_quadratic": lambda y: 1e4 * y**3 / 3,
    "spring_cubic": lambda y: 3e6 * y**4 / 4,
    "opposite_stop": lambda y: 750 * np.minimum(y + 3e-3, 0) ** 2,
    "spring_quintic": lambda y: 5e10 * y**6 / 6,
    "detent": lambda y: -200e-6 * np.exp(-(((y + 1e-3) / 1e-3) ** 2)),
}


def energy_in_flight(effect, parameters=None):
    """Energy, J, at the samples clearly below the gap, first and last included, and the run."""
    effects = {effect: STRONG[effect] if parameters is None else parameters}
    run = motion(LOSSLESS, Release("r", "1", -5e-3), effects, rate=2000, duration=2)
    y, v = run.displacement, run.velocity
    energy = 0.25 * v**2 + 400 * y**2 + POTENTIALS.get(effect, lambda y: 0 * y)(y)
    return energy[y < 0.9e-3], run


@pytest.mark.parametrize(
    "effect",
    [
        "contact_hardening",
        "contact_power_law",
        "contact_second_stage",
        "contact_no_tension",
        "contact_preload",
        "gap_wear",
        *POTENTIALS,
    ],
)
def test_conservative_effects_keep_the_energy(effect):
    energy, run = energy_in_flight(effect)
    assert len(run.onsets) > 10
    assert np.ptp(energy) < 2e-10 * energy[0]


@pytest.mark.parametrize(
    "effect",
    [
        "contact_damping_indentation",
        "contact_damping_speed",
        "contact_relaxation",
        "obstacle_mass",
        "coulomb_friction",
        "quadratic_drag",
        "power_damping",
        "structural_damping",
        "friction_pad",
        "damping_bump",
        "eddy_brake",
        "contact_friction",
    ],
)
def test_dissipative_effects_only_take_energy(effect):
    energy, _ = energy_in_flight(effect)
    assert np.diff(energy).max() < 5e-11 * energy[0]
    assert energy[-1] < 0.9 * energy[0]


def test_damping_of_the_other_sign_feeds_the_motion():
    energy, _ = energy_in_flight("contact_damping_speed", {"coefficient": -1.0})
    assert np.diff(energy).min() > -5e-11 * energy[0]
    assert energy[-1] > 1.05 * energy[0]


def test_coulomb_friction_takes_2_f_over_k_per_swing_and_holds_at_last():
    """Exact piecewise-linear decay: half cycles of equal length, amplitude down by 2 F/k1 each."""
    rig = Rig(mass=0.5, c1=0.0, k1=800.0)
    force = 0.3
    run = motion(
        rig, Release("r", "", -5e-3), {"coulomb_friction": {"force": force}}, rate=1e4, duration=1.2
    )
    half_cycle = pi / sqrt(rig.k1 / rig.mass)
    place, t, sign = -5e-3, 0.0, 1
    exact = np.full(run.times.size, np.nan)
    while abs(rig.k1 * place) > force:
        centre = -sign * force / rig.k1
        here = (run.times >= t) & (run.times < t + half_cycle)
        exact[here] = centre + (place - centre) * np.cos(pi * (run.times[here] - t) / half_cycle)
        place, t, sign = 2 * centre - place, t + half_cycle, -sign
    exact[run.times >= t] = place
    assert 5 < t / half_cycle < 12
    assert t < 1.0
    assert np.abs(run.displacement - exact).max() < 1e-12
    assert (run.velocity[run.times > t + 1e-4] == 0).all()


def test_friction_stronger_than_the_forcing_holds_for_good():
    effects = {
        "coulomb_friction": {"force": 0.5},
        "harmonic_forcing": {"amplitude": 0.49, "frequency": 6.0, "phase": {"r": 0.0}},
    }
    run = motion(PAPER_RIG, Release("r", "1", 0.0), effects, rate=1000, duration=1)
    assert np.array_equal(run.displacement, np.zeros(1000))
    stronger = {**effects, "coulomb_friction": {"force": 0.48}}
    run = motion(PAPER_RIG, Release("r", "1", 0.0), stronger, rate=10000, duration=1)
    held = run.times[run.displacement == 0].max()
    assert held == pytest.approx(asin(0.48 / 0.49) / (2 * pi * 6), abs=1.5e-3)


def test_forcing_from_rest_is_transient_plus_steady_motion():
    rig = Rig(mass=0.5, c1=0.8, k1=800.0)
    amplitude, frequency, phase = 0.2, 5.0, 0.0
    forcing = {"amplitude": amplitude, "frequency": frequency, "phase": {"r": phase}}
    effects = {"harmonic_forcing": forcing}
    run = motion(rig, Release("r", "", 0.0), effects, rate=500, duration=3)
    w, b = 2 * pi * frequency, rig.c1 / rig.mass / 2
    wd = sqrt(rig.k1 / rig.mass - b * b)
    response = amplitude / (rig.k1 - rig.mass * w * w + 1j * rig.c1 * w)
    steady = response * np.exp(1j * (w * run.times + phase))
    y0, v0 = -steady[0].imag, -(1j * w * steady[0]).imag
    t = run.times
    free = np.exp(-b * t) * (y0 * np.cos(wd * t) + (v0 + b * y0) / wd * np.sin(wd * t))
    assert np.abs(run.displacement - steady.imag - free).max() < 1e-12


def test_touching_obstacle_shares_its_momentum():
    """v+ = m v/(m + m2) at impact; at release the mass keeps its velocity, the obstacle is gone."""
    mass = 0.05
    run = motion(
        LOSSLESS,
        Release("r", "1", -5e-3),
        {"obstacle_mass": {"mass": mass}},
        rate=1e5,
        duration=0.3,
    )
    touch, leave = run.onsets[0], run.ends[0]
    i, j = np.searchsorted(run.times, [touch, leave])

    def velocity_at(instant, samples):  # linear extrapolation over at most two samples
        fit = np.polyfit(run.times[samples] - instant, run.velocity[samples], 2)
        return fit[-1]

    before = velocity_at(touch, slice(i - 6, i))
    after = velocity_at(touch, slice(i, i + 6))
    speed = sqrt(800 / 0.5 * (5e-3**2 - 1e-3**2))
    assert before == pytest.approx(speed, rel=1e-9)
    assert after == pytest.approx(speed * 0.5 / 0.55, rel=1e-9)
    leaving = velocity_at(leave, slice(j - 6, j))
    free = velocity_at(leave, slice(j, j + 6))
    assert free == pytest.approx(leaving, rel=1e-8)
    # at release the reaction m2 y'' + k2 d vanishes, and the joint motion has kept its energy
    d = np.interp(leave, run.times, run.displacement) - 1e-3
    acceleration = -800 * (1e-3 + d) / 0.5
    assert mass * acceleration + 5000 * d == pytest.approx(0.0, abs=1e-5)
    joint = 0.275 * leaving**2 + 400 * (1e-3 + d) ** 2 + 2500 * d**2
    assert joint == pytest.approx(0.275 * after**2 + 400e-6, rel=1e-8)


def test_obstacle_that_cannot_pull_lets_go_where_its_force_vanishes():
    run = motion(PAPER_RIG, RELEASE, {"contact_no_tension": {}}, rate=1e5, duration=0.3)
    for leave in run.ends:
        y = np.interp(leave, run.times, run.displacement)
        v = np.interp(leave, run.times, run.velocity)
        assert v < 0
        assert 5350.156 * (y - 1.1e-3) == pytest.approx(-2.085 * v, rel=1e-5)


def test_pushing_obstacle_follows_the_mass_beyond_the_gap():
    effects = {"contact_no_tension": {}, "contact_preload": {"force": 1.0}}
    run = against_naive(effects, RELEASE, duration=0.35, step=1e-4, tolerance=1e-11)
    assert np.interp(run.ends[0], run.times, run.displacement) < 1.1e-3 - 1e-5


def test_released_mass_is_free_until_it_has_been_below_the_gap():
    """A stiffly damped, preloaded stop: the mass turns round above the gap and flies on."""
    rig = Rig(mass=0.5, c1=0.0, k1=800.0, c2=20.0, g=-5e-3, k2={"1": 5000.0})
    for y0 in (-4.79e-3, -4.81e-3):  # in contact, and with a reaction that would pull
        run = motion(
            rig, Release("r", "1", y0, -0.05), {"contact_no_tension": {}}, rate=1000, duration=1
        )
        assert run.onsets == ((0.0,) if y0 > -4.8e-3 else ())
        assert len(run.ends) == len(run.onsets)
        energy = 0.25 * run.velocity[2:] ** 2 + 400 * run.displacement[2:] ** 2
        assert np.ptp(energy) < 1e-10 * energy[0]
        assert run.displacement.max() > 4.5e-3
