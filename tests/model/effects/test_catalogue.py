"""The catalogue: complete, in the right words, consistent with the contract and with itself."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from effect_rigs import BY_ID, TestRig

import bayesimpact.model.effects as package
from bayesimpact.diagnosis.refits.size import yardstick
from bayesimpact.errors import InputError
from bayesimpact.inference.defaults import effect_prior
from bayesimpact.model.effects import EFFECTS, Scales
from bayesimpact.model.effects.catalogue import listing
from bayesimpact.model.parameters import SLOTS, angular, build_layout

HEADS = ("Equation", "At its null", "Energy", "Valid", "Its absence shows", "Source", "Status")
PROMISED = [
    "contact_damping_indentation",
    "contact_damping_speed",
    "contact_damping_per_case",
    "contact_hardening",
    "contact_power_law",
    "contact_second_stage",
    "contact_no_tension",
    "contact_relaxation",
    "obstacle_mass",
    "gap_wear",
    "gap_per_recording",
    "coulomb_friction",
    "quadratic_drag",
    "spring_quadratic",
    "spring_cubic",
    "stiffness_drift",
    "harmonic_forcing",
    "opposite_stop",
    "sensor_drift",
    "sensor_quadratic",
    "sensor_cubic",
    "sensor_hum",
    "smoothing",
    "pendulum_sine",
    "spring_quintic",
    "spring_piecewise",
    "power_damping",
    "structural_damping",
    "presliding_friction",
    "hysteresis_bouc_wen",
    "hunt_crossley",
    "obstacle_mode",
    "obstacle_restitution",
    "second_mode",
    "base_motion",
    "adhesion",
]  # ids by which scripts outside the project know effects
DISSIPATIVE = {
    "contact_damping_indentation.coefficient", "contact_damping_speed.coefficient",
    "contact_relaxation.stiffness", "contact_second_stage.stiffness", "obstacle_mass.mass",
    "gap_wear.step", "coulomb_friction.force", "quadratic_drag.coefficient",
    "opposite_stop.stiffness", "spring_piecewise.stiffness", "spring_piecewise.damping",
    "power_damping.coefficient", "structural_damping.loss",
    "obstacle_mode.mass", "base_motion.mass_ratio", "hysteresis_bouc_wen.stiffness",
    "presliding_friction.force", "adhesion.force",
}  # fmt: skip
OF_ANGLES = {"pendulum_sine", "pendulum_with_spring"}
SIGNED = {
    "contact_hardening.stiffness", "spring_quadratic.stiffness", "spring_cubic.stiffness",
    "stiffness_drift.rate", "sensor_drift.rate", "sensor_quadratic.gain", "sensor_cubic.gain",
    "contact_stiffness_drift.rate",
    "spring_quintic.stiffness", "second_mode.gain",
}  # fmt: skip


def test_promised_ids_keep_their_meaning():
    """More may come; parameters' names are checked where they are used."""
    titles = {effect.id: effect.title for effect in EFFECTS}
    assert set(PROMISED) <= set(titles)
    assert len(set(titles.values())) == len(titles)


def test_every_file_answers_every_question_in_order():
    for path in Path(package.__file__).parent.glob("*.py"):
        if path.stem in ("__init__", "effect", "catalogue"):
            continue
        words = ast.get_docstring(ast.parse(path.read_text())) or ""
        places = [words.find(f"\n{head}") for head in HEADS]
        assert -1 not in places, (path.name, places)
        assert places == sorted(places), path.name
        assert path.stem in BY_ID, f"{path.name} is not registered"
        summary = words.partition("\n\n")[0]
        assert len(summary) > 20 and summary[-1] in ".:", path.name


def test_a_listing_tells_every_parameter_that_would_be_estimated():
    assert listing(replace(BY_ID["spring_cubic"], id="of_my_own"))[-1] == (
        "    of_my_own.stiffness (N/m3, vanishes at 0)"
    )
    gap, *_ = listing(BY_ID["gap_per_recording"])[2:]
    assert (
        gap == "    gap_per_recording.g[recording] (m, vanishes at all equal g, one per recording)"
    )
    for effect in EFFECTS:
        told = " ".join(listing(effect))
        assert all((f".{p.name}" in told) == (p.fixed is None) for p in effect.parameters)


def test_bounds_are_physics():
    parameters = {f"{e.id}.{p.name}": p for e in EFFECTS for p in e.parameters}
    for name in DISSIPATIVE:
        assert (parameters[name].lower, parameters[name].null) == (0.0, 0.0)
    for name in SIGNED:
        assert (parameters[name].lower, parameters[name].null) == (-np.inf, 0.0)
    exponent = parameters["contact_power_law.exponent"]
    assert (exponent.lower, exponent.null) == (0.5, 1.0)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.id)
def test_sentence_and_slots(effect):
    text = effect.statement.format(size="1 N", share="2 %")
    assert "1 N" in text and "2 %" in text and text.endswith(".")
    assert set(effect.binds) | set(effect.sets) <= set(SLOTS)
    for name in effect.binds.values():
        assert effect.parameter(name)
    assert effect.prefer is None or effect.prefer in BY_ID
    assert sum(x is not None for x in (effect.law, effect.observe)) <= 1
    acts = effect.law or effect.observe or effect.binds or effect.sets
    assert acts


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.id)
def test_priors_scale_with_the_rig(effect):
    """The same rig in other units of length, mass and time gives the same priors in those units."""
    length, mass, time = 1e3, 1e-2, 50.0
    ours = TestRig().scales()
    exponents = {
        "mass": (0, 1, 0), "stiffness": (0, 1, -2), "damping": (0, 1, -1),
        "contact_stiffness": (0, 1, -2), "contact_damping": (0, 1, -1), "amplitude": (1, 0, 0),
        "speed": (1, 0, -1), "indentation": (1, 0, 0), "impact_speed": (1, 0, -1),
        "duration": (0, 0, 1), "interval": (0, 0, 1), "gap": (1, 0, 0),
    }  # fmt: skip
    scaled = {
        k: getattr(ours, k) * length**a * mass**b * time**c for k, (a, b, c) in exponents.items()
    }
    theirs = Scales(**scaled, impacts=ours.impacts, cases=ours.cases, recordings=ours.recordings)
    units = {"N": (1, 1, -2), "s": (0, 0, 1), "s2": (0, 0, 2), "m": (1, 0, 0), "kg": (0, 1, 0),
             "m2": (2, 0, 0), "m3": (3, 0, 0), "m5": (5, 0, 0), "1": (0, 0, 0), "-": (0, 0, 0),
             "rad": (0, 0, 0), "Hz": (0, 0, -1), "s1.5": (0, 0, 1.5),
             "m1.5": (1.5, 0, 0)}  # fmt: skip
    for parameter in effect.parameters:
        unit = parameter.unit
        if (effect.id, parameter.name) == ("power_damping", "coefficient"):
            assert unit == "N at 1 m/s"
            unit = "N s1.5/m1.5"  # its scale: that of c at the middle of the exponents
        above, _, below = unit.partition("/")
        power = np.zeros(3)
        for part, sign in ((above, 1), (below, -1)):
            for word in part.split():
                power += sign * np.array(units[word])
        expected = parameter.scale(ours) * np.prod(np.array([length, mass, time]) ** power)
        if effect.id == "sensor_hum" and parameter.name == "frequency":
            continue  # the mains do not scale
        assert parameter.scale(theirs) == pytest.approx(expected, rel=1e-12)
        assert parameter.scale(ours) > 0
        prior = effect_prior(parameter, ours)
        assert np.isfinite(prior.log_density(np.array(prior.ppf(np.array(0.4)))))


def test_shapes_have_grids_within_their_bounds():
    scales = TestRig().scales()
    for effect in EFFECTS:
        shapes = [p for p in effect.parameters if p.is_shape]
        assert shapes == [p for p in effect.parameters if p.grid is not None]
        grids = [p.grid(scales) for p in shapes if p.grid is not None]
        assert not shapes or max(values.size for values in grids) >= 4
        for parameter, values in zip(shapes, grids, strict=True):
            assert values.size >= 2
            assert np.all((values >= parameter.lower) & (values <= parameter.upper))
            low, high = effect_prior(parameter, scales).support
            assert np.all((values >= low) & (values <= high))


def test_two_names_of_one_law_hold_in_ranges_that_meet():
    """x of presliding_friction is one over the decay of hysteresis_bouc_wen."""
    scales = TestRig().scales()
    way = BY_ID["presliding_friction"].parameter("displacement").within
    decay = BY_ID["hysteresis_bouc_wen"].parameter("decay").within
    assert way is not None and decay is not None
    assert way(scales)[1] == pytest.approx(1 / decay(scales)[1], rel=1e-12)
    assert all(p.within is None or p.is_shape for e in EFFECTS for p in e.parameters)


def test_admissible_only_where_it_could_show():
    scales = TestRig().scales()
    free = {"released_mode"}  # rings down from a release, which an impact is none of
    assert {e.id for e in EFFECTS if not e.admissible(scales)} == {*OF_ANGLES, "input_delay"} | free
    scales = replace(scales, angle=True, driven=True)
    assert {e.id for e in EFFECTS if not e.admissible(scales)} == free
    silent = replace(scales, impacts=0)
    of_any = {e.id for e in EFFECTS if not e.needs_stop}
    assert {e.id for e in EFFECTS if e.admissible(silent)} == of_any - free
    assert {e.id for e in EFFECTS if e.admissible(replace(silent, driven=False))} == of_any - {
        "input_delay"
    }
    assert not BY_ID["gap_wear"].admissible(replace(scales, impacts=1))
    assert not BY_ID["contact_damping_per_case"].admissible(replace(scales, cases=1))
    assert not BY_ID["gap_per_recording"].admissible(replace(scales, recordings=1))


def test_families_hold_the_near_neighbours():
    families: dict[str, set[str]] = {}
    for effect in EFFECTS:
        families.setdefault(effect.family, set()).add(effect.id)
    for pair in (
        ("contact_damping_speed", "contact_damping_indentation"),
        ("contact_power_law", "contact_second_stage"),
        ("contact_hardening", "contact_power_law"),
        ("hunt_crossley", "contact_power_law"),
        ("spring_cubic", "opposite_stop"),
        ("opposite_stop", "spring_piecewise"),
        ("obstacle_mass", "contact_relaxation"),
        ("obstacle_mass", "obstacle_restitution"),
        ("adhesion", "obstacle_mass"),
        ("coulomb_friction", "quadratic_drag"),
        ("quadratic_drag", "power_damping"),
        ("power_damping", "structural_damping"),
        ("coulomb_friction", "presliding_friction"),
        ("presliding_friction", "hysteresis_bouc_wen"),
        ("spring_cubic", "pendulum_sine"),
        ("spring_cubic", "spring_quintic"),
    ):
        assert any(set(pair) <= family for family in families.values())


def test_an_obstacle_effect_needs_an_obstacle():
    campaign = TestRig(k2=()).campaign()
    for effect in EFFECTS:
        if effect.needs_stop:
            with pytest.raises(InputError, match=effect.id):
                build_layout(campaign, [effect])


def test_units_of_angles():
    found = {angular(p.unit) for e in EFFECTS for p in e.parameters}
    assert not any(re.search(r"\bm\d?\b", unit.replace("N m", "").replace("kg m2", ""))
                   for unit in found)  # fmt: skip


def test_laws_that_are_said_to_ignore_the_speed_do():
    """And no law without memory that does is forgotten: it would take six evaluations a step."""
    rng, q = np.random.default_rng(0), np.full(len(SLOTS), 2.0)
    for effect in EFFECTS:
        if effect.law is None:
            continue
        p = np.full(8, 1.3)
        changes = 0.0
        for y, v, w in rng.normal(size=(20, 3)):
            for z in (-0.1, 0.1):
                d = abs(y)
                one, other = (effect.law.force(y, x, d, 0.7, z, 1.0, p, q) for x in (v, w))
                changes = max(changes, abs(one - other))
        remembers = effect.law.rate is not None
        assert effect.law.ignores_speed == (changes == 0.0 and not remembers), effect.id


def test_laws_that_are_said_to_depend_on_time_do():
    q, p = np.full(len(SLOTS), 2.0), np.full(8, 1.3)
    for effect in EFFECTS:
        if effect.law is not None:
            one, other = (effect.law.force(0.3, 0.4, 0.3, t, 0.1, 1.0, p, q) for t in (0.7, 1.9))
            assert effect.law.of_time == (one != other), effect.id


def test_the_spread_of_contact_damping_is_told_as_a_share_of_its_mean():
    """A base fit with c2 = 0 has no yardstick of its own."""
    size = BY_ID["contact_damping_per_case"].size
    assert size is not None
    assert size((1.0, 3.0), None) == (2.0, "N s/m", 1.0)
    assert size((0.0, 0.0), None) == (0.0, "N s/m", 0.0)


def test_a_share_is_of_what_the_effect_says_itself():
    assert yardstick(BY_ID["gap_wear"]) == "the deepest indentation"
    assert yardstick(BY_ID["contact_damping_per_case"]) == "their mean"
    assert yardstick(BY_ID["contact_hardening"]) == "the peak contact force"
    assert all(yardstick(effect) for effect in EFFECTS)
