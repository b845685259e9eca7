"""The simulator: exact test problems, every way to start, refusals, batches."""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest
import systems

from bayesimpact.errors import InputError, SimulationError
from bayesimpact.model.exact import normalized
from bayesimpact.model.exact.simulate import (
    CODES,
    Q,
    predictions,
    simulate,
    sums_of_squares,
    trajectory,
)

RIG = {
    "mass": 0.503, "c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3, "k2": 5350.156,
    "y0": -6.5e-3, "v0": 0.0, "interval": 1e-3, "n": 3000,
}  # fmt: skip
CONSERVATIVE = RIG | {"c1": 0.0, "c2": 0.0}


# exact test problems


@pytest.mark.parametrize("amplitude", [1.2e-3, 2e-3, 6.5e-3, 0.1])
def test_period_of_the_elastic_stop(amplitude):
    """T = (pi + 2 asin(g/a))/w1 + (2/w2) acos(d/a2), d = g k1/(k1+k2), a2 = hypot(d, v_g/w2)."""
    motion = simulate(**CONSERVATIVE | {"y0": -amplitude})
    m, k1, k2, g = (RIG[name] for name in ("mass", "k1", "k2", "g"))
    w1, w2 = math.sqrt(k1 / m), math.sqrt((k1 + k2) / m)
    d, v_g = g * k1 / (k1 + k2), w1 * math.sqrt(amplitude**2 - g**2)
    contact = 2 / w2 * math.acos(d / math.hypot(d, v_g / w2))
    period = (math.pi + 2 * math.asin(g / amplitude)) / w1 + contact
    entries = motion.impacts[:, 0]
    assert len(entries) > 15
    np.testing.assert_allclose(entries, entries[0] + period * np.arange(len(entries)), rtol=1e-13)
    np.testing.assert_allclose(motion.impacts[:-1, 2] - entries[:-1], contact, rtol=1e-11)
    np.testing.assert_allclose(motion.impacts[:, 1], v_g, rtol=1e-12)


def energy(motion, p):
    y, v = motion.displacement, motion.velocity
    deep = np.maximum(y - p["g"], 0.0) if math.isfinite(p["g"]) else 0.0 * y
    return 0.5 * (p["mass"] * v**2 + p["k1"] * y**2 + p["k2"] * deep**2)


@pytest.mark.parametrize("gap", [-2e-3, 0.0, 1.1e-3, 6.49e-3])
def test_energy_is_kept_without_damping(gap):
    p = CONSERVATIVE | {"g": gap}
    kept = energy(simulate(**p), p)
    np.testing.assert_allclose(kept, kept[0], rtol=1e-12)


def test_energy_lost_is_the_work_of_the_dampers():
    p = RIG | {"interval": 2e-5, "n": 40_000}
    motion = simulate(**p)
    kept = energy(motion, p)
    drag = p["c1"] + p["c2"] * (motion.displacement > p["g"])
    power = drag * motion.velocity**2
    work = np.sum(0.5 * (power[1:] + power[:-1])) * p["interval"]
    # the jump of the drag at 2 x 7 events costs up to half an interval each
    assert abs(kept[0] - kept[-1] - work) < 14 * 0.5 * p["interval"] * p["c2"] * 0.26**2 * 0.5
    assert work > 0.1 * kept[0]
    assert np.all(np.diff(kept) <= 1e-15)


@pytest.mark.parametrize("forced", [False, True])
def test_time_runs_backwards_without_damping(forced):
    force = {"A": 0.8, "w": 31.0, "phase": 0.4} if forced else {}
    p = CONSERVATIVE | {"n": 1200} | force
    there = simulate(**p)
    end = (p["n"] - 1) * p["interval"]
    # A sin(w (end - t) + phase) = A sin(w t + phase'), phase' = pi - phase - w end
    back = {"y0": there.displacement[-1], "v0": -there.velocity[-1]}
    if forced:
        back["phase"] = math.pi - 0.4 - 31.0 * end
    again = simulate(**p | back)
    np.testing.assert_allclose(again.displacement[::-1], there.displacement, atol=1e-13)


def test_scaling_lengths_scales_the_motion():
    forced = RIG | {"A": 0.5, "w": 30.0, "phase": 1.0}
    scaled = {name: 1e3 * forced[name] for name in ("g", "y0", "v0", "A")}
    small, large = simulate(**forced), simulate(**forced | scaled)
    np.testing.assert_allclose(large.displacement, 1e3 * small.displacement, atol=1e-13)


def test_the_motion_goes_on_from_any_of_its_states():
    forced = RIG | {"A": 0.5, "w": 30.0, "phase": 1.0, "n": 1500}
    whole = simulate(**forced)
    for k in (1, 49, 55, 700):
        rest = simulate(
            **forced
            | {"y0": whole.displacement[k], "v0": whole.velocity[k], "n": 1500 - k}
            | {"phase": 1.0 + 30.0 * k * 1e-3}
        )
        np.testing.assert_allclose(rest.displacement, whole.displacement[k:], atol=1e-15)


def test_free_decay_is_the_damped_cosine():
    p = RIG | {"g": math.inf, "c2": 0.0, "k2": 0.0, "n": 20_000}
    t = np.arange(p["n"]) * 1e-3
    b = p["c1"] / p["mass"] / 2
    w = math.sqrt(p["k1"] / p["mass"] - b * b)
    exact = p["y0"] * np.exp(-b * t) * (np.cos(w * t) + b / w * np.sin(w * t))
    motion = simulate(**p)
    np.testing.assert_allclose(motion.displacement, exact, atol=1e-14 * 6.5e-3 * w * t[-1])
    assert motion.impacts.shape == (0, 3)


# grazing, double touches, starts


@pytest.mark.parametrize("gap", [1.1e-3, 0.3])
def test_grazing_from_either_side(gap):
    p = CONSERVATIVE | {"g": gap, "n": 1000}
    w1 = math.sqrt(p["k1"] / p["mass"])
    assert len(simulate(**p | {"y0": -gap * (1 - 1e-9)}).impacts) == 0
    reach = gap * (1 + 1e-9)
    touching = simulate(**p | {"y0": -reach})
    assert len(touching.impacts) == 6
    # entry where -reach cos(w1 t) = g; the speed there carries the rounding of reach / g - 1
    first = (math.pi - math.sqrt(2 * 1e-9)) / w1
    assert touching.impacts[0, 0] == pytest.approx(first, rel=1e-11)
    assert touching.impacts[0, 1] == pytest.approx(w1 * gap * math.sqrt(2e-9), rel=1e-6)
    np.testing.assert_allclose(
        touching.impacts[:, 2] - touching.impacts[:, 0], 2 * math.sqrt(2e-9) / w1, rtol=1e-4
    )


@pytest.mark.parametrize("stop", [{}, {"k2": 1e9, "c2": 400.0}, {"g": -1e-3, "c2": 0.0, "k2": 2e5}])
@pytest.mark.parametrize("coarse", [20, 150, 400])
def test_impacts_between_samples(stop, coarse):
    fine = simulate(**RIG | stop | {"n": 2401})
    every = simulate(**RIG | stop | {"interval": 1e-3 * coarse, "n": 2400 // coarse + 1})
    np.testing.assert_allclose(every.displacement, fine.displacement[::coarse], atol=1e-16)
    assert len(every.impacts) == len(fine.impacts) > 15
    np.testing.assert_allclose(every.impacts[:, 0], fine.impacts[:, 0], rtol=1e-12)


def test_two_contacts_within_one_interval():
    """A stiff stop is entered and left twice between two samples."""
    p = RIG | {"k2": 1e8, "c2": 0.0, "g": -6e-3, "y0": -6.2e-3, "interval": 0.04, "n": 2}
    motion = simulate(**p)
    assert len(motion.impacts) >= 3
    assert np.all(motion.impacts[1:, 0] > motion.impacts[:-1, 2])
    fine = simulate(**p | {"interval": 0.04 / 4000, "n": 4001})
    assert np.sum((fine.displacement[1:] > -6e-3) & (fine.displacement[:-1] <= -6e-3)) >= 3
    assert motion.displacement[1] == pytest.approx(fine.displacement[-1], abs=1e-15)


def test_starts():
    def q(**changed):
        return np.array([{**RIG, "A": 0.0, "phase": 0.0, **changed}.get(name, 0.0) for name in Q])

    inside = normalized.begins_in_contact
    assert not inside(q(y0=-1e-3)) and inside(q(y0=1.2e-3))
    assert inside(q(y0=1.1e-3, v0=1e-9)) and not inside(q(y0=1.1e-3, v0=-1e-9))
    assert not inside(q(y0=1.1e-3))  # at the stop, at rest: the spring pulls away
    assert inside(q(y0=-1.1e-3, g=-1.1e-3))  # and here into it
    assert inside(q(y0=1.1e-3, A=1.0, phase=math.pi / 2))  # here the force pushes
    assert not inside(q(y0=0.0, g=0.0))
    assert not inside(q(y0=1.0, k2=0.0, c2=0.0)) and not inside(q(y0=1.0, g=math.inf))


def test_start_in_contact_leaves_and_returns():
    motion = simulate(**RIG | {"y0": 3e-3})
    assert motion.displacement[0] == 3e-3
    assert motion.impacts[0, 0] > 0.05  # the first entry, after the exit from the start's contact
    assert np.all(motion.impacts[:, 1] > 0)


def test_preloaded_stop_comes_to_rest_in_contact():
    motion = simulate(**RIG | {"g": -2e-3, "c2": 60.0, "n": 20_000})
    rest = 5350.156 * -2e-3 / (808.556 + 5350.156)
    assert motion.displacement[-1] == pytest.approx(rest, rel=1e-9)
    assert math.isnan(motion.impacts[-1, 2])


def test_velocity_is_the_derivative():
    motion = simulate(**RIG | {"interval": 1e-5, "n": 20_000, "A": 0.5, "w": 30.0})
    slope = np.gradient(motion.displacement, 1e-5)[1:-1]
    np.testing.assert_allclose(motion.velocity[1:-1], slope, atol=1e-4)


# refusals


@pytest.mark.parametrize(
    "wrong",
    [
        {"mass": 0.0}, {"mass": math.nan}, {"k1": 0.0}, {"k1": -1.0}, {"c1": -1e-9}, {"c2": -1.0},
        {"k2": -1.0}, {"g": math.nan}, {"g": -math.inf}, {"y0": math.inf}, {"w": -1.0},
        {"interval": 0.0}, {"n": 0}, {"n": 1.5}, {"n": True}, {"k1": "stiff"}, {"v0": [0.0]},
        {"phase": math.nan},
    ],
)  # fmt: skip
def test_bad_arguments_are_refused(wrong):
    with pytest.raises(InputError):
        simulate(**RIG | wrong)


def test_failures_of_the_motion():
    with pytest.raises(SimulationError, match="too many impacts"):
        simulate(
            **CONSERVATIVE | {"g": -6.5e-3, "k2": 1e9, "y0": -6.6e-3, "interval": 20.0, "n": 2}
        )
    with pytest.raises(SimulationError, match="overflow"):
        simulate(**RIG | {"k1": 1e-4, "c1": 0.0, "g": math.inf, "v0": 1e308, "interval": 10.0})


def campaign(count=9, n=500, seed=0):
    """Arguments of `sums_of_squares` for `count` recordings with own y0, v0, offset."""
    rng = np.random.default_rng(seed)
    theta = [0.148, 808.556, 2.085, 1.1e-3, 5350.156, 4776.275, 2959.249]
    columns, constants = np.full((count, 11), -1), np.zeros((count, 11))
    for r in range(count):
        columns[r, :5] = [0, 1, 2, 3, 4 + r % 3]
        columns[r, [5, 6, 10]] = len(theta) + np.arange(3)
        theta += [-6.5e-3 + 1e-3 * rng.random(), 1e-2 * rng.standard_normal(), 1e-5]
    counts = n + np.arange(count)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    samples = 1e-3 * rng.standard_normal(counts.sum())
    return np.array(theta), columns, constants, 0.503, samples, starts, counts, np.full(count, 1e-3)


def test_batch_agrees_with_the_door():
    theta, columns, constants, mass, samples, starts, counts, intervals = campaign()
    batch = theta * (1 + 0.01 * np.random.default_rng(1).standard_normal((3, theta.size)))
    model = (columns, constants, mass)
    sse, codes = sums_of_squares(batch, *model, samples, starts, counts, intervals)
    values, again = predictions(batch, *model, counts, intervals, counts.sum())
    assert not codes.any() and not again.any()
    for b in range(3):
        for r in range(9):
            q = dict(zip(Q, batch[b, columns[r]], strict=True))
            offset = q.pop("offset")
            q |= {"A": 0.0, "w": 0.0, "phase": 0.0}
            motion = simulate(**q, mass=mass, interval=intervals[r], n=counts[r])
            here = slice(starts[r], starts[r] + counts[r])
            np.testing.assert_allclose(values[b, here], motion.displacement + offset, atol=1e-17)
            r2 = np.sum((samples[here] - motion.displacement - offset) ** 2)
            assert sse[b, r] == pytest.approx(r2, rel=1e-13)
            out = np.empty(counts[r])
            assert trajectory([*q.values(), offset], mass, intervals[r], out) == 0
            np.testing.assert_array_equal(out, motion.displacement)


def test_constants_stand_in_for_columns():
    theta, columns, constants, *rest = campaign()
    columns, constants = columns.copy(), constants.copy()
    columns[:, 7:10] = -1
    before = sums_of_squares(theta[None], columns, constants, *rest)[0]
    constants[:, :7] = theta[columns[:, :7]]
    columns[:, :7] = -1
    np.testing.assert_array_equal(
        sums_of_squares(theta[None], columns, constants, *rest)[0], before
    )


def test_results_do_not_depend_on_threads_or_company():
    theta, *rest = campaign(n=400)
    rest[0][:, 7:10] = -1
    batch = theta * (1 + 0.02 * np.random.default_rng(2).standard_normal((67, theta.size)))
    threads = numba.get_num_threads()
    try:
        numba.set_num_threads(1)
        alone, _ = sums_of_squares(batch, *rest)
    finally:
        numba.set_num_threads(threads)
    together, _ = sums_of_squares(batch, *rest)
    single = np.concatenate([sums_of_squares(row[None], *rest)[0] for row in batch])
    np.testing.assert_array_equal(together, alone)
    np.testing.assert_array_equal(single, alone)
    # few vectors, long recordings: shared out by recording
    theta, *rest = campaign(count=5, n=30_000)
    rest[0][:, 7:10] = -1
    np.testing.assert_array_equal(
        sums_of_squares(theta[None], *rest)[0][0, 3],
        sums_of_squares(theta[None], *(x[3:4] if np.ndim(x) and x.size < 60 else x for x in rest))[
            0
        ][0, 0],
    )


def test_failed_recordings_are_marked_and_others_are_not():
    theta, columns, constants, *rest = campaign()
    columns = columns.copy()
    columns[:, 7:10] = -1
    theta[5] = -1.0  # k2 of the recordings 1, 4, 7
    sse, codes = sums_of_squares(theta[None], columns, constants, *rest)
    bad = np.arange(9) % 3 == 1
    assert np.all(np.isinf(sse[0, bad])) and np.all(np.isfinite(sse[0, ~bad]))
    assert {CODES[code] for code in codes[0, bad]} == {"c2 or k2 is negative"}
    mass, _, starts, counts, intervals = rest
    values, again = predictions(
        theta[None], columns, constants, mass, counts, intervals, counts.sum()
    )
    np.testing.assert_array_equal(again, codes)
    assert np.isnan(values[0, starts[1] : starts[2]]).all()
    assert np.isfinite(values[0, : starts[1]]).all()


def test_nothing_hostile_gets_a_nan_out():
    rng = np.random.default_rng(3)
    hostile = np.array([0.0, -1.0, 1e-300, 1e300, -1e300, np.inf, -np.inf, np.nan, 1e8, 1e-8])
    samples, columns = np.zeros(40), np.full((1, 11), -1)
    seen = set()
    for _ in range(2000):
        system = systems.draw(rng)
        q = system.q.copy()
        for i in rng.choice(11, rng.integers(1, 4), replace=False):
            q[i] = rng.choice(hostile)
        mass = system.mass if rng.random() < 0.9 else rng.choice(hostile)
        interval = system.interval if rng.random() < 0.9 else rng.choice(hostile)
        arguments = (np.zeros((1, 0)), columns, q[None], mass)
        sse, codes = sums_of_squares(*arguments, samples, [0], [40], [interval])
        seen.add(int(codes[0, 0]))
        assert np.isfinite(sse[0, 0]) if codes[0, 0] == 0 else sse[0, 0] == np.inf, (
            q,
            mass,
            interval,
        )
    assert seen >= {0, 1, 2, 3, 4, 5, 6, 7, 8}


@pytest.mark.parametrize("broken", range(8))
def test_wrong_shapes_are_refused(broken):
    theta, columns, constants, mass, samples, starts, counts, intervals = campaign()
    arguments = [theta[None], columns, constants, mass, samples, starts, counts, intervals]
    worse = [
        theta,
        columns[:, :10],
        constants[:3],
        None,
        samples[:-1],
        starts - 1,
        counts * 0,
        intervals[1:],
    ]
    if broken == 3:
        columns = columns.copy()
        columns[0, 0] = theta.size
        broken, worse[1] = 1, columns
    arguments[broken] = worse[broken]
    with pytest.raises(InputError):
        sums_of_squares(*arguments)
