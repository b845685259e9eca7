"""Forces of laws with a memory along a motion that is given, against integrated rates."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from effect_rigs import BY_ID
from scipy.integrate import solve_ivp
from small_rig import RIG, record, vector

from bayesimpact.model.linear_response.path_forces import add_forces
from bayesimpact.model.oscillator import build_oscillator

pytestmark = pytest.mark.long

OMEGA, REACH, GAP = 40.0, 6e-3, 2e-3
TIMES = np.arange(1000) * 1e-3

Rate = Callable[[float, float, float], float]
"""z' from displacement, velocity and z."""


def path(t: float) -> tuple[float, float]:
    """A decay about a rest that is not zero: turning points fall between samples."""
    fade = REACH * np.exp(-0.5 * t)
    y = 1e-3 - fade * np.cos(OMEGA * t)
    return y, fade * (0.5 * np.cos(OMEGA * t) + OMEGA * np.sin(OMEGA * t))


def along(effect_id: str, sizes: list[Mapping[str, float]]) -> np.ndarray:
    """Forces (K, n) of a law for its numbers, one row each, in a campaign's recording `a`."""
    effect, campaign = BY_ID[effect_id], record(1)
    oscillator = build_oscillator(campaign, [effect])
    names = oscillator.layout.names
    none = {n: 0.0 for n in names} | {"k1": RIG.k1, "g": GAP}
    rows = [none | {f"{effect_id}.{n}": x for n, x in numbers.items()} for numbers in sizes]
    thetas = np.stack([vector(oscillator.layout, row) for row in rows])
    q = np.ascontiguousarray(oscillator.layout.slots(thetas)[:, 0])
    y, v = np.transpose([path(t) for t in TIMES])
    out = np.zeros((len(sizes), TIMES.size))
    (law,) = oscillator.laws
    add_forces(law, y, v, y - GAP, TIMES, q, np.arange(len(sizes)), out)
    return out


def integrated(rate: Rate, start: float = 0.0) -> np.ndarray:
    """The state (n,) at `TIMES`."""
    found = solve_ivp(
        lambda t, z: [rate(*path(t), z[0])], (0, TIMES[-1]), [start], "DOP853", TIMES,
        rtol=1e-9, atol=1e-14, max_step=2e-4,
    )  # fmt: skip
    return found.y[0]


@pytest.mark.parametrize(("decay", "start"), [(80.0, 0.0), (600.0, 0.0), (80.0, -0.5)])
def test_a_wide_loop(decay: float, start: float) -> None:
    numbers = {"stiffness": 120.0, "decay": decay, "start[a]": start}
    (force,) = along("hysteresis_bouc_wen", [numbers])
    expected = 120.0 * integrated(lambda y, v, z: v - decay * abs(v) * z, start / decay)
    np.testing.assert_allclose(force, expected, atol=2e-4 * np.abs(expected).max())


@pytest.mark.parametrize(("way", "start"), [(1e-4, 0.0), (5e-4, 0.0), (5e-4, 0.2)])
def test_friction_that_gives(way: float, start: float) -> None:
    (force,) = along(
        "presliding_friction", [{"force": 0.3, "displacement": way, "start[a]": start}]
    )
    expected = 0.3 * integrated(lambda y, v, z: v / way * (1 - z * np.sign(v)), start)
    np.testing.assert_allclose(force, expected, atol=2e-3 * 0.3)


@pytest.mark.parametrize("time", [1e-4, 0.02])
def test_a_branch_that_relaxes(time: float) -> None:
    """Times far below a sampling interval too: a dashpot then."""
    numbers: dict[str, float] = {"stiffness": 500.0, "time": time}
    (force,) = along("contact_relaxation", [numbers])
    y = np.array([path(t)[0] for t in TIMES])
    whole = integrated(lambda y, v, z: (500.0 * v if y > GAP else 0.0) - z / time)
    expected = np.where(y > GAP, whole, 0.0)
    inner = (y > GAP) & np.roll(y > GAP, 1) & np.roll(y > GAP, -1)  # touching begins in between
    most = np.abs(expected).max()
    np.testing.assert_allclose(force[inner], expected[inner], atol=0.02 * most)
    assert not force[y <= GAP].any() and force[y > GAP].any()


def test_every_row_begins_from_nothing() -> None:
    one, two = {"force": 0.3, "displacement": 1e-4}, {"force": 0.1, "displacement": 5e-4}
    both = along("presliding_friction", [one, two])
    for row, numbers in zip(both, (one, two), strict=True):
        np.testing.assert_array_equal(row, along("presliding_friction", [numbers])[0])
