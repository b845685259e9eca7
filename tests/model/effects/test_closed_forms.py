"""Effects against formulas from textbooks, where there is one."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, moved
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import airy, ellipk, gamma

from bayesimpact.errors import InputError
from bayesimpact.model.exact.simulate import simulate
from bayesimpact.model.experiment import simulate as simulate_one
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.model.parameters import SLOTS

FREE = TestRig(mass=0.5, c1=0.0, k1=0.5 * (10 * np.pi) ** 2, k2=(), y0=(-6e-3,), v0=(0.0,))
# almost no suspension: the mass flies into the obstacle and out again
WALL = TestRig(
    mass=0.5, c1=0.0, k1=1e-9, c2=0.0, g=0.0, k2=(5000.0,), y0=(-1e-3,), v0=(0.2,), duration=0.1
)


def changed(rig: TestRig, **changes: object) -> TestRig:
    return TestRig(**{**rig.__dict__, **changes})


def one(name: str, rig: TestRig, r: int = 0, **numbers: float) -> np.ndarray:
    """Motion with one effect, its parameters by keyword."""
    values = {}
    for key, value in numbers.items():
        scope = BY_ID[name].parameter(key).scope
        end = {"campaign": "", "case": f"[{r}]", "recording": f"[{rig.names()[r]}]"}[scope]
        values[f"{name}.{key}{end}"] = value
    return moved([BY_ID[name]], values, rig, r)


def test_friction_takes_the_same_from_every_half_cycle_and_then_holds():
    """|y| falls by 2 F / k1 per half-period (Den Hartog 1931); here a half-period is 0.1 s."""
    force = 0.11
    y = one("coulomb_friction", FREE, force=force)
    step = 2 * force / FREE.k1
    expected, place = [], FREE.y0[0]
    while abs(place) > force / FREE.k1:
        expected.append(place)
        place = -np.sign(place) * (abs(place) - step)
    expected.append(place)
    assert len(expected) == 14
    np.testing.assert_allclose(y[: 100 * len(expected) : 100], expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(y[100 * (len(expected) - 1) :], y[-1])
    assert abs(y[-1]) < force / FREE.k1


def test_friction_holds_until_the_forcing_exceeds_it():
    rig = changed(FREE, y0=(0.0,), duration=0.2, rate=5000.0)
    force, amplitude, frequency = 0.3, 0.5, 2.0
    values = {
        "coulomb_friction.force": force,
        "harmonic_forcing.amplitude": amplitude,
        "harmonic_forcing.frequency": frequency,
        "harmonic_forcing.phase[r0]": 0.0,
    }
    y = moved([BY_ID["coulomb_friction"], BY_ID["harmonic_forcing"]], values, rig)
    w = 2 * np.pi * frequency
    slip = np.arcsin(force / amplitude) / w
    times = np.arange(rig.count) / rig.rate
    assert np.all(y[times <= slip] == 0.0)
    after = (times > slip) & (times < slip + 2e-3)
    growth = amplitude * w * np.cos(w * slip) / rig.mass
    assert np.sum(after) == 10
    np.testing.assert_allclose(y[after], growth * (times[after] - slip) ** 3 / 6, rtol=0.02)


def test_friction_holds_from_the_start():
    rig = changed(FREE, y0=(1e-4,), duration=0.5)
    assert np.all(one("coulomb_friction", rig, force=0.1) == 1e-4)


@pytest.mark.parametrize("m2", [0.0, 0.03])
def test_unilateral_contact(m2):
    """Touch with v+ = m v / (m + m2), contact until m2 y'' + c2 v + k2 d = 0: by matrices."""
    rig = TestRig(y0=(0.0,), v0=(0.25,), k2=(5350.0,), duration=0.1, rate=20000.0)
    name = "obstacle_mass" if m2 else "contact_no_tension"
    y = one(name, rig, **({"mass": m2} if m2 else {}))
    free = np.array([[0, 1, 0], [-rig.k1 / rig.mass, -rig.c1 / rig.mass, 0], [0, 0, 0]])
    total, k2 = rig.mass + m2, rig.k2[0]
    pressed = np.array(
        [
            [0, 1, 0],
            [-(rig.k1 + k2) / total, -(rig.c1 + rig.c2) / total, k2 * rig.g / total],
            [0, 0, 0],
        ]
    )
    start = np.array([rig.y0[0], rig.v0[0], 1.0])
    touch = brentq(lambda t: (expm(free * t) @ start)[0] - rig.g, 0, 0.02, xtol=1e-16)
    at_onset = expm(free * touch) @ start
    at_onset[1] *= rig.mass / total

    def push(t: float) -> float:
        state = expm(pressed * t) @ at_onset
        return m2 * (pressed @ state)[1] + rig.c2 * state[1] + k2 * (state[0] - rig.g)

    release = brentq(push, 0.01, 0.04, xtol=1e-16)
    at_release = expm(pressed * release) @ at_onset
    assert at_release[0] > rig.g  # before the gap
    expected = []
    for t in np.arange(rig.count) / rig.rate:
        if t < touch:
            state = expm(free * t) @ start
        elif t < touch + release:
            state = expm(pressed * (t - touch)) @ at_onset
        else:
            state = expm(free * (t - touch - release)) @ at_release
        expected.append(state[0])
    np.testing.assert_allclose(y, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("exponent", [1.5, 0.8])
def test_power_law_contact_time(exponent):
    """T = 2 sqrt(pi) Gamma(1 + 1/(n+1)) / Gamma(1/2 + 1/(n+1)) D / v, and out as fast as in."""
    y = one("contact_power_law", WALL, exponent=exponent)
    v, n = WALL.v0[0], exponent
    hardness = WALL.k2[0] * 1e-3 ** (1 - n)
    depth = ((n + 1) * WALL.mass * v**2 / (2 * hardness)) ** (1 / (n + 1))
    share = 1 / (n + 1)
    contact = 2 * np.sqrt(np.pi) * gamma(1 + share) / gamma(0.5 + share) * depth / v
    touch = -WALL.y0[0] / v
    times = np.arange(WALL.count) / WALL.rate
    away = times > touch + contact
    assert np.sum(away) > 20
    np.testing.assert_allclose(y[away], -v * (times[away] - touch - contact), rtol=0, atol=3e-10)


@pytest.mark.parametrize(
    ("name", "coefficient", "loss"),
    [
        ("contact_damping_indentation", 190.0, lambda p, D, w: 2 / 3 * p * D**3 * w),
        ("contact_damping_speed", 1.0, lambda p, D, w: 4 / 3 * p * D**3 * w**2),
    ],
)
def test_loss_of_an_impact(name, coefficient, loss):
    """First order in the damping: the work along the undamped half-wave d = D sin(w t)."""
    y = one(name, WALL, coefficient=coefficient)
    w = np.sqrt(WALL.k2[0] / WALL.mass)
    lost = loss(coefficient, WALL.v0[0] / w, w)
    out = (y[-1] - y[-11]) * WALL.rate / 10
    energy = 0.5 * WALL.mass * WALL.v0[0] ** 2
    found = energy - 0.5 * WALL.mass * out**2
    assert 1e-3 < lost / energy < 0.03
    assert found == pytest.approx(lost, rel=2 * lost / energy)


def test_drag_is_a_damping_that_grows_with_amplitude():
    """c_eq = 8 b w a / (3 pi): 1 / a grows linearly (harmonic balance)."""
    rig, b, w = changed(FREE, duration=4.001), 0.05, 10 * np.pi
    y = one("quadratic_drag", rig, coefficient=b)
    amplitudes = np.abs(
        y[::100]
    )  # turning points, for the frequency does not change to first order
    growth = np.diff(1 / amplitudes) / 0.1
    np.testing.assert_allclose(growth, 4 * b * w / (3 * np.pi * rig.mass), rtol=2e-3)


def test_duffing_period():
    """T = 4 K(m) / sqrt((k1 + k3 a^2) / mass), m = k3 a^2 / (2 (k1 + k3 a^2))."""
    k3 = 0.1 * FREE.k1 / FREE.y0[0] ** 2
    stiff = FREE.k1 + k3 * FREE.y0[0] ** 2
    T = 4 * ellipk(k3 * FREE.y0[0] ** 2 / (2 * stiff)) / np.sqrt(stiff / FREE.mass)
    y = one("spring_cubic", changed(FREE, rate=40 / T, duration=10 * T), stiffness=k3)
    np.testing.assert_allclose(y[::40], FREE.y0[0], rtol=0, atol=1e-10)
    np.testing.assert_allclose(y[10::20], 0.0, rtol=0, atol=2e-9)


def test_drifting_spring_is_airys_equation():
    rate, w = 0.05, 10 * np.pi
    y = one("stiffness_drift", changed(FREE, duration=5.0), rate=rate)
    scale = (w / rate) ** (2 / 3)

    def solutions(t: float) -> np.ndarray:
        ai, slope_ai, bi, slope_bi = airy(-scale * (1 + rate * t))
        return np.array([[ai, bi], [-scale * rate * slope_ai, -scale * rate * slope_bi]])

    weights = np.linalg.solve(solutions(0.0), [FREE.y0[0], 0.0])
    expected = [(solutions(t) @ weights)[0] for t in np.arange(y.size) / FREE.rate]
    np.testing.assert_allclose(y, expected, rtol=0, atol=3e-10)


def test_an_obstacle_whose_stiffness_drifts_follows_airys_equation():
    """One contact from y = g on, nothing else pulling."""
    rate, w = 8.0, np.sqrt(5350.0 / 0.503)
    rig = TestRig(
        mass=0.503, c1=0.0, k1=1e-9, c2=0.0, k2=(5350.0,), g=0.0, y0=(0.0,), v0=(0.3,),
        duration=0.025,
    )  # fmt: skip
    y = one("contact_stiffness_drift", rig, rate=rate)
    scale = (w / rate) ** (2 / 3)
    t = np.arange(y.size) / rig.rate
    (ai, slope_ai, bi, slope_bi), now = airy(-scale), airy(-scale * (1 + rate * t))
    expected = -0.3 / (scale * rate) * (ai * now[2] - bi * now[0]) / (ai * slope_bi - slope_ai * bi)
    np.testing.assert_allclose(y, expected, rtol=0, atol=3e-11)
    assert np.abs(y - 0.3 / w * np.sin(w * t)).max() > 1e-4


@pytest.mark.parametrize(("frequency", "rate"), [(7.3, 1000.0), (230.0, 1000.0), (480.0, 200.0)])
def test_forcing_against_the_closed_form(frequency, rate):
    """Also far above the oscillator's own frequency, and above what the samples resolve."""
    rig = TestRig(k2=(5350.0,), y0=(-5e-3,), v0=(0.1,), duration=4.0, rate=rate)
    y = one("harmonic_forcing", rig, amplitude=1.5, frequency=frequency, phase=0.4)
    exact = simulate(
        mass=rig.mass, c1=rig.c1, k1=rig.k1, c2=rig.c2, g=rig.g, k2=rig.k2[0], y0=rig.y0[0],
        v0=rig.v0[0], A=1.5, w=2 * np.pi * frequency, phase=0.4, interval=1 / rig.rate, n=rig.count,
    )  # fmt: skip
    assert exact.impacts.shape[0] > 10
    np.testing.assert_allclose(y, exact.displacement, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("stiffness", "time"), [(500.0, 1e-7), (5e4, 1e-9), (300.0, 1e7)])
def test_relaxation_limits(stiffness, time):
    """A fast branch is a dashpot kz tau, a slow one a spring kz."""
    rig = TestRig(duration=1.0)
    y = one("contact_relaxation", rig, stiffness=stiffness, time=time)
    if time < 1:
        limit = changed(rig, c2=rig.c2 + stiffness * time)
    else:
        limit = changed(rig, k2=tuple(k + stiffness for k in rig.k2))
    assert np.abs(moved([], {}, limit) - moved([], {}, rig)).max() > 1e-8
    np.testing.assert_allclose(y, moved([], {}, limit), rtol=0, atol=3e-10)


def test_gap_wear_is_a_new_gap_after_every_contact():
    """From a state between the first and the second contact on: the base model with g + step."""
    rig = TestRig(k2=(5350.0,), y0=(-6.5e-3,), v0=(0.0,), duration=0.6, rate=5000.0)
    step = 1e-4
    y = one("gap_wear", rig, step=step)
    base = moved([], {}, rig)
    contacts = np.flatnonzero(np.diff((base > rig.g).astype(int)))
    assert contacts.size >= 6
    leave = contacts[1] + 1
    np.testing.assert_allclose(y[:leave], base[:leave], rtol=0, atol=1e-14)
    start = leave + 20  # in flight: two samples give the velocity, by the closed form
    ahead = expm(np.array([[0, 1], [-rig.k1 / rig.mass, -rig.c1 / rig.mass]]) * 20 / rig.rate)
    speed = (y[start + 20] - ahead[0, 0] * y[start]) / ahead[0, 1]
    again = moved([], {}, changed(rig, g=rig.g + step, y0=(y[start],), v0=(speed,)))
    second = contacts[3] - start
    assert np.abs(y[start : start + second] - base[start : start + second]).max() > 1e-5
    np.testing.assert_allclose(y[start : start + second], again[:second], rtol=0, atol=1e-12)


def test_beyond_the_clearance_both_springs_and_dampers_act():
    """Released there, the mass is a linear oscillator until the clearance ends: its matrix."""
    rig = changed(FREE, c1=0.2, rate=20000.0, duration=0.06)
    kp, gp, cp = 600.0, 2.5e-3, 3.0
    y = one("spring_piecewise", rig, stiffness=kp, gap=gp, damping=cp)
    rest = -kp * gp / (rig.k1 + kp)
    A = np.array([[0.0, 1.0], [-(rig.k1 + kp) / rig.mass, -(rig.c1 + cp) / rig.mass]])
    times = np.arange(rig.count) / rig.rate
    start = np.array([rig.y0[0] - rest, 0.0])
    inside = np.array([rest + (expm(A * t) @ start)[0] for t in times])
    leaves = int(np.argmax(inside > -gp))
    assert 100 < leaves < rig.count - 100
    np.testing.assert_allclose(y[:leaves], inside[:leaves], rtol=0, atol=1e-12)
    # in the clearance only the suspension is left, from the speed that the damper left over
    at = brentq(lambda t: rest + (expm(A * t) @ start)[0] + gp, times[leaves - 1], times[leaves])
    B = np.array([[0.0, 1.0], [-rig.k1 / rig.mass, -rig.c1 / rig.mass]])
    speed = (expm(A * at) @ start)[1]
    after = [(expm(B * (t - at)) @ [-gp, speed])[0] for t in times[leaves:]]
    np.testing.assert_allclose(y[leaves:], after, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("exponent", "chi"), [(1.0, 0.5), (1.5, 0.5), (2.5, 3.0), (0.7, 2.0)])
def test_hunt_and_crossley_leave_a_speed_that_hangs_on_chi_alone(exponent, chi):
    """From v dv / (1 + chi v) = -k d^n dd / m: v / chi - ln(1 + chi v) / chi^2 is the same before
    and after an impact, whatever k and n.
    """
    rig = changed(WALL, duration=0.3)
    y = one("hunt_crossley", rig, exponent=exponent, damping=chi)
    speed = (y[-1] - y[-2]) * rig.rate
    invariant = lambda v: v / chi - np.log1p(chi * v) / chi**2  # noqa: E731
    before = invariant(rig.v0[0])
    expected = brentq(lambda v: invariant(v) - before, -1 / chi + 1e-9, -1e-9)
    assert y[-1] < -1e-3 and speed == pytest.approx(expected, rel=1e-7)


def test_the_dashpot_is_gone_beside_hunt_and_crossley():
    """c2 is no unknown of the model, and no effect that needs it can stand beside."""
    rig = TestRig()
    oscillator = build_oscillator(rig.campaign(), [BY_ID["hunt_crossley"]])
    assert "c2" not in oscillator.layout.names and "g" in oscillator.layout.names
    slots = oscillator.layout.slots(np.ones(oscillator.layout.size))
    assert np.all(slots[:, SLOTS.index("c2")] == 0.0)
    with pytest.raises(InputError, match="slot c2 taken by hunt_crossley"):
        build_oscillator(
            rig.campaign(), [BY_ID["hunt_crossley"], BY_ID["contact_damping_per_case"]]
        )
    with pytest.raises(InputError, match="c2: found 2 beside hunt_crossley"):
        simulate_one(
            effects={"hunt_crossley": {"exponent": 1.5, "damping": 0.1}}, mass=0.5, c1=0.1,
            k1=800.0, c2=2.0, k2=5000.0, g=1e-3, y0=-6e-3, v0=0.0, interval=1e-3, n=100,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("hysteresis_bouc_wen", {"stiffness": 60.0, "decay": 400.0}),
        ("presliding_friction", {"force": 0.15, "displacement": 1 / 400.0}),
    ],
)
def test_a_loop_takes_the_same_energy_however_slowly_it_is_gone_through(name, numbers):
    """What a swing loses is what the path integral of the loop says, with the mass out of it.

    From the first turning point to the second, z = tanh-like rises in closed form:
    z = (1 - exp(-b u)) / b from z = 0, u being the way since the release.
    """
    b, peak = 400.0, 0.15
    losses = []
    for mass in (0.5, 5.0):
        rig = changed(FREE, mass=mass, k1=500.0, rate=2000.0, duration=0.6 * np.sqrt(mass / 0.5))
        y = one(name, rig, **numbers)
        top = int(np.argmax(y[: rig.count // 2 + 1]))
        left, here, right = y[top - 1 : top + 2]
        losses.append(here - (right - left) ** 2 / (8 * (left - 2 * here + right)))
    # k1 y0^2 / 2 - k1 y1^2 / 2 = work of the loop on the way u = y1 - y0
    y0 = FREE.y0[0]

    def balance(y1: float) -> float:
        way = y1 - y0
        work = peak * (way - (1 - np.exp(-b * way)) / b)
        return 250.0 * (y0**2 - y1**2) - work

    expected = brentq(balance, 1e-3, 6e-3)
    np.testing.assert_allclose(losses, expected, rtol=0, atol=2e-9)


def test_dahls_friction_and_bouc_and_wens_loop_are_one_law():
    rig = TestRig(duration=1.0)
    dahl = one("presliding_friction", rig, force=0.1, displacement=5e-4)
    loop = one("hysteresis_bouc_wen", rig, stiffness=0.1 / 5e-4, decay=1 / 5e-4)
    np.testing.assert_allclose(dahl, loop, rtol=0, atol=1e-12)
    assert BY_ID["presliding_friction"].is_same_law(BY_ID["hysteresis_bouc_wen"])


def test_short_presliding_is_dry_friction():
    """What is left goes with the time to build the friction up, the root of the way."""
    rig = TestRig(duration=1.0)
    sliding = one("coulomb_friction", rig, force=0.05)
    left = [
        np.abs(one("presliding_friction", rig, force=0.05, displacement=way) - sliding).max()
        for way in (1e-5, 1e-6)
    ]
    assert left[0] < 1e-4 and left[0] / left[1] == pytest.approx(10**0.5, rel=0.1)


def test_adhesion_keeps_the_energy_of_the_stretched_obstacle():
    """Without any damping an impact loses F^2 / (2 k2): what the spring holds when it lets go."""
    rig, force = changed(WALL, duration=0.12), 2.0
    y = one("adhesion", rig, force=force)
    speed = (y[-1] - y[-2]) * rig.rate
    kept = rig.v0[0] ** 2 - force**2 / (rig.k2[0] * rig.mass)
    assert y[-1] < -force / rig.k2[0] and speed == pytest.approx(-np.sqrt(kept), rel=1e-8)
    # a pull that is too strong to overcome: the mass stays and swings about the gap
    held = one("adhesion", rig, force=1.1 * rig.v0[0] * np.sqrt(rig.k2[0] * rig.mass))
    w = np.sqrt(rig.k2[0] / rig.mass)
    t = np.arange(rig.count) / rig.rate - 1e-3 / rig.v0[0]
    expected = np.where(t < 0, rig.v0[0] * t, rig.v0[0] / w * np.sin(w * t))
    np.testing.assert_allclose(held, expected, rtol=0, atol=1e-11)


def test_a_loss_in_the_instant_of_the_touch():
    rig = changed(WALL, duration=0.12)
    y = one("obstacle_restitution", rig, coefficient=0.8)
    assert (y[-1] - y[-2]) * rig.rate == pytest.approx(-0.8 * rig.v0[0], rel=1e-9)
    assert y.max() == pytest.approx(0.8 * rig.v0[0] * np.sqrt(rig.mass / rig.k2[0]), rel=1e-3)
