"""Where a free decay begins: a hand that still pushes, and turning points that are none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.faults.start import find_start
from bayesimpact.data.recording import Recording


def free_decay(phase: float, push: float, noise: float, seed: int) -> Recording:
    """A decay at 30 readings a period that passes cos(phase) first; until it first turns only the
    share `push` of its way there has been gone, slowly at first.
    """
    t = np.arange(0.0, 12.0, 1 / 30)
    y = np.exp(-0.05 * t) * np.cos(2 * np.pi * t + phase)
    turn = int(np.argmax(np.abs(y[:15])))
    y[:turn] = y[0] + (y[turn] - y[0]) * (t[:turn] / t[turn]) ** (1.0 + push)
    y = y + noise * np.random.default_rng(seed).standard_normal(t.size)
    return Recording("p", "", y, 1 / 30, quantity="angle")


@pytest.mark.parametrize("phase", [-1.2, -0.9, np.pi - 1.0])
@pytest.mark.parametrize("noise", [1e-4, 1e-2])
def test_a_hand_that_pushes_to_the_first_turning_point(phase: float, noise: float) -> None:
    found = recording_faults(free_decay(phase, 2.0, noise, 1))
    assert [f.id for f in found] == ["recording_start"]
    turn = -phase % np.pi / (2 * np.pi)
    assert "not yet free" in found[0].statement
    assert found[0].end_s == pytest.approx(turn, abs=2 / 30)


def test_free_swings_that_begin_anywhere_are_no_hand() -> None:
    """Linear ones and pendulums of up to 150 degrees, from every phase."""
    rng = np.random.default_rng(7)
    for seed in range(60):
        phase, size = rng.uniform(0, 2 * np.pi), rng.uniform(0.1, 2.6)
        energy = 1 - np.cos(size)
        y0 = size * np.cos(phase)
        v0 = -np.sign(np.sin(phase)) * np.sqrt(2 * max(energy - 1 + np.cos(y0), 0.0))
        t = np.arange(0.0, 60.0, 10 ** rng.uniform(-1.5, -0.5))
        for force in (np.sin, lambda x: x):
            found = solve_ivp(
                lambda t, s, f=force: [s[1], -f(s[0]) - 0.02 * s[1]], (0, t[-1]), [y0, v0],
                t_eval=t, rtol=1e-8,
            )  # fmt: skip
            y = found.y[0] + 10 ** rng.uniform(-4, -2) * size * rng.standard_normal(t.size)
            faults = recording_faults(Recording("p", "", y, float(t[1]), quantity="angle"))
            assert not any("not yet free" in f.statement for f in faults), (seed, phase, size)


@pytest.mark.parametrize(("before", "noise"), [(0.08, 4e-3), (0.09, 2e-2)])
def test_a_coarse_turning_point_is_no_rest(before: float, noise: float) -> None:
    """Twenty-four readings a period, from just before a peak."""
    t = np.arange(200) / 24 - before
    y = 1.24 * np.exp(-0.05 * t) * np.cos(2 * np.pi * t)
    y += noise * np.random.default_rng(0).standard_normal(t.size)
    found = recording_faults(Recording("p", "", y, 1 / 24))
    assert [f.id for f in found if f.action != "notice"] == []


def bouncing(rest: float) -> Recording:
    """Accelerations, m/s2 at 20 kHz, of a mass of 1 kg at 20 Hz before a stop 500 times as stiff,
    held for `rest` s and released 5 mm away from it.
    """
    k, c, gap = (2 * np.pi * 20.0) ** 2, 0.5, 2e-3

    def acceleration(y, v):
        return -(k * y + c * v + np.where(y > gap, 500 * k * (y - gap), 0.0))

    t = np.arange(8000) / 20e3
    found = solve_ivp(
        lambda _, s: [s[1], acceleration(*s)], (0, t[-1]), [-5e-3, 0.0], t_eval=t, max_step=5e-5
    )
    held = round(20e3 * rest)
    a = np.concatenate([np.zeros(held), acceleration(*found.y)])
    a += 0.5 * np.random.default_rng(3).standard_normal(a.size)
    return Recording("p", "1", a, 1 / 20e3, quantity="acceleration")


@pytest.mark.parametrize("rest", [0.0, 0.03])
def test_an_acceleration_of_release_is_no_rest(rest: float) -> None:
    """It stays near its first reading for as long as contacts that are far larger allow."""
    found = [f for f in recording_faults(bouncing(rest)) if f.id == "recording_start"]
    assert [round(f.size, 3) for f in found] == ([rest] if rest else [])


@pytest.mark.parametrize("moved", [True, False])
def test_a_mass_that_is_moved_after_a_rest_is_free_from_its_largest_excursion(moved: bool) -> None:
    """A wheel rested, a hand wound it for a third of a period, then it swung: it was told released
    from where it had rested.
    """
    t = np.arange(0.0, 12.0, 1 / 30)
    begun, wound = 0.7, 0.35  # s; the period is 1 s
    free = np.exp(-0.05 * (t - begun - wound)) * np.cos(2 * np.pi * (t - begun - wound))
    way = np.sin(0.5 * np.pi * np.clip((t - begun) / wound, 0.0, 1.0)) ** 2
    y = np.where(t < begun + wound, way if moved else 1.0, free)
    y = y + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    (found,) = recording_faults(Recording("p", "", y, 1 / 30, quantity="angle"))
    assert found.id == "recording_start"
    assert ("at rest, then moved" in found.statement) is moved
    assert found.end_s == pytest.approx(begun + wound, abs=2.5 / 30)
    assert "released from 5" in found.statement or not moved  # degrees


@pytest.mark.parametrize(("release", "phase"), [(4e-3, 2.1), (-4e-3, 5.2)])
def test_a_turning_point_that_a_force_holds_up_is_no_rest(release: float, phase: float) -> None:
    """Let go against a force, which moves the mass three times as far; in a dozen samples noise
    hides now and then that it moves.
    """
    rate, k, c, size, frequency = 250.0, 631.7, 1.67, 4.67, 4.9

    def rates(t: float, state: np.ndarray) -> list[float]:
        y, v = state
        force = size * np.sin(2 * np.pi * frequency * t + phase)
        return [v, force - c * v - k * y]

    t = np.arange(1000) / rate
    y = solve_ivp(rates, (0.0, t[-1]), [release, 0.0], t_eval=t, rtol=1e-9, atol=1e-12).y[0]
    noise = 2e-5 * np.random.default_rng(3).standard_normal((20, t.size))
    found = [recording_faults(Recording("p", "", y + more, 1 / rate)) for more in noise]
    assert sum("at rest" in f.statement for faults in found for f in faults) <= 10


@pytest.mark.parametrize("creep", [0.0, 2e-4, -1e-4])
def test_a_rest_before_a_release_may_creep(creep: float) -> None:
    rate, rest = 250.0, 40
    t = np.arange(1000) / rate
    since = np.clip(t - rest / rate, 0.0, None)
    y = 8e-3 * np.exp(-0.9 * since) * np.cos(2 * np.pi * 4.0 * since) + creep * t / t[rest]
    y = y + 2e-5 * np.random.default_rng(3).standard_normal(t.size)
    (fault,) = recording_faults(Recording("p", "", y, 1 / rate))
    assert fault.id == "recording_start" and fault.end_s == pytest.approx(rest / rate, abs=0.03)


def noisy(readings: float, over: float, rest: float, seed: int) -> Recording:
    """A decay of nine periods, `readings` in each and `over` times its noise, after a rest of
    `rest` periods at its first turning point; without one it begins anywhere.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 9.0 + rest, 1 / readings) - rest
    phase = 0.0 if rest else rng.uniform(0.0, 2 * np.pi)
    y = np.exp(-0.15 * np.maximum(t, 0.0)) * np.cos(2 * np.pi * np.maximum(t, 0.0) + phase)
    y += rng.standard_normal(t.size) / over
    return Recording("p", "", y, 1 / readings, quantity="angle")


@pytest.mark.parametrize("over", [3.0, 6.0])
@pytest.mark.parametrize("readings", [6, 12, 25, 50])
def test_a_decay_that_a_few_standard_deviations_of_noise_hide_has_no_rest(
    readings: int, over: float
) -> None:
    found = [find_start(noisy(readings, over, 0.0, seed)) for seed in range(60)]
    assert sum(map(bool, found)) <= 1


@pytest.mark.parametrize("readings", [12, 25, 50])
def test_a_rest_of_a_period_is_seen_in_loud_noise(readings: int) -> None:
    found = [find_start(noisy(readings, 6.0, 1.0, seed)) for seed in range(20)]
    assert all("at rest" in one[0].statement for one in found)
