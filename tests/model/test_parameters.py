"""Names, units and bounds of the unknowns; where they enter the recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.model.effects.effect import Effect, EffectParameter
from bayesimpact.model.parameters import SLOTS, WITHOUT, angular, build_layout


def campaign(stop: bool = True, quantity: str = "displacement") -> Campaign:
    cases = ("x", "y", "x") if stop else ("", "", "")
    recordings = tuple(
        Recording(name, case, np.zeros(50), 1e-3, quantity=quantity)
        for name, case in zip("abc", cases, strict=True)
    )
    return Campaign("test", 0.5, recordings, stop=stop)


def test_names_are_those_of_the_contract_and_grouped_by_role():
    layout = build_layout(campaign())
    nuisances = tuple(f"{kind}[{r}]" for r in "abc" for kind in ("y0", "v0", "offset"))
    assert layout.names == ("c1", "k1", "c2", "g", "k2[x]", "k2[y]", *nuisances, "sigma")
    assert layout.size == len(layout.names) == 16
    assert [p.unit for p in layout.parameters[:9]] == [
        "N s/m", "N/m", "N s/m", "m", "N/m", "N/m", "m", "m/s", "m",
    ]  # fmt: skip
    assert list(layout.roles("physical")) == list(range(6))
    assert list(layout.roles("noise", "physical")) == [*range(6), 15]


def test_without_a_stop_there_is_no_obstacle():
    layout = build_layout(campaign(stop=False))
    assert [n for n in layout.names if "[" not in n] == ["c1", "k1", "sigma"]
    q = layout.slots(np.arange(1.0, layout.size + 1))
    named = dict(zip(SLOTS, q[0], strict=True))
    assert named["g"] == np.inf and named["k2"] == named["c2"] == 0.0


def test_a_noise_level_for_every_recording():
    layout = build_layout(campaign(), sigma_per_recording=True)
    assert layout.names[-3:] == ("sigma[a]", "sigma[b]", "sigma[c]")
    assert all(p.lower == 0.0 for p in layout.parameters[-3:])


def test_bounds_are_those_of_physics():
    lower = {p.name: p.lower for p in build_layout(campaign()).parameters}
    assert lower["c1"] == lower["k1"] == lower["c2"] == lower["k2[y]"] == lower["sigma"] == 0.0
    assert lower["g"] == lower["y0[a]"] == lower["offset[c]"] == -np.inf


def expected_slot(names: dict[str, float], slot: str, recording: str, case: str) -> float:
    for key in (f"{slot}[{recording}]", f"{slot}[{case}]", slot):
        if key in names:
            return names[key]
    return WITHOUT.get(slot, 0.0)


def test_every_recording_gets_its_own_values():
    layout = build_layout(campaign())
    theta = np.random.default_rng(0).standard_normal((2, 5, layout.size))
    q = layout.slots(theta)
    assert q.shape == (2, 5, 3, len(SLOTS))
    for index in np.ndindex(2, 5):
        values = dict(zip(layout.names, theta[index], strict=True))
        for r, (recording, case) in enumerate(zip("abc", "xyx", strict=True)):
            expected = [expected_slot(values, slot, recording, case) for slot in SLOTS]
            np.testing.assert_array_equal(q[(*index, r)], expected)


def test_a_split_parameter_takes_the_place_of_the_shared_one():
    effects = (BY_ID["contact_damping_per_case"], BY_ID["gap_per_recording"])
    layout = build_layout(campaign(), effects)
    assert "c2" not in layout.names and "g" not in layout.names
    values = {name: float(i + 1) for i, name in enumerate(layout.names)}
    q = layout.slots(np.array(list(values.values())))
    for r, (recording, case) in enumerate(zip("abc", "xyx", strict=True)):
        assert q[r, SLOTS.index("c2")] == values[f"contact_damping_per_case.c2[{case}]"]
        assert q[r, SLOTS.index("g")] == values[f"gap_per_recording.g[{recording}]"]
    assert [p.role for p in layout.parameters if "." in p.name] == ["effect"] * 5


def law(effect_id: str, *parameters: EffectParameter) -> Effect:
    return replace(BY_ID["quadratic_drag"], id=effect_id, parameters=parameters)


def test_parameters_of_laws_follow_the_slots_in_the_order_of_the_effects():
    def one(s: object) -> float:
        return 1.0

    first = law(
        "one",
        EffectParameter("size", "N", one),
        EffectParameter("constant", "1", one, fixed=7.0),
        EffectParameter("split", "m", one, scope="case"),
    )
    second = law("two", EffectParameter("phase", "rad", one, scope="recording"))
    layout = build_layout(campaign(), (first, BY_ID["coulomb_friction"], second))
    values = {name: float(i + 1) for i, name in enumerate(layout.names)}
    assert "one.constant" not in values
    q = layout.slots(np.array(list(values.values())))
    for r, (recording, case) in enumerate(zip("abc", "xyx", strict=True)):
        tail = [values["one.size"], 7.0, values[f"one.split[{case}]"]]
        assert list(q[r, len(SLOTS) :]) == [*tail, values[f"two.phase[{recording}]"]]
        assert q[r, SLOTS.index("friction")] == values["coulomb_friction.force"]


def test_an_effect_without_parameters_sets_a_slot():
    q = build_layout(campaign(), (BY_ID["contact_no_tension"],)).slots(np.zeros(16))
    assert list(q[:, SLOTS.index("no_tension")]) == [1.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("m", "rad"), ("m/s", "rad/s"), ("N/m", "N m/rad"), ("N s/m", "N m s/rad"), ("s", "s"),
        ("N s2/m2", "N m s2/rad2"), ("kg", "kg m2"), ("1/m2", "1/rad2"), ("N", "N m"), ("Hz", "Hz"),
    ],
)  # fmt: skip
def test_units_of_angles(unit, expected):
    assert angular(unit) == expected


def test_recordings_of_angles_have_angular_units():
    layout = build_layout(campaign(stop=False, quantity="angle"), (BY_ID["quadratic_drag"],))
    units = {p.name: p.unit for p in layout.parameters}
    assert units["k1"] == "N m/rad" and units["y0[a]"] == "rad" and units["sigma"] == "rad"
    assert units["quadratic_drag.coefficient"] == "N m s2/rad2"


def test_what_does_not_go_together_is_refused():
    friction = BY_ID["coulomb_friction"]
    with pytest.raises(InputError, match="one effect a slot"):
        build_layout(campaign(), (friction, replace(friction, id="other")))
    with pytest.raises(InputError, match="slot 'nothing'"):
        build_layout(campaign(), (replace(friction, binds={"nothing": "force"}),))
    with pytest.raises(InputError, match="stop"):
        build_layout(campaign(stop=False), (BY_ID["gap_wear"],))
    with pytest.raises(KeyError, match="k9"):
        build_layout(campaign()).index("k9")
