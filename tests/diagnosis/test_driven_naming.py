"""What is concealed in driven recordings is named; the motions are an independent integrator's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from driven_rigs import driven_rig
from driven_twin import Law, driven_motion
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose

TRUTH = {"mass": 0.5, "c1": 0.6, "k1": 800.0, "y0": 1e-4, "v0": 0.01}
STOP = {"c2": 2.0, "g": 1.1e-3, "k2": 5000.0}
INTERVAL, NOISE = 2e-3, 5e-6
EFFECTS = tuple(
    BY_ID[i]
    for i in (
        "spring_cubic", "spring_quadratic", "coulomb_friction", "quadratic_drag", "input_delay",
        "contact_damping_indentation", "contact_damping_speed", "contact_hardening",
        "sensor_quadratic", "sensor_drift",
    )
)  # fmt: skip


def _campaign(law: Law, *, stop: bool, corner: bool, gain: float, n: int = 900) -> Campaign:
    white = np.random.default_rng(4).standard_normal(n)
    force = 6.0 * np.convolve(white, np.ones(5) / 5, "same")
    values = {**TRUTH, **(STOP if stop else {})}
    motion, _ = driven_motion(values, force, INTERVAL, law, corner)
    samples = motion + 2e-4 + NOISE * np.random.default_rng(10).standard_normal(n)
    given = Input(force / gain, free=gain != 1.0)
    recording = Recording("a", "1" if stop else "", samples, INTERVAL, input=given)
    return Campaign("rig", TRUTH["mass"], (recording,), stop=stop)


CONCEALED: dict[str, tuple[Law, float, bool, bool, float]] = {
    "spring_cubic": (lambda y, v, touching: 4e5 * y**3, 4e5, False, False, 2.5),
    "quadratic_drag": (lambda y, v, touching: 0.3 * abs(v) * v, 0.3, False, True, 1.0),
    "contact_damping_indentation": (
        lambda y, v, touching: 900.0 * (y - STOP["g"]) * v * touching,
        900.0,
        True,
        False,
        1.0,
    ),
}


@pytest.mark.parametrize("effect", list(CONCEALED))
def test_a_concealed_effect_is_named(effect: str) -> None:
    law, size, stop, corner, gain = CONCEALED[effect]
    campaign = _campaign(law, stop=stop, corner=corner, gain=gain)
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=EFFECTS, search=False)
    assert found.verdict == "named"
    assert [e.id for e in found.effects] == [effect]
    (name,) = (n for n in found.after.names if n.startswith(effect))
    sd = found.after.sd[found.after.names.index(name)]
    assert abs(found.after.value(name) - size) < 4.0 * sd
    assert found.before.reduced_chi2 > 5.0
    assert found.after.reduced_chi2 == pytest.approx(1.0, abs=0.15)


def test_nothing_is_named_where_nothing_is_missing() -> None:
    campaign = _campaign(lambda y, v, touching: 0.0, stop=True, corner=False, gain=1.0)
    found = diagnose(campaign, rng=np.random.default_rng(0), search=False)
    assert found.verdict == "adequate"


DERIVED: dict[str, tuple[int, str]] = {
    "spring_cubic": (202, "acceleration"),  # noise, with a stop
    "coulomb_friction": (204, "acceleration"),  # a sweep, without
    "quadratic_drag": (207, "velocity"),  # a base, read in space, without
}


@pytest.mark.long
@pytest.mark.parametrize("effect", list(DERIVED))
def test_a_concealed_effect_is_named_from_a_derivative(effect: str) -> None:
    seed, quantity = DERIVED[effect]
    rig = driven_rig(seed, quantity)
    k1, mass, reach = rig.truth["k1"], rig.campaign.mass, 3e-3
    sizes = {
        "spring_cubic": 0.03 * k1 / reach**2,
        "coulomb_friction": 0.01 * k1 * reach,
        "quadratic_drag": 0.02 * mass / reach,
    }
    shapes: dict[str, Law] = {
        "spring_cubic": lambda y, v, touching: y**3,
        "coulomb_friction": lambda y, v, touching: float(np.sign(v)),
        "quadratic_drag": lambda y, v, touching: abs(v) * v,
    }
    size, shape = sizes[effect], shapes[effect]

    def law(y: float, v: float, touching: bool) -> float:
        return size * shape(y, v, touching)

    campaign = driven_rig(seed, quantity, law, corner=effect != "spring_cubic").campaign
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=EFFECTS, search=False)
    assert (found.verdict, [e.id for e in found.effects]) == ("named", [effect])
    (name,) = (n for n in found.after.names if n.startswith(effect))
    sd = found.after.sd[found.after.names.index(name)]
    assert abs(found.after.value(name) - size) < 4.0 * sd
    assert found.before.reduced_chi2 > 2.0
    assert found.after.reduced_chi2 == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_nothing_is_named_from_a_derivative_where_nothing_is_missing(quantity: Any) -> None:
    for seed in (200, 202):
        campaign = driven_rig(seed, quantity).campaign
        assert diagnose(campaign, rng=np.random.default_rng(0), search=False).verdict == "adequate"
