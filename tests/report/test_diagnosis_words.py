"""Sizes, shifts and sentences of a diagnosis."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.remainder import Remainder
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.report.diagnosis.document import _explained
from bayesimpact.report.diagnosis.summary import Findings, summary
from bayesimpact.report.diagnosis.view import _location
from bayesimpact.report.diagnosis.words import (
    ParameterShift,
    failure,
    left_open,
    nearest,
    noise_words,
    parameter_shift,
    parameter_shifts,
    remaining,
    scatter_words,
    statement,
)


def told(*args: object, **more: object) -> str:
    return summary(Findings(*args, **more))


def entry(median: float, half: float) -> dict[str, object]:
    return {"median": median, "ci90": [median - half, median + half]}


def test_shifts_are_what_adding_does():
    before = {"k1": entry(808.0, 1.0), "k2[1]": entry(5300.0, 10.0), "y0[a]": entry(1.0, 0.1)}
    after = {"k1": entry(809.0, 1.0), "k2[1]": entry(5035.0, 10.0), "y0[a]": entry(2.0, 0.1)}
    shifts = parameter_shifts(before, after)  # k1 has not moved beyond its intervals
    assert shifts == {"k2[1]": ParameterShift(pytest.approx(-0.05))}
    assert parameter_shifts({"g": entry(1.0, 0.1)}, {}) == {}


def test_a_wide_interval_proves_its_nearer_end_only():
    """Once told: "c1 was 99 % too low" beside a 90 % interval of 0.45 to 14."""
    old = {"median": 0.025, "ci90": [0.0249, 0.0251]}
    assert parameter_shift(old, {"median": 2.0, "ci90": [0.45, 3.0]}) == ParameterShift(
        pytest.approx(17.0), least=True
    )
    # a normal law cut at zero: nothing is likelier than what its interval leaves out there
    assert parameter_shift(old, {"median": 5.0, "ci90": [0.45, 14.0]}) is None
    assert parameter_shift(old, {"median": 2.0, "ci90": [0.024, 3.0]}) is None
    said = told(
        "partly", (BY_ID["coulomb_friction"],), ("",), place("free"), (),
        {"c1": ParameterShift(17.0, least=True), "k1": ParameterShift(0.058)}, "",
    )  # fmt: skip
    assert "Adding it raises k1 by 5.8 %" in said and "c1" not in said
    said = told("unknown", (), (), place("free"), (), {"c1": ParameterShift(17.0, least=True)}, "")
    assert "Fitting a force in its place raises c1 to at least 18 times its value" in said


def test_a_size_that_is_left_open_says_so():
    cubic, name = BY_ID["spring_cubic"], "spring_cubic.stiffness"
    wide = {name: {"unit": "N m/rad3", "median": 6.1, "ci90": [-8.2, 20.6]}}
    said = left_open(cubic, wide)
    assert said == (
        " What remains leaves that open: its stiffness may be \N{MINUS SIGN}8 to 21 N m/rad³."
    )
    assert left_open(cubic, {name: {"unit": "N/m3", "median": 6.1, "ci90": [5.0, 7.0]}}) == ""
    assert left_open(BY_ID["pendulum_sine"], wide) == ""  # it has no size of its own


@pytest.mark.parametrize("effect_id", BY_ID)
def test_every_effect_has_its_sentence(effect_id):
    text = statement(BY_ID[effect_id], "3 N", 0.012)
    assert "{" not in text and ("3 N" in text or "{size}" not in BY_ID[effect_id].statement)


def test_what_remains_is_said_in_units():
    left = Remainder(1.3e-4, 0.022, 11.2, "contact", (1e-3, 2e-3), ("a",), "gap_wear")
    said = remaining(left)
    assert "0.13 mm rms" in said and "2.2 % of the signal" in said and "11 times" in said
    assert "obstacle" in said and "likeliest: a gap that grows at every impact" in said
    assert remaining(None) == "" and "130 µrad" in remaining(left, "rad")
    assert "likeliest" not in remaining(replace(left, guess=""))
    formula = "a force A v^2 + B exp(-((y + 1 mm)/2 mm)^2) sign(v)"
    assert f"; likeliest: {formula}." in remaining(replace(left, guess=formula))


def fit_of(rms: float, *inputs: object):
    recordings = tuple(SimpleNamespace(input=i) for i in inputs)
    campaign = SimpleNamespace(recordings=recordings)
    density = SimpleNamespace(oscillator=SimpleNamespace(campaign=campaign))
    return SimpleNamespace(rms=rms, signal=1.0, density=density)


def test_a_failed_base_fit_says_what_may_be_wrong():
    known, free = SimpleNamespace(free=False), SimpleNamespace(free=True)
    assert failure(fit_of(0.4, known)) == ""
    assert "sign, unit or clock" in failure(fit_of(0.6, None))
    assert "input" not in failure(fit_of(0.6, None))
    assert "wrong sign" not in failure(fit_of(0.6, None), explained=True)
    assert "half of the signal" in failure(fit_of(0.6, None), explained=True)
    assert 'gain = "free"' in failure(fit_of(0.6, None, known))
    said = failure(fit_of(0.6, free))
    assert "sign, delay or kind of the input" in said and "gain" not in said


def test_slow_noise_is_said_where_a_model_s_residual_showed_it():
    assert noise_words(Noise()) == noise_words(Noise(0.4)) == ""
    said = noise_words(Noise(0.96, others=((0.0, 0.4),), is_independent=False))
    assert "60 % AR(1), correlation 0.96, 40 % white" in said


def test_scatter_beyond_the_noise_is_said_where_nothing_explains_it() -> None:
    """Once told "down to the noise" of readings that scattered by a third more than that."""

    def left(chi2: float) -> str:
        likelihood = SimpleNamespace(noise=Noise(level_error=0.06))
        fit = SimpleNamespace(reduced_chi2=chi2, density=SimpleNamespace(likelihood=likelihood))
        return scatter_words(fit)

    assert left(1.3) == "" and "1.3 times as much as their noise" in left(1.7)
    assert "down to the noise" in told("adequate")
    for verdict, effects, others in (
        ("adequate", (), ()),
        ("ambiguous", (BY_ID["spring_cubic"],), ("spring_quintic",)),
        ("named", (BY_ID["spring_cubic"],), ()),
    ):
        said = told(verdict, effects, ("",), place("free"), others, scatter=left(1.7))
        assert "times as much" in said and "down to the noise" not in said


def test_noise_that_grows_is_said_where_a_model_s_residual_showed_it():
    """What windows of the recordings tell beforehand is no surprise of the model's."""
    assert noise_words(Noise(level=2e-3, growth=(0.0, 9.5))) == ""
    said = noise_words(Noise(level=2e-3, growth=(0.0, 9.5), is_independent=False))
    assert "time stamps that jitter by 19 ms" in said and "% of it" not in said
    said = noise_words(Noise(level=2e-3, growth=(10.0, 0.0), is_independent=False))
    assert "is larger, by 2 % of it" in said and "jitter" not in said


@pytest.mark.parametrize(
    ("verdict", "effects", "left", "explained"),
    [
        ("named", 1, 0.01, True),
        ("partly", 1, 0.1, True),
        ("partly", 1, 0.6, False),
        ("ambiguous", 1, 0.1, True),
        ("unknown", 0, 0.1, False),
    ],
)
def test_reasons_of_a_failed_base_fit_are_told_where_no_name_explains_it(
    verdict, effects, left, explained
):
    found = SimpleNamespace(verdict=verdict, effects=(None,) * effects, after=fit_of(left, None))
    assert _explained(found) == explained


def place(regime: str):
    return SimpleNamespace(
        regime=regime, displacement=(-2e-3, 1.5e-3), force_rms=0.012, force_sd=0.001
    )


def test_the_paragraph():
    friction = (BY_ID["coulomb_friction"],)
    shifts = {
        "k1": ParameterShift(0.2),
        "k2[1]": ParameterShift(-0.082),
        "k2[2]": ParameterShift(0.03),
    }
    said = told("adequate", (), (), None, (), {}, "Limits.")
    assert said.startswith("Nothing is missing") and said.endswith("Limits.")
    said = told("named", friction, ("It rubs.",), place("free"), (), shifts, "")
    assert "dry friction" in said and "It rubs." in said and "suspension" in said
    assert "Adding it lowers k2[1] by 8.2 %" in said
    said = told("ambiguous", friction, ("",), place("contact"), ("gap_wear + own",), shifts, "")
    assert (
        "a gap that grows at every impact and own" in said
        and "cannot tell" in said
        and "obstacle" in said
    )
    said = told("unknown", (), (), place("contact"), (), {"k1": ParameterShift(0.04)}, "")
    assert "\N{MINUS SIGN}2.0 to 1.5 mm" in said and "0.012 N rms" in said
    assert "raises k1 by 4.0 %" in said and said.startswith("Something is missing that the cat")
    said = told("unknown", (), (), place("contact"), (), {}, "", finished=False)
    assert said.startswith("Something is missing that the search has not found.")
    said = told("named", friction, ("It rubs.",), place("free"), (), {}, "", band_limited=True)
    assert 'hold = "band_limited"' in said
    said = told("partly", friction, ("It rubs.",), place("free"), (), {}, "", " More.")
    assert said.startswith("Dry friction is needed by every likely model")
    assert "It rubs." in said and said.endswith(" More.") and "nothing proves" not in said
    said = told("partly", friction, ("It rubs.",), place("free"), unproved=("a hum", "a bias"))
    assert said.endswith(" The fitted model holds a hum and a bias too, which nothing proves.")
    said = told("unknown", (), (), place("contact"), unproved=("a hum",))
    assert said.endswith(" The fitted model holds a hum, which nothing proves.")
    said = told("partly", (), (), place("contact"), (), {}, "", faults=" A spike.")
    head = "Faults of recordings are set aside or corrected. A spike. The rest is unknown."
    assert said.startswith(head)
    assert said.count("A spike.") == 1 and "catalogue does not hold" not in said
    said = told("partly", friction, ("It rubs.",), place("free"), finished=False)
    assert said.startswith("Dry friction is needed by every likely model that was tried, but")
    said = told("named", friction, ("It rubs.",), place("free"))
    assert said.startswith("The base model leaves out dry friction")
    said = told("ambiguous", friction, ("It rubs.",), place("free"), finished=False)
    assert said.startswith("Likeliest of what was compared, the base model leaves out dry friction")
    wide = SimpleNamespace(
        regime="free", displacement=(-0.3, 0.31), force_rms=0.012, force_sd=0.001
    )
    said = told("unknown", (), (), wide, (), {}, "", angle=True)
    assert "\N{MINUS SIGN}0.30 to 0.31 rad" in said and "0.012 N m rms" in said


def test_likely_sets_are_told_by_what_they_share_and_what_they_differ_in():
    effects = (BY_ID["input_delay"], BY_ID["coulomb_friction"])
    sets = ("input_delay + quadratic_drag", "input_delay")
    said = told("ambiguous", effects, ("", ""), place("measurement"), sets)
    assert said.startswith("Delay of the measured input is needed by every likely model. Beside it")
    assert "likeliest is dry friction" in said and "from quadratic drag or nothing more." in said
    many = ("gap_wear", "spring_cubic", "quadratic_drag", "sensor_hum", "power_damping")
    said = told("ambiguous", effects, ("", ""), place("measurement"), many)
    assert said.startswith("Something is missing; the likeliest is delay of the measured input and")
    assert "quadratic drag or 2 other sets of effects." in said and "hum" not in said
    said = told("ambiguous", effects[:1], ("",), place("measurement"), ("sensor_hum",))
    assert "missing in the measuring chain, not in the mechanics; the likeliest" in said


def test_a_second_mode_is_mechanics():
    """The probe reads it beside the oscillator's motion; a hum is the chain's."""
    for effect, where in (
        ("released_mode", "which the probe sees beside"),
        ("sensor_hum", "chain"),
    ):
        said = told("named", (BY_ID[effect],), ("",), place("measurement"))
        assert where in said
        assert ("not in the mechanics" in said) is (effect == "sensor_hum")


def test_a_group_of_which_one_is_needed_is_told():
    cubic, sine, five = (BY_ID[i] for i in ("spring_cubic", "pendulum_sine", "spring_quintic"))
    said = told("unknown", (), (), place("free"), either=((cubic, sine),))
    assert "holds. Either cubic stiffness of the suspension or gravity pendulum is needed" in said
    friction = (BY_ID["coulomb_friction"],)
    said = told("partly", friction, ("It rubs.",), place("free"), either=((cubic, sine, five),))
    assert "rubs. Cubic stiffness of the suspension, gravity pendulum or quintic" in said


@pytest.mark.parametrize(
    ("family", "words"),
    [
        ("free damping", "Damping of the suspension that is not viscous is needed"),
        ("own", "Something of the family 'own' is needed"),
    ],
)
def test_a_family_of_which_some_are_needed_is_told(family: str, words: str):
    members = tuple(BY_ID[i] for i in ("quadratic_drag", "coulomb_friction"))
    said = told("unknown", (), (), place("free"), families={family: members})
    assert f"More is missing than the catalogue holds. {words} by every likely model: " in said
    assert "quadratic drag or dry friction, or several of these; the recordings cannot" in said


def test_what_a_model_with_more_effects_does_is_not_said_of_those_named():
    friction, shifts = (BY_ID["coulomb_friction"],), {"k1": ParameterShift(0.2)}
    for more, cause in ((True, "The fitted model raises"), (False, "Adding it raises")):
        assert cause in told("partly", friction, ("",), place("free"), (), shifts, more=more)


def test_a_force_that_is_hardly_known_has_no_size():
    vague = SimpleNamespace(
        regime="free", displacement=(-2e-3, 1.5e-3), force_rms=3.5, force_sd=3.25
    )
    said = told("unknown", (), (), vague, (), {}, "")
    assert "do not tell (0 to 10 N rms)" in said and "3.5" not in said
    vague.force_rms = None
    assert "size so large a misfit does not tell." in told("unknown", (), (), vague, (), {}, "")


def test_a_force_is_told_with_or_without_what_base_parameters_imitate():
    for beyond, word in ((True, "without"), (False, "with")):
        place = {"regime": "free", "force_rms_n": 0.5, "beyond_base": beyond}
        assert f"N, {word} what" in dict(_location({"location": place}, "m"))["force, rms"]
    place["force_rms_n"] = None
    assert "force, rms" not in dict(_location({"location": place}, "m"))


def test_what_comes_nearest():
    sets = [
        ("sensor_quadratic", 0.6),
        ("coulomb_friction + gap_wear", 0.33),
        ("spring_cubic", 0.01),
    ]
    said = nearest(sets)
    assert "(60 %) or dry friction and a gap that grows at every impact (33 %) come near" in said
    assert "cubic" not in said and " (60 %) comes nearest" in nearest(sets[:1])
    assert nearest(sets[2:]) == nearest([]) == ""


def test_what_may_be_the_probe_s_is_not_said_to_act_in_the_mechanics():
    said = told("unknown", (), (), place("free"), (), {}, "", drifts=True, probe=True)
    assert "Seen as a force it would act in the suspension" in said and "It acts" not in said
    assert "It may be a stiffness" in said
    said = told("unknown", (), (), place("free"), (), {}, "")
    assert "It acts in the suspension" in said and "stiffness" not in said
    said = told("unknown", (), (), place("measurement"), (), {}, "", probe=True)
    assert "It acts in the measuring chain" in said


def test_recordings_keep_their_truth(small):
    """The helpers above leave the shared fit as it was."""
    assert small.fit.value("k1") == pytest.approx(small_rig.RIG.k1, rel=1e-3)
