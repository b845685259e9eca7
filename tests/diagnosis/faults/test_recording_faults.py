"""Faults of recordings in a whole diagnosis: named, corrected, and not taken for physics."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.noise import loud_recordings
from bayesimpact.data.faults.spikes import find_spikes
from bayesimpact.data.strict_json import strict
from bayesimpact.diagnosis import diagnose as module
from bayesimpact.diagnosis.budget import begin
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults import recording_faults as faults
from bayesimpact.diagnosis.faults.compare import Compared
from bayesimpact.diagnosis.faults.outliers import residual_spikes
from bayesimpact.diagnosis.faults.recording_faults import Corrected, Step, cleaned_campaign
from bayesimpact.diagnosis.faults.simpler import makes_idle
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.inference.identify import identify
from bayesimpact.report.diagnosis.document import document
from bayesimpact.trial.rig.recordings import Release

pytestmark = pytest.mark.usefixtures("catalogue_alone")

CATALOGUE = tuple(BY_ID[i] for i in ("coulomb_friction", "gap_per_recording", "sensor_drift"))


def faulty(change, number: int = 1) -> Diagnosis:
    campaign = small_rig.record(61, duration=1.5)
    recordings = list(campaign.recordings)
    samples = recordings[number].samples.copy()
    recordings[number] = replace(recordings[number], samples=change(samples))
    campaign = replace(campaign, recordings=tuple(recordings))
    return diagnose(campaign, rng=np.random.default_rng(0), effects=CATALOGUE, search=False)


def spiked(samples: np.ndarray) -> np.ndarray:
    samples[[300, 517, 888]] += 1e-3
    return samples


def written(found: Diagnosis) -> dict:
    content = document(found, seed=0, seconds=1.0, versions={})
    return json.loads(json.dumps(strict(content), allow_nan=False))


@pytest.mark.parametrize(
    ("change", "fault"),
    [(spiked, "recording_spikes"), (lambda samples: 1.05 * samples, "recording_gain")],
)
def test_a_fault_is_named_with_its_recording(change, fault: str) -> None:
    found = faulty(change)
    assert found.verdict == "named" and found.effects == ()
    content = written(found)
    (effect,) = content["effects"]
    assert effect["id"] == fault and effect["family"] == "recording"
    assert effect["location"]["recordings"] == ["b"] == content["location"]["recordings"]
    assert any(f["id"] == fault and f["recording"] == "b" for f in content["faults"])
    assert "Recording b" in content["summary"]
    truth, low_high = small_rig.true_values(), content["parameters"]["after"]
    for name in ("k1", "k2[1]"):
        low, high = low_high[name]["ci90"]
        assert abs(truth[name] - low_high[name]["median"]) < 4 * (high - low) / (2 * 1.645)


def test_what_is_to_be_kept_is_kept() -> None:
    campaign = small_rig.record(61, duration=1.5)
    first = replace(campaign.recordings[0], samples=spiked(campaign.recordings[0].samples.copy()))
    campaign = replace(campaign, recordings=(first, *campaign.recordings[1:]), keep_faults=True)
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=CATALOGUE[:1], search=False)
    assert found.corrected is not None and found.corrected.faults == ()
    assert written(found)["faults"][0]["id"] == "recording_spikes"  # told all the same


def at_the_deepest(campaign: Campaign) -> tuple[Campaign, int]:
    """A spike of three samples in contact, where the motion is bent, at a low sampling rate."""
    samples = campaign.recordings[0].samples.copy()
    deepest = 60 + int(np.argmax(samples[60:120]))
    samples[deepest : deepest + 3] += 60 * small_rig.NOISE
    first = replace(campaign.recordings[0], samples=samples)
    return replace(campaign, recordings=(first, *campaign.recordings[1:])), deepest


def test_a_spike_that_a_contact_hides_shows_against_the_fit() -> None:
    campaign, deepest = at_the_deepest(small_rig.record(62, rate=300.0))
    assert find_spikes(campaign.recordings[0]) == []
    found = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)
    (fault,) = found.faults
    assert (fault.id, fault.recording) == ("recording_spikes", "a")
    assert fault.spans == ((deepest, deepest + 3),)
    assert found.identification.fit.reduced_chi2 < 1.1


def test_what_stands_out_beside_a_wrong_model_is_left_to_physics() -> None:
    """The same spike where a spring is missing as well: the fit does not tell them apart."""
    effects = {"spring_cubic": {"stiffness": 2e6}}
    campaign, _ = at_the_deepest(small_rig.record(62, effects, rate=300.0))
    found = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)
    assert found.faults == ()
    assert found.identification.fit.reduced_chi2 > 1.5


def test_spikes_that_show_only_beside_the_physics_are_set_aside_too() -> None:
    """Their size is that of what the missing spring leaves."""
    cubic = {"spring_cubic": {"stiffness": -4e5}}
    releases = (*small_rig.PLAIN_RELEASES, Release("c", "", -5.5e-3))
    campaign = small_rig.record(
        62, cubic, rig=small_rig.PLAIN, releases=releases, rate=100.0, duration=8.0
    )
    samples = campaign.recordings[1].samples.copy()
    for place in (130, 610):
        # of 15 one lies within what the bends of a motion of 16 samples a period reach
        samples[place : place + 3] += 25 * small_rig.NOISE
    spoiled = replace(campaign.recordings[1], samples=samples)
    recordings = (campaign.recordings[0], spoiled, *campaign.recordings[2:])
    campaign = replace(campaign, recordings=recordings)
    catalogue = (BY_ID["spring_cubic"], *CATALOGUE[:1])
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=catalogue, search=False)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["spring_cubic"]
    assert found.corrected is not None
    assert [f.id for f in found.corrected.faults] == ["recording_spikes"]
    assert found.after.reduced_chi2 < 1.2


@pytest.mark.long
def test_spikes_away_from_the_stop_that_physics_hides_are_found_by_the_search() -> None:
    """In accelerations they look like contacts; a contact would have moved all that comes after."""
    cubic = {"spring_cubic": {"stiffness": 2e6}}
    chain = small_rig.MeasuringChain(noise=0.05, offsets=dict.fromkeys("abc", 0.0))
    campaign = small_rig.record(63, cubic, chain=chain, quantity="acceleration")
    first, *others = campaign.recordings
    samples, places = first.samples.copy(), (403, 1106, 1750)
    for place in places:
        samples[place] -= 1.2
    campaign = replace(campaign, recordings=(replace(first, samples=samples), *others))
    told: list[str] = []
    found = diagnose(
        campaign, rng=np.random.default_rng(0), effects=(BY_ID["spring_cubic"], *CATALOGUE[:1]),
        search=False, progress=told.append,
    )  # fmt: skip
    assert found.verdict == "named" and [e.id for e in found.effects] == ["spring_cubic"]
    assert found.corrected is not None
    (fault,) = found.corrected.faults
    assert (fault.id, fault.recording) == ("recording_spikes", "a")
    assert fault.spans == tuple((place, place + 1) for place in places)
    assert 0.9 < found.after.reduced_chi2 < 1.1
    assert any("once more without them" in words for words in told)


@pytest.mark.long
def test_doubtful_faults_come_after_certain_ones_and_physics(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A wrong case label is certain; a probe that is not linear must not become another rig."""
    compared = module.comparisons

    def and_another_rig(before: Corrected, as_read: Campaign, *beside: object) -> tuple[Step, ...]:
        (label,) = compared(before, as_read)
        known = label[-1]
        without = replace(known.campaign, recordings=known.campaign.recordings[:-1])
        fault = replace(known.fault, id="recording_other_rig", recording="d")
        return label, (Compared(fault, without, known.after, 0.99 * known.after),)

    monkeypatch.setattr(module, "comparisons", and_another_rig)
    releases = (*small_rig.RELEASES, Release("d", "2", -6e-3))
    probe = {"sensor_quadratic": {"gain": 0.8}}
    campaign = small_rig.record(63, probe, releases=releases)
    first, second, *others = campaign.recordings
    campaign = replace(campaign, recordings=(first, replace(second, case="2"), *others))
    catalogue = (BY_ID["sensor_quadratic"], *CATALOGUE[:1])
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=catalogue, search=False)
    assert found.corrected is not None
    assert [f.id for f in found.corrected.faults] == ["recording_case"]
    assert [e.id for e in found.effects] == ["sensor_quadratic"]


@pytest.mark.long
def test_a_gain_shows_beside_the_physics_that_hides_it() -> None:
    """To the base model every recording has a gap of its own; beside the spring only one."""
    heights = (-6.5e-3, -5.8e-3, -5.2e-3, -4.6e-3, -4e-3, -3.5e-3)
    releases = [Release(n, "1", y) for n, y in zip("abcdef", heights, strict=True)]
    campaign = small_rig.record(64, {"spring_quadratic": {"stiffness": 2e3}}, releases=releases)
    recordings = list(campaign.recordings)
    recordings[2] = replace(recordings[2], samples=1.01 * recordings[2].samples)
    campaign = replace(campaign, recordings=tuple(recordings))
    catalogue = (BY_ID["spring_quadratic"], *CATALOGUE)
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=catalogue, search=False)
    assert found.corrected is not None
    (fault,) = found.corrected.faults
    assert (fault.id, fault.recording) == ("recording_gain", "c")
    assert fault.size == pytest.approx(1.0, abs=0.1)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["spring_quadratic"]


@pytest.mark.parametrize("hides", [False, True])
def test_faults_that_do_nothing_that_the_effects_do_are_not_searched_beside(
    monkeypatch: pytest.MonkeyPatch, hides: bool
) -> None:
    """Gaps of their own that recordings have are no gain; those that a gain makes are."""
    gaps = {} if hides else {"a": 1.2e-3, "b": 1.24e-3, "c": 1.17e-3}
    right = small_rig.record(66, {"gap_per_recording": {"g": gaps}} if gaps else {}, duration=1.5)
    first, second, *others = right.recordings
    loud = replace(second, samples=1.02 * second.samples)
    scaled = replace(right, recordings=(first, loud, *others))
    read, corrected = (scaled, right) if hides else (right, scaled)
    rng = np.random.default_rng(0)
    monkeypatch.setattr(module, "comparisons", lambda *_: ())
    found = diagnose(read, rng=rng, effects=CATALOGUE, search=False)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["gap_per_recording"]
    again = Corrected(identify(corrected, rng=rng, search=False))
    assert makes_idle(again, found) is hides
    monkeypatch.setattr(module, "with_steps", lambda *_, **__: again)
    asked: Any = SimpleNamespace(
        rng=rng, again=lambda found, corrected, better: corrected(), budget=begin(lambda: 0.0)
    )
    expected = again if hides else found
    assert module._beside_faults(found, found.corrected, (), asked, False) is expected
    asked.budget = begin(lambda: 0.0, 0.0)  # no time to ask: what `again` says of that stands
    assert module._beside_faults(found, found.corrected, (), asked, False) is again


@pytest.mark.long
@pytest.mark.parametrize("needed", [False, True])
def test_faults_that_the_physics_makes_needless_are_taken_back(
    monkeypatch: pytest.MonkeyPatch, needed: bool
) -> None:
    """What comparing showed before the physics was known, and nothing shows beside it."""
    compared = module.comparisons
    sizes = {"spring_quadratic": {"stiffness": 2e3}}
    right = small_rig.record(64, sizes, duration=1.5)
    first, second, *others = right.recordings
    scaled = replace(
        right, recordings=(first, replace(second, samples=1.02 * second.samples), *others)
    )
    read, corrected = (scaled, right) if needed else (right, scaled)
    (fault,) = (c.fault for step in _steps_of_a_gain(compared) for c in step)
    steps = ((Compared(fault, corrected, 100.0, 1.0),),)
    monkeypatch.setattr(module, "comparisons", lambda *_: steps)
    monkeypatch.setattr(module, "promised_gains", lambda *_, **__: np.zeros(1))
    catalogue = (BY_ID["spring_quadratic"], *CATALOGUE)
    told: list[str] = []
    found = diagnose(
        read,
        rng=np.random.default_rng(0),
        effects=catalogue,
        search=False,
        progress=lambda m: told.append(str(m)),
    )
    base = "scoring what the base model lacks"
    after = [b for a, b in pairwise(told) if a == base]
    searched = [b.startswith("scoring what ") for b in after]
    assert not searched[0] and any(searched[1:]) is not needed
    assert found.verdict == "named" and "spring_quadratic" in [e.id for e in found.effects]
    assert found.corrected is not None and bool(found.corrected.faults) is needed


def _steps_of_a_gain(compared) -> tuple[Step, ...]:
    """The step that a gain of 5 % in a recording makes."""
    campaign = small_rig.record(61, duration=1.5)
    first, second, *others = campaign.recordings
    loud = replace(second, samples=1.05 * second.samples)
    campaign = replace(campaign, recordings=(first, loud, *others))
    rng = np.random.default_rng(0)
    return compared(cleaned_campaign(campaign, rng=rng, search=False), campaign)


@pytest.mark.parametrize(("effects", "searches"), [(3, 1), (10**7, 2)])
def test_a_proved_fault_is_not_searched_without(
    monkeypatch: pytest.MonkeyPatch, effects: int, searches: int
) -> None:
    """Where something remains: once, unless so many effects might explain it all together."""
    asked = []
    of_corrected = module._of_corrected

    def remains(corrected: Corrected, **others) -> Diagnosis:
        asked.append(corrected)
        return replace(of_corrected(corrected, **others), verdict="partly")

    monkeypatch.setattr(module, "_of_corrected", remains)
    monkeypatch.setattr(module, "promised_gains", lambda *_, **__: np.ones(effects))
    found = faulty(lambda samples: 1.05 * samples)
    assert found.corrected is not None
    assert [f.id for f in found.corrected.faults] == ["recording_gain"]
    assert len(asked) == searches


def test_recordings_that_may_be_the_faulty_one_are_all_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compared = module.comparisons

    def tossed(before: Corrected, as_read: Campaign, *beside: object) -> tuple[Step, ...]:
        others = (("recording_gain, c", 0.5), ("recording_clock, a", 0.002))
        steps = compared(before, as_read)
        return tuple(tuple(replace(c, alternatives=others) for c in step) for step in steps)

    monkeypatch.setattr(module, "comparisons", tossed)
    found = faulty(lambda samples: 1.05 * samples)
    content = written(found)
    assert content["verdict"] == "ambiguous"
    assert content["effects"][0]["probability"] == pytest.approx(0.498)
    assert "Or recording_gain, c (50 %)." in content["summary"]
    assert "recording_clock" not in content["summary"]


def test_a_recording_in_another_unit_is_not_loud() -> None:
    campaign = small_rig.record(63)
    assert loud_recordings(campaign.recordings) == []
    first, *others = campaign.recordings
    assert loud_recordings([replace(first, samples=1000 * first.samples), *others]) == []
    noise = 20 * small_rig.NOISE * np.random.default_rng(1).standard_normal(first.samples.size)
    (loud,) = loud_recordings([replace(first, samples=first.samples + noise), *others])
    assert loud.recording == "a"


def test_several_steps_are_corrected_with_one_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each step's campaign has all before it corrected: only the last one is fitted."""
    fitted: list[str] = []
    monkeypatch.setattr(faults, "identified", lambda campaign, **_: fitted.append(campaign))
    monkeypatch.setattr(faults, "_through_filter", lambda campaign, known: (campaign, known))
    first, second, third = (SimpleNamespace(campaign=name) for name in ("one", "two", "three"))
    before: Any = SimpleNamespace(own=("own",), compared=("known",), filtered=None)
    steps: Any = ((first,), (second, third))
    found = faults.with_steps(before, steps, rng=np.random.default_rng(0), search=True)
    assert fitted == ["three"]
    assert found.own == ("own",) and found.compared == ("known", first, second, third)


@pytest.mark.parametrize("formula", [False, True])
def test_a_formula_is_looked_for_anew_where_a_fault_is_needless(monkeypatch, formula) -> None:
    """It is no effect of the catalogue, with which a search could begin."""
    effect: Any = BY_ID["spring_quadratic"]
    found: Any = SimpleNamespace(
        verdict="named", effects=(effect,), corrected=SimpleNamespace(compared=(1,)),
        after=SimpleNamespace(density=SimpleNamespace(oscillator=SimpleNamespace(effects=(effect,)))),
    )  # fmt: skip
    beside, begun = object(), []
    monkeypatch.setattr(module, "is_formula", lambda one: formula)
    monkeypatch.setattr(module, "fitted_beside", lambda *known: beside)
    monkeypatch.setattr(module, "misfits", lambda fit: False)
    searches: Any = SimpleNamespace(again=lambda *known: begun.append(known[3]))
    before: Any = SimpleNamespace(compared=())
    module._without_needless_faults(found, before, searches)
    assert begun == [None if formula else beside]


def test_a_start_that_was_cut_twice_is_told_once() -> None:
    """Another recording's, and what is no start, are told however they lie."""

    def compared(id: str, recording: str, end: float) -> Any:
        fault = SimpleNamespace(id=id, recording=recording, start_s=0.0, end_s=end)
        return SimpleNamespace(fault=fault)

    first, other, gain, again, second = (
        compared("recording_start", "a", 0.5), compared("recording_start", "b", 0.2),
        compared("recording_gain", "a", 3.0), compared("recording_gain", "a", 3.0),
        compared("recording_start", "a", 0.7),
    )  # fmt: skip
    found = Corrected(cast(Any, None), compared=(first, other, gain, again, second))
    assert found.told == (other, gain, again, second)


def test_a_spike_that_is_set_aside_is_not_told_again_of_a_slow_error() -> None:
    """Where it lies a fit misses the readings beside it alike, all by the same slow error."""
    campaign = small_rig.record(3, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES)
    first, other = campaign.recordings
    slow = 40 * small_rig.NOISE * np.cos(2.0 * first.times)
    used = np.ones(first.samples.size, bool)
    used[150:152] = False
    wandering = replace(first, samples=first.samples + slow, used=used)
    campaign = replace(campaign, recordings=(wandering, other))
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    assert abs(fit.residuals[0][149]) > 10 * small_rig.NOISE
    assert residual_spikes(fit) == ()


def test_a_first_reading_that_only_a_fit_shows_to_be_off_is_set_aside() -> None:
    """Eight deviations of the noise; for ten a second mode was named."""
    campaign = small_rig.record(3, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES)
    first, other = campaign.recordings
    samples = first.samples.copy()
    samples[0] += 8 * small_rig.NOISE
    campaign = replace(campaign, recordings=(replace(first, samples=samples), other))
    assert not find_spikes(campaign.recordings[0])
    found = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)
    (one,) = found.compared
    assert (one.fault.recording, one.fault.spans) == (first.name, ((0, 1),))
