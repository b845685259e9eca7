"""Laws that users write: with memory, with kinks, typed into a session, and the rules they obey."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig, moved
from scipy.integrate import solve_ivp

from bayesimpact.model.effects import Effect, EffectParameter, Law
from bayesimpact.model.law_table import LAW_COLUMNS, law_row

RIG = TestRig(k2=(5350.0,), y0=(-6.5e-3,), v0=(0.0,), duration=1.0)


def effect(law: Law, *numbers: float) -> tuple[Effect, dict[str, float]]:
    """An effect of one's own, and its parameters' values by full name."""
    parameters = tuple(
        EffectParameter(f"p{i}", "-", scale=lambda s: 1.0) for i in range(len(numbers))
    )
    made = Effect("own", "own", "own", "", "everywhere", "either", "", parameters, law)
    return made, {f"own.p{i}": x for i, x in enumerate(numbers)}


def reference(force, rate=lambda y, v, z, touching: 0.0, kinks=(), stop=True) -> np.ndarray:
    """The motion by DOP853 from kink to kink, with force(y, v, z) and rate(y, v, z, touching)."""
    touching, t, state = 0.0, 0.0, [RIG.y0[0], RIG.v0[0], 0.0]
    times = np.arange(RIG.count) / RIG.rate
    out, filled, level = np.empty(times.size), 0, RIG.g if stop else np.inf

    def right(t: float, s: list[float]) -> list[float]:
        y, v, z = s
        total = RIG.c1 * v + RIG.k1 * y + force(y, v, z)
        total += touching * (RIG.c2 * v + RIG.k2[0] * (y - level))
        return [v, -total / RIG.mass, rate(y, v, z, touching)]

    while filled < times.size:
        events = []
        for k in (level, *kinks):
            ahead = k - state[0]
            if np.isfinite(k) and abs(ahead) > 1e-13:
                event = lambda t, s, k=k: s[0] - k  # noqa: E731
                event.terminal, event.direction = True, np.sign(ahead)
                events.append(event)
        turn = lambda t, s: s[1]  # noqa: E731
        going = np.sign(state[1]) or np.sign(right(t, state)[1])
        turn.terminal, turn.direction = True, -going
        answer = solve_ivp(
            right, (t, times[-1] + 1e-9), state, "DOP853", events=[*events, turn],
            dense_output=True, rtol=1e-12, atol=1e-15, max_step=2e-3,
        )  # fmt: skip
        t, state = answer.t[-1], list(answer.y[:, -1])
        upto = times.size if answer.status == 0 else int(np.searchsorted(times, t))
        if upto > filled:
            out[filled:upto] = answer.sol(times[filled:upto])[0]
        filled = upto
        if answer.t_events[-1].size:
            state[1] = 0.0
        if abs(state[0] - level) < 1e-12:
            touching = 1.0 if state[1] > 0 else 0.0
    return out


def bouc_wen_force(y, v, d, t, z, touching, p, q):
    return p[0] * z


def bouc_wen_rate(y, v, d, t, z, touching, p, q):
    return v - p[1] * abs(v) * z


def test_hysteresis():
    """Bouc and Wen's model: a state whose rate is neither linear nor smooth at v = 0."""
    law = Law(bouc_wen_force, rate=bouc_wen_rate, kink_at_turn=True)
    own, values = effect(law, 100.0, 150.0)
    theirs = reference(lambda y, v, z: 100.0 * z, lambda y, v, z, _: v - 150.0 * abs(v) * z)
    assert np.abs(moved([own], values, RIG) - theirs).max() < 1e-9
    assert np.abs(theirs - moved([], {}, RIG)).max() > 1e-4


def own_path(y, v, d, t, z, touching, p, q):
    fade = np.exp(-p[1] * abs(y))
    return z * fade + v * (1 - fade) / p[1]


def test_a_state_that_follows_the_path():
    """The same model by the path in place of the rate: also the catalogue's."""
    own, values = effect(Law(bouc_wen_force, travel=own_path, ignores_speed=True), 100.0, 150.0)
    theirs = reference(lambda y, v, z: 100.0 * z, lambda y, v, z, _: v - 150.0 * abs(v) * z)
    assert np.abs(moved([own], values, RIG) - theirs).max() < 1e-9
    known = {"hysteresis_bouc_wen.stiffness": 100.0, "hysteresis_bouc_wen.decay": 150.0}
    catalogued = moved([BY_ID["hysteresis_bouc_wen"]], known, RIG)
    np.testing.assert_allclose(moved([own], values, RIG), catalogued, rtol=0, atol=1e-9)


def layer_force(y, v, d, t, z, touching, p, q):
    return p[0] * z


def layer_rate(y, v, d, t, z, touching, p, q):
    return touching * v - p[1] * z


def test_memory_in_contact_and_everywhere_together():
    """A branch at the obstacle beside a hysteretic suspension: each keeps its own state."""
    own, values = effect(Law(bouc_wen_force, rate=bouc_wen_rate, kink_at_turn=True), 100.0, 150.0)
    both = [BY_ID["contact_relaxation"], own]
    values |= {"contact_relaxation.stiffness": 800.0, "contact_relaxation.time": 5e-3}

    # the branch as a law of one's own that acts everywhere: the same force, another path
    split = Effect("two", "own", "two", "", "everywhere", "either", "", own.parameters, Law(
        layer_force, rate=layer_rate
    ))  # fmt: skip
    gated = {"two.p0": 0.0, "two.p1": 200.0}
    with_idle = moved([*both, split], values | gated, RIG)
    np.testing.assert_allclose(with_idle, moved(both, values, RIG), rtol=0, atol=1e-12)


def layer_edge_force(y, v, d, t, z, touching, p, q):
    return p[0] * (y - p[1]) + p[2] * (y - p[1]) ** 2 if y > p[1] else 0.0


def layer_edge(y, v, d, t, z, touching, p, q):
    return y - p[1]


def test_a_force_with_a_kink():
    """A soft cushion from a place between the rest and the stop."""
    law = Law(layer_edge_force, surface=layer_edge)
    own, values = effect(law, 150.0, -2e-3, 2e4)

    def force(y, v, z):
        return 150.0 * max(y + 2e-3, 0.0) + 2e4 * max(y + 2e-3, 0.0) ** 2

    theirs = reference(force, kinks=(-2e-3,))
    assert np.abs(moved([own], values, RIG) - theirs).max() < 1e-9
    unlocated, _ = effect(Law(layer_edge_force), 150.0, -2e-3, 2e4)
    worse = np.abs(moved([unlocated], values, RIG) - theirs).max()
    assert worse > 10 * np.abs(moved([own], values, RIG) - theirs).max()


def preload_force(y, v, d, t, z, touching, p, q):
    return p[0]


def test_a_force_that_sets_in_at_the_onset():
    """A preloaded obstacle: its force jumps where contact begins, and where it ends."""
    own, values = effect(Law(preload_force, where="contact"), 0.4)
    touching = lambda y: 0.4 if y > RIG.g else 0.0  # noqa: E731
    # right of the impact the reference is on the side of contact from its first stage on
    theirs = reference(lambda y, v, z: touching(y + 1e-13 * np.sign(v)))
    assert np.abs(moved([own], values, RIG) - theirs).max() < 1e-8
    assert np.abs(theirs - moved([], {}, RIG)).max() > 1e-5


def test_a_law_typed_into_a_session():
    """No source file, no cache, the same numbers."""
    space: dict = {}
    exec("def force(y, v, d, t, z, touching, p, q):\n    return p[0] * y * y * y\n", space)
    own, values = effect(Law(space["force"], polynomial=True, ignores_speed=True), 2e6)
    known = moved([BY_ID["spring_cubic"]], {"spring_cubic.stiffness": 2e6}, RIG)
    np.testing.assert_array_equal(moved([own], values, RIG), known)


def inverse_force(y, v, d, t, z, touching, p, q):
    return p[0] / p[1]


def test_a_division_by_zero_is_no_exception(capfd):
    own, values = effect(Law(inverse_force), 1.0, 0.0)
    assert np.all(np.isnan(moved([own], values, RIG)))
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("where", ["everywhere", "contact"])
def test_rows_say_what_the_law_says(where):
    row = law_row(
        Law(layer_edge_force, where=where, surface=layer_edge, kink_at_turn=True), first=17
    )
    assert row[0] and row[2] and row[0] != row[2]
    assert row[1] == row[5] == 0
    assert row[3] == 2 + (where == "contact")
    assert row[4] == 17
    assert law_row(Law(layer_edge_force, rough_at_touch=True, polynomial=True), 0)[3] == 4 + 8
    assert law_row(Law(layer_edge_force, ignores_speed=True), 0)[3] == 16
    assert len(row) == LAW_COLUMNS  # the simulator reads as many
