"""The story on one page: every answer, in the order of the questions, from the document alone."""

from __future__ import annotations

from dataclasses import replace

import pytest
from diagnosed import DIAGNOSIS, LIMITS, diagnosed, estimate
from markupsafe import Markup
from test_report_html import page

from bayesimpact.formula.grammar import Power, Term
from bayesimpact.formula.law import effect_of
from bayesimpact.report.diagnosis.story import corrected, story_rows
from bayesimpact.report.diagnosis.view import diagnosis_view
from bayesimpact.report.latex import latex_tables
from bayesimpact.report.results import EffectSummary, Results


def told(results: Results) -> dict[str, str]:
    """Question -> answer as text without tags."""
    rows = {q: " / ".join(map(str, lines)) for q, lines in story_rows(results)}
    plain = {q: Markup(text).striptags() for q, text in rows.items()}
    return {q: text.replace("\N{NO-BREAK SPACE}", " ") for q, text in plain.items()}


STIFF = {
    "before": {"k1": estimate(808.6, 0.005, "N/m"), "k2[1]": estimate(5358.17, 0.5, "N/m")},
    "after": {"k1": estimate(808.56, 0.006, "N/m"), "k2[1]": estimate(5349.0, 0.8, "N/m")},
}


def test_every_question_of_a_named_effect() -> None:
    story = told(diagnosed())
    assert list(story) == ["verdict", "place", "physics", "size", "improvement"]
    assert story["verdict"] == "What is missing is named"
    assert "wherever the mass moves" in story["place"]
    assert "shows in run_0; case 1" not in story["place"]
    assert "dry friction, probability > 0.999" in story["physics"]
    assert "force = 160 (150 to 170) µN" in story["size"]
    assert "+320 ± 79" in story["improvement"]


def test_a_residual_at_the_noise_is_no_improvement() -> None:
    """Once "5.06 µm → 5.02 µm (−0.82 %)" as the headline, beside a noise of 5.01 µm."""
    small = told(diagnosed(parameters=STIFF))["improvement"]
    assert small == "recordings held out: log score +320 ± 79 / k2[1] −0.17 %"
    large = told(diagnosed(fit={"before": {"rms_m": 9e-6}, "after": {"rms_m": 5e-6}}))
    assert "residual rms 9.00 µm → 5.00 µm (−44 %)" in large["improvement"]


def test_the_place_is_that_of_the_named_effects_and_not_of_a_fault() -> None:
    place = {"displacement_m": [-1e-3, 2e-3], "velocity_m_s": [-0.1, 0.1]}
    gap, damping, fault = (
        {**DIAGNOSIS["effects"][0], "id": i, "family": f, "location": {**place, "regime": where}}  # type: ignore[dict-item, index]
        for i, f, where in (
            ("gap_wear", "gap", "entry"),
            ("contact_damping_speed", "contact damping", "contact"),
            ("recording_start", "recording", "measurement"),
        )
    )
    location = {**place, "regime": "everywhere"}
    for effects, words in (
        ([gap, damping], "contact with the stop, at"),
        ([gap, fault], "the beginning of contact, at"),
        ([fault], "the whole motion, at"),
    ):
        results = diagnosed(effects=effects, location=location)
        assert told(results)["place"].startswith(words)
        regime = dict(diagnosis_view(results)["location"])["regime"]
        assert regime == words.removesuffix(", at"), "the details said another place"


def test_unlikely_alternatives_are_not_told_first() -> None:
    """Five below 0.001 stood under the words "several explanations fit alike"."""
    other = {"id": "obstacle_mass", "probability": 0.002, "delta_log_evidence": 1.0}
    results = diagnosed(verdict="ambiguous", alternatives=[other])
    story = told(results)
    assert "mass of the obstacle" not in story["physics"]
    assert story["verdict"] == "One explanation leads, but others are not ruled out"
    assert page(results)[1].text.count("mass of the obstacle") == 1  # in the details
    likely = told(diagnosed(verdict="ambiguous", alternatives=[{**other, "probability": 0.2}]))
    assert "or mass of the obstacle, probability 0.20" in likely["physics"]
    assert likely["verdict"] == "Several explanations fit alike"


def test_the_story_comes_before_everything_else() -> None:
    source, parsed = page(diagnosed(parameters=STIFF))
    text = parsed.text
    marks = ("What is missing is named", "corrected", "5358.2", "5349.0", "recordings 3",
             "Diagnosis: what is missing", "Parameters Medians")  # fmt: skip
    places = [text.index(mark) for mark in marks]
    assert places == sorted(places) and source.count('class="story"') == 1


def test_corrected_stiffness_comes_first() -> None:
    assert corrected({"parameters": STIFF}) == ["k2[1]"]
    free = {side: {"k1": values["k1"], "sigma": values["k1"]} for side, values in STIFF.items()}
    assert corrected({"parameters": free}) == ["k1"]


def test_parameters_stand_under_words_and_not_under_ids() -> None:
    """Once `gap_wear` and "gap wear: step" in the story, "recording start: size[r4]" of a fault."""
    gap = {
        **DIAGNOSIS["effects"][0],  # type: ignore[dict-item, index]
        "id": "gap_wear",
        "parameters": {"gap_wear.step": estimate(8.6e-8, 6e-9, "m")},
    }
    start = {
        **gap,
        "id": "recording_start",
        "title": "start",
        "family": "recording",
        "parameters": {"recording_start.size[r4]": estimate(0.016, 0.0, "s")},
        "size": {"value": 0.016, "unit": "s"},
        "location": {"recordings": ["r4"]},
    }
    results = diagnosed(effects=[gap, start])
    story = told(results)
    assert story["physics"].startswith("a gap that grows at every impact, probability")
    assert "/ step = 0.086 (0.080 to 0.092) µm / start of r4: 0.016 s" in f"/ {story['size']}"
    assert "size[r4]" not in page(results)[1].text and "start of r4" in latex_tables(results)
    for text in (page(results)[1].text, latex_tables(results)):
        assert "gap_wear" not in text and "gap wear" not in text


def test_states_at_the_start_of_recordings_are_no_sizes() -> None:
    own = {"force": estimate(2.2e-3, 2e-4, "N"), "start[r1]": estimate(0.0, 0.9, "-")}
    friction = {
        **DIAGNOSIS["effects"][0],  # type: ignore[dict-item, index]
        "id": "presliding_friction",
        "parameters": {f"presliding_friction.{name}": e for name, e in own.items()},
    }
    results = diagnosed(effects=[friction])
    assert "force = 2.20 (2.00 to 2.40) mN" in told(results)["size"]
    assert "start" not in told(results)["size"] and "start[r1]" not in page(results)[1].text


def test_unknown_physics_is_not_given_a_name() -> None:
    story = told(diagnosed(verdict="unknown", effects=[]))
    assert "no effect of the catalogue" in story["physics"]
    assert "140 µN rms" in story["size"]


def test_sizes_in_units_and_per_cent_and_what_remains() -> None:
    size = {"value": 3.1e-6, "unit": "m", "percent": 0.12, "of": "the deepest indentation"}
    effect = {**DIAGNOSIS["effects"][0], "title": "a gap that grows", "size": size}  # type: ignore[dict-item, index]
    remainder = {
        "rms_m": 2.4e-6, "share_of_signal_percent": 0.11, "over_noise": 0.48, "regime": "exit",
        "displacement_m": [1e-3, 3e-3], "recordings": ["run_1"], "guess": "a rattle",
    }  # fmt: skip
    results = diagnosed(verdict="partly", effects=[effect], remainder=remainder, parameters=STIFF)
    story = told(results)
    assert "something unexplained remains" in story["verdict"]
    assert "a gap that grows: 3.1 µm, 0.12 % of the deepest indentation" in story["size"]
    assert "unexplained: 2.4 µm rms (0.11 % of the signal, 0.48 × the noise)" in story["remains"]
    assert "the end of contact" in story["remains"] and "likely: a rattle" in story["remains"]
    source, parsed = page(results)
    assert "What remains unexplained" in parsed.text and "run_1" in parsed.text
    assert "\N{MINUS SIGN}0.17 %" in parsed.text  # (5349.0 - 5358.17) / 5358.17
    assert 'class="verdict "' in source
    assert "remains" not in told(diagnosed())


def test_formulas_of_a_learned_force() -> None:
    formulas = [{"formula": "a abs(v) v", "unit": "N s2/m2", "log_odds": 12.34, "probability": 0.8}]
    text = page(diagnosed(verdict="unknown", effects=[], formulas=formulas))[1].text
    assert "a abs( v ) v N s²/m² +12.3 0.80" in text
    rooted = [{**formulas[0], "formula": "A |v|^1.5 sign(v)", "unit": "N s1.5/m1.5"}]
    source, _ = page(diagnosed(verdict="unknown", effects=[], formulas=rooted), ("story",))
    assert "N\N{NO-BREAK SPACE}s<sup>1.5</sup>/m<sup>1.5</sup>" in source


ROOT = effect_of(Term("everywhere", speed=Power(1.5, True)), 1.0, 0.01, 1.0, signed=True)
"""A formula that is an effect of a diagnosis."""


@pytest.mark.parametrize("sampled", [False, True])
def test_a_formula_is_typeset_wherever_an_effect_of_the_catalogue_has_its_id(sampled: bool) -> None:
    named = {**DIAGNOSIS["effects"][0], "id": ROOT.id, "title": ROOT.title}  # type: ignore[dict-item, index]
    named["parameters"] = {f"{ROOT.id}.size": estimate(0.01, 0.001, "N")}
    others = [{"id": f"{ROOT.id} + gap_wear", "probability": 0.3, "delta_log_evidence": 1.0}]
    results = replace(
        diagnosed(sampled=sampled, effects=[named], alternatives=others, verdict="ambiguous"),
        effects=(EffectSummary(ROOT.id, ROOT.title, ROOT.equation),),
    )
    source, parsed = page(results, ("story",))
    formula = "<i>A</i> |<i>v</i>|<sup>1.5</sup> sign(<i>v</i>)"
    assert source.count(f"force {formula}") >= 3  # physics, diagnosis, model
    assert "a formula and a gap that grows" in parsed.text
    assert ROOT.id not in parsed.text and ROOT.id.replace("_", " ") not in parsed.text
    latex = latex_tables(results)
    assert r"force $A\,|v|^{1.5}\,\mathrm{sign}(v)$" in latex and "formula" not in latex


def test_alternatives_are_told_when_several_fit_alike() -> None:
    story = told(diagnosed(verdict="ambiguous"))
    assert "or mass of the obstacle, probability 0.010" in story["physics"]
    assert "obstacle_mass" not in told(diagnosed())["physics"]


def test_nothing_missing_says_what_could_hide() -> None:
    story = told(diagnosed(verdict="adequate", location=None, effects=[], limits=LIMITS))
    assert list(story) == ["verdict", "could still hide"]
    assert "c1 by at most 3.2" in story["could still hide"]
    assert "cannot tell: relaxation of the obstacle" in story["could still hide"]
    source, _ = page(diagnosed(verdict="adequate", location=None, effects=[]))
    assert "corrected" not in source and "Before and after" not in source


def test_no_diagnosis_no_story() -> None:
    results = replace(diagnosed(), diagnosis=None)
    assert story_rows(results) == [] and 'class="story"' not in page(results)[0]


def test_a_document_with_nulls_is_told() -> None:
    hollow = {"before": {"rms_m": None}, "after": {}, "held_out_gain": {"value": None, "se": None}}
    location = {**DIAGNOSIS["location"], "share": None}  # type: ignore[dict-item]
    story = told(diagnosed(fit=hollow, location=location, parameters={"before": {}, "after": {}}))
    assert "improvement" not in story and "place" in story


def test_a_parametric_bootstrap_is_told_where_there_is_one() -> None:
    found = {"controls": 20, "false_alarms": 1, "planted": 20, "named": 18, "misnamed": 0}
    story = told(diagnosed(parametric_bootstrap=found))
    assert (
        "of 20" in story["parametric bootstrap"]
        and "1 raised an alarm" in story["parametric bootstrap"]
    )
    assert "18 were named the same" in story["parametric bootstrap"]
    assert "parametric bootstrap" not in told(diagnosed(parametric_bootstrap=None))


REMAINDER = {"rms_m": 2e-6, "share_of_signal_percent": 0.1, "over_noise": 4.0, "regime": "free",
             "displacement_m": [-1e-3, 1e-3], "recordings": ["run_0"],
             "guess": "sensor_quadratic"}  # fmt: skip


def test_a_wide_interval_tells_no_change_that_it_does_not_prove() -> None:
    """Once told: "c1 0 (0 to 0), 5 (0 to 14), +19 000 %, 1.3e5 sd", and a change of k1 inside
    the interval of k1.
    """
    unit = "N m s/rad"
    both = {
        "before": {
            "c1": estimate(0.025223, 6e-5, unit),
            "c2": estimate(0.025223, 6e-5, unit),
            "k1": estimate(6.0888, 2e-4, "N m/rad"),
        },
        "after": {
            "c1": {"unit": unit, "median": 4.8, "ci90": [0.447, 13.95]},
            "c2": {"unit": unit, "median": 1.0, "ci90": [0.447, 1.6]},
            "k1": estimate(6.04, 1.98, "N m/rad"),
        },
    }
    results = diagnosed(verdict="partly", remainder=REMAINDER, parameters=both)
    text = page(results)[1].text
    assert "0.02522 (0.02516 to 0.02528) N m s/rad 4.8 (0.4 to 13.9) N m s/rad" in text
    changes = {p["name"]: p["change"] for p in diagnosis_view(results)["parameters"]}  # type: ignore[index]
    assert changes["c1"] == changes["k1"] == "not clear" and "19 000" not in text
    assert changes["c2"].replace("\N{NO-BREAK SPACE}", " ") == "at least +1700 %"
    assert "likely: quadratic characteristic of the probe" in told(results)["remains"]


def test_what_is_still_seen_is_not_ruled_out() -> None:
    seen = {**LIMITS[0], "id": "spring_cubic", "answer": "present"}
    results = diagnosed(verdict="partly", remainder=REMAINDER, limits=[*LIMITS, seen])
    text = page(results)[1].text
    assert "would explain part of what is left: cubic stiffness of the suspension." in text
    assert text.count("cubic stiffness of the suspension") == 1
    assert "limits do not know of what remains" in text and "could move" not in text
    assert "could move" in page(diagnosed(limits=LIMITS))[1].text


def test_all_better_and_unsure_is_said_so() -> None:
    gain = {"value": 47749.0, "se": 29764.0, "wins": 2, "of": 2, "improved": False}
    text = page(diagnosed(fit={"before": {}, "after": {}, "held_out_gain": gain}))[1].text
    assert "All 2 are predicted better" in text and "no clear improvement" not in text


def test_a_fault_of_a_recording_is_no_part_of_the_physics() -> None:
    spikes = DIAGNOSIS["effects"][0] | {"id": "recording_spikes", "family": "recording"}
    results = diagnosed(verdict="partly", effects=[spikes])
    told_so = "Faults of recordings are set aside or corrected; the rest is unknown"
    assert told(results)["verdict"] == told_so
    view = diagnosis_view(results)
    assert view is not None and view["verdict"] == told_so
    both = diagnosed(verdict="partly", effects=[spikes, *DIAGNOSIS["effects"]])
    assert told(both)["verdict"].startswith("Part of what is missing is named")
