"""The loop end to end on small campaigns: nothing planted, an effect, one outside the catalogue."""

from __future__ import annotations

import importlib
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy import stats

from bayesimpact.data.strict_json import strict
from bayesimpact.diagnosis import loop
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.selection.comparable import Comparable
from bayesimpact.diagnosis.selection.decision import Decision
from bayesimpact.report.diagnosis.document import document

CATALOGUE = tuple(
    BY_ID[i]
    for i in (
        "coulomb_friction", "spring_cubic", "contact_hardening", "contact_damping_speed",
        "sensor_quadratic", "sensor_drift",
    )
)  # fmt: skip
STIFFNESS = 1.5e7  # N/m3: 5 % of the contact force at the deepest indentation
HARDENING = {"contact_hardening": {"stiffness": STIFFNESS}}


def run(seed: int, effects=None, catalogue=CATALOGUE, releases=small_rig.RELEASES) -> Diagnosis:
    campaign = small_rig.record(seed, effects, duration=1.5, releases=releases)
    return diagnose(campaign, rng=np.random.default_rng(0), effects=catalogue, search=False)


@pytest.fixture(scope="module")
def control() -> Diagnosis:
    return run(41)


@pytest.fixture(scope="module")
def named() -> Diagnosis:
    return run(44, HARDENING)


@pytest.fixture(scope="module")
def unknown() -> Diagnosis:
    """Two recordings of the same rig, but nobody has thought of hardening."""
    without = tuple(BY_ID[i] for i in ("coulomb_friction", "sensor_drift"))
    return run(44, HARDENING, without, small_rig.RELEASES[:2])


def written(diagnosis: Diagnosis, **draws) -> dict:
    content = document(diagnosis, seed=3, seconds=1.5, versions={"numpy": "2"}, **draws)
    return json.loads(json.dumps(strict(content), allow_nan=False))


def test_where_nothing_is_proved_the_base_model_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search may have chosen effects that lose to nothing: document and limits know of none."""
    monkeypatch.setattr(loop, "decide", lambda selection: Decision("adequate", ()))
    found = run(44, HARDENING, releases=small_rig.RELEASES[:2])
    assert found.verdict == "adequate" and found.effects == ()
    assert found.after is found.before
    assert {limit.effect_id for limit in found.limits} >= {"contact_hardening"}
    assert written(found)["verdict"] == "adequate"


def physical_z(fit, mean=None, sd=None) -> dict[str, float]:
    mean = fit.mode if mean is None else mean
    sd = fit.sd if sd is None else sd
    truth = small_rig.true_values()
    roles = fit.density.oscillator.layout.roles("physical")
    return {fit.names[i]: (mean[i] - truth[fit.names[i]]) / sd[i] for i in roles}


@pytest.mark.parametrize("kind", ["control", "named", "unknown"])
def test_a_diagnosis_is_one_line_and_can_be_pickled(kind, request):
    """As it must for other processes and notebooks: the same document comes out of it."""
    diagnosis = request.getfixturevalue(kind)
    line = repr(diagnosis)
    assert "\n" not in line and len(line) < 200
    words = [e.id for e in diagnosis.effects] or ["no effect"]
    chi2 = f"{diagnosis.before.reduced_chi2:.4g} to {diagnosis.after.reduced_chi2:.4g}"
    assert [w for w in (diagnosis.verdict, *words, chi2) if w not in line] == []
    again = pickle.loads(pickle.dumps(diagnosis))
    assert repr(again) == line
    assert written(again) == written(diagnosis)


@pytest.mark.parametrize("kind", ["control", "named", "unknown"])
def test_a_search_that_ended_by_its_limit_is_said_whatever_the_verdict(kind, request):
    found = request.getfixturevalue(kind)
    verdict = "ambiguous" if kind == "named" else found.verdict
    ended = replace(found, verdict=verdict, selection=replace(found.selection, finished=False))
    said = "The search ended by its limit: not everything that may be missing was tried."
    assert written(ended)["summary"].endswith(f". {said}")
    assert said not in written(found)["summary"]


def test_nothing_missing(control):
    assert control.verdict == "adequate" and control.effects == ()
    assert control.location is None and control.held_out is None and control.alternatives == ()
    assert control.after is control.before
    assert {x.effect_id for x in control.limits} == {e.id for e in CATALOGUE}
    assert max(map(abs, physical_z(control.before).values())) < 4
    np.testing.assert_array_equal(control.intervals.covariance, control.after.covariance)
    assert control.remains is None


def test_a_concealed_effect_is_named_and_the_parameters_mended(named):
    assert named.before.rms < 1.25 * small_rig.NOISE  # nothing to be seen
    before, after = physical_z(named.before), physical_z(named.after)
    assert max(map(abs, before.values())) > 15 and max(map(abs, after.values())) < 4
    assert named.verdict == "named"
    assert [e.id for e in named.effects] == ["contact_hardening"]
    size = named.after.value("contact_hardening.stiffness")
    sd = named.after.sd[named.after.names.index("contact_hardening.stiffness")]
    assert abs(size - STIFFNESS) < 4 * sd < 0.2 * STIFFNESS
    assert named.location.regime == "contact" and named.location.agrees
    assert named.location.displacement[0] >= small_rig.RIG.g
    assert named.held_out.improved and named.held_out.wins == 3
    assert "contact_hardening" not in {x.effect_id for x in named.limits}
    assert named.selection.chosen.is_white and not named.selection.base.is_white


def test_an_effect_outside_the_catalogue_is_unknown_and_learned(unknown):
    assert unknown.verdict == "unknown" and unknown.effects == ()
    assert unknown.location.regime == "contact" and unknown.location.contact_share > 0.75
    before, after = (f.sums.sum() / small_rig.NOISE**2 for f in (unknown.before, unknown.after))
    assert after < stats.chi2.ppf(1 - 1e-4, 3000) and before - after > 100
    assert unknown.before.rms < 1.1 * small_rig.NOISE  # concealed
    assert unknown.held_out.gain > 20
    # carrying the force along takes most of the bias away
    sd = np.sqrt(np.diag(unknown.intervals.covariance))
    assert unknown.intervals.names == unknown.after.names and unknown.remains is not None
    carried = physical_z(unknown.after, unknown.intervals.mean, sd)
    ignored = physical_z(unknown.before)
    assert max(map(abs, carried.values())) < 0.3 * max(map(abs, ignored.values()))
    assert max(map(abs, carried.values())) < 3.0


def test_intervals_hold_what_comparable_models_make_of_a_parameter(monkeypatch):
    def beside(selection, fit):
        mode = fit.mode.copy()
        mode[fit.names.index("k1")] += 50.0
        return Comparable((replace(fit, mode=mode),), np.full(1, 0.5))

    loop = importlib.import_module("bayesimpact.diagnosis.loop")
    monkeypatch.setattr(loop, "alike_in_misfit", beside)
    without = tuple(BY_ID[i] for i in ("coulomb_friction", "sensor_drift"))
    found = run(44, HARDENING, without, small_rig.RELEASES[:2])
    assert found.remains is not None
    low, _, high = found.intervals.quantiles("k1")
    assert high - low > 2 * stats.norm.ppf(0.95) * 50.0 * np.sqrt(0.5)


TOP = {
    "schema", "verdict", "summary", "location", "effects", "alternatives", "fit", "parameters",
    "limits", "noise", "seed", "seconds", "versions", "data_sha256", "remainder", "formulas",
}  # fmt: skip


@pytest.mark.parametrize("which", ["control", "named", "unknown"])
def test_the_document_has_what_scripts_rely_on(which, request):
    content = written(request.getfixturevalue(which))
    assert set(content) >= TOP
    assert content["schema"] == "bayesimpact/diagnosis/2"
    verdicts = {"control": "adequate", "named": "named", "unknown": "unknown"}
    assert content["verdict"] == verdicts[which]
    assert isinstance(content["summary"], str) and len(content["summary"]) > 40
    for side in ("before", "after"):
        keys = {"rms_m", "reduced_chi2", "whiteness_p", "held_out_log_score"}
        assert set(content["fit"][side]) >= keys
        for name, entry in content["parameters"][side].items():
            low, high = entry["ci90"]
            assert low <= entry["median"] <= high and isinstance(entry["unit"], str), name
    assert set(content["fit"]["held_out_gain"]) >= {"value", "se"}
    shared = {"c1", "k1", "c2", "g", "k2[1]", "sigma"}
    assert shared <= set(content["parameters"]["before"])
    left = content["remainder"]
    assert (left is None) == (which != "unknown")
    if left is not None:
        assert set(left) == {
            "rms_m", "share_of_signal_percent", "over_noise", "regime", "displacement_m",
            "recordings", "guess",
        }  # fmt: skip
        assert 0 <= left["rms_m"] < small_rig.NOISE and left["guess"]
    for limit in content["limits"]:
        assert set(limit) >= {"id", "parameter", "unit", "upper95"} and limit["upper95"] > 0
    assert content["noise"]["correlation"] == "white"
    assert content["noise"]["sigma_m"] == pytest.approx(small_rig.NOISE, rel=0.1)
    assert (content["seed"], content["seconds"], content["versions"]) == (3, 1.5, {"numpy": "2"})


def test_the_document_of_a_control_has_no_place(control):
    content = written(control)
    assert content["location"] is None and content["effects"] == [] == content["alternatives"]
    before, after = content["parameters"]["before"], content["parameters"]["after"]
    assert before["k1"]["ci90"] == after["k1"]["ci90"]


def test_the_document_of_a_named_effect(named):
    content = written(named)
    place = content["location"]
    assert place["regime"] == "contact" and 0.5 < place["share"] <= 1.0
    assert place["displacement_m"][0] < place["displacement_m"][1]
    assert place["velocity_m_s"][0] < 0 < place["velocity_m_s"][1]
    assert 0 <= place["time_s"][0] < place["time_s"][1] <= 1.5
    assert set(place["recordings"]) <= set("abc") and set(place["cases"]) <= {"1", "2"}
    assert place["force_rms_n"] > 0
    (effect,) = content["effects"]
    assert effect["id"] == "contact_hardening" and effect["family"] and effect["statement"]
    assert effect["probability"] > 0.99 and effect["delta_log_evidence"] > 50
    assert effect["location"]["regime"] == "contact"
    size = effect["size"]
    assert (
        set(size) == {"value", "unit", "percent", "of"} and size["of"] == "the peak contact force"
    )
    assert size["unit"] == "N" and 0 < size["percent"] < 20
    (name,) = effect["parameters"]
    entry = effect["parameters"][name]
    assert name == "contact_hardening.stiffness" and entry["unit"] == "N/m3"
    assert entry["ci90"][0] < STIFFNESS * 1.05 and entry["ci90"][1] > STIFFNESS * 0.95
    assert content["parameters"]["after"][name]["median"] == entry["median"]
    gain = content["fit"]["held_out_gain"]
    scores = [content["fit"][s]["held_out_log_score"] for s in ("after", "before")]
    assert gain["value"] == pytest.approx(scores[0] - scores[1])
    assert content["fit"]["after"]["reduced_chi2"] < content["fit"]["before"]["reduced_chi2"]
    for other in content["alternatives"]:
        assert 0 <= other["probability"] < 0.5 and other["id"]


def test_the_document_takes_intervals_from_draws(named):
    after = named.after
    rng = np.random.default_rng(0)
    draws = after.mode + after.sd * rng.standard_normal((4000, after.mode.size))
    entry = written(named, draws_after=draws)["parameters"]["after"]["k2[1]"]
    column = draws[:, after.names.index("k2[1]")]
    np.testing.assert_allclose(entry["ci90"], np.percentile(column, [5, 95]))
    assert entry["median"] == pytest.approx(np.median(column))


def test_the_document_of_an_ambiguous_case_lists_the_rivals(named):
    base = named.selection.base.candidate
    rivals = (
        replace(base, effects=(BY_ID["spring_cubic"],)),
        replace(base, effects=(BY_ID["coulomb_friction"], BY_ID["sensor_drift"])),
    )
    content = written(replace(named, verdict="ambiguous", alternatives=rivals))
    ids = [a["id"] for a in content["alternatives"]]
    assert ids[:2] == ["spring_cubic", "coulomb_friction + sensor_drift"]
    told = "cubic stiffness of the suspension or dry friction and drift of the probe's zero"
    assert told in content["summary"]
    assert content["effects"][0]["id"] == "contact_hardening"


@pytest.mark.parametrize(
    ("effects", "gain", "said"),
    [
        (("sensor_drift",), 5.0, True),
        (("sensor_drift", "sensor_hum"), 5.0, True),
        (("sensor_drift",), -1.0, False),  # no evidence for it
        (("sensor_drift", "coulomb_friction"), 5.0, False),
        (("coulomb_friction",), 5.0, False),
    ],
)
def test_an_unknown_force_may_be_the_probe_s_where_that_is_likeliest(unknown, effects, gain, said):
    base = unknown.selection.base.candidate
    own = tuple(BY_ID[i] for i in effects)
    likely = replace(base, effects=own, log_evidence=base.log_evidence + gain)
    less = replace(base, effects=(BY_ID["quadratic_drag"],), log_evidence=base.log_evidence - 9.0)
    selection = replace(unknown.selection, tried=(base, less, likely))
    content = written(replace(unknown, selection=selection, alternatives=()))
    told = f"Of the catalogue {' and '.join(e.title for e in own)} ("
    assert (told in content["summary"]) is (gain > 0.0)
    assert ("Seen as a force it would act" in content["summary"]) is said
    assert ("It acts" in content["summary"]) is not said


def test_the_same_seed_gives_the_same_document(control):
    again = written(run(41))
    assert again == written(control)
