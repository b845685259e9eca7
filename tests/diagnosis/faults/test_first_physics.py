"""Faults of recordings that strong physics hides from a comparison by the base model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults import first_physics
from bayesimpact.diagnosis.faults.first_physics import faults_beside_physics
from bayesimpact.diagnosis.faults.recording_faults import Corrected, Step, cleaned_campaign
from bayesimpact.diagnosis.selection.outcome import is_large
from bayesimpact.model.effects import SEARCHED
from bayesimpact.trial.rig.recordings import Release

pytestmark = pytest.mark.usefixtures("catalogue_alone")

CATALOGUE = tuple(
    BY_ID[i] for i in ("coulomb_friction", "quadratic_drag", "spring_cubic", "harmonic_forcing")
)
FRICTION = {"coulomb_friction": {"force": 0.05}}
BUMP = {"detent": {"stiffness": 40.0, "place": -1.5e-3, "width": 5e-4}}


def timed(seed: int, ratio: float, effects) -> Campaign:
    """Recording b's clock runs slow by a ratio."""
    campaign = small_rig.record(seed, effects, duration=2.0)
    first, second, *others = campaign.recordings
    wrong = replace(second, interval=second.interval / ratio)
    return replace(campaign, recordings=(first, wrong, *others))


@cache
def slow_clock() -> tuple[Campaign, Corrected]:
    """Beside friction, and its base fit."""
    campaign = timed(71, 1.004, FRICTION)
    return campaign, cleaned(campaign)


def cleaned(campaign: Campaign) -> Corrected:
    return cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)


def found(campaign: Campaign, before: Corrected | None = None) -> tuple[Step, ...]:
    before = before or cleaned(campaign)
    assert is_large(before.identification.fit)
    return faults_beside_physics(before, campaign, CATALOGUE)


def test_a_clock_shows_beside_the_law_that_is_asked_for_first():
    ((fault,),) = found(*slow_clock())
    assert fault.fault.id == "recording_clock" and fault.fault.recording == "b"
    assert "−0.4" in fault.fault.statement or "−0.39" in fault.fault.statement


@pytest.mark.parametrize("gain", [1.03, 1.0])
def test_a_gain_of_accelerations_shows_beside_what_periods_ahead_ask_for(gain):
    """No displacement is told from them with a stop, and gaps of every recording's own took its
    place, with dampings per obstacle: two wrong names.
    """
    chain = small_rig.MeasuringChain(noise=0.05, offsets=dict.fromkeys("abc", 0.0))
    cubic = {"spring_cubic": {"stiffness": 6e6}}
    campaign = small_rig.record(
        5, cubic, chain=chain, quantity="acceleration", rate=2000.0, duration=2.0
    )
    first, second, *others = campaign.recordings
    wrong = replace(second, samples=gain * second.samples)
    steps = found(replace(campaign, recordings=(first, wrong, *others)))
    if gain == 1.0:
        assert steps == ()
        return
    ((fault,),) = steps
    assert fault.fault.id == "recording_gain" and fault.fault.recording == "b"
    assert "+3" in fault.fault.statement or "+2.9" in fault.fault.statement


def test_samples_lost_near_a_turning_point_show_beside_a_law_of_the_contact():
    """A recording that lacks them fits no law by itself either."""
    law = {"contact_power_law": {"exponent": 1.12}}
    campaign = small_rig.record(7, law, duration=2.0)
    first, second, *others = campaign.recordings
    period = 2 * np.pi * float(np.sqrt(campaign.mass / small_rig.RIG.k1))
    at = round(3.0 * period / second.interval)
    at += int(np.argmin(second.samples[at : at + round(period / second.interval)]))
    less = replace(second, samples=np.delete(second.samples, np.s_[at - 3 : at + 4]))
    effects = tuple(BY_ID[i] for i in ("contact_power_law", "quadratic_drag", "spring_cubic"))
    campaign = replace(campaign, recordings=(first, less, *others))
    ((fault,),) = faults_beside_physics(cleaned(campaign), campaign, effects)
    assert fault.fault.id == "recording_slip" and fault.fault.recording == "b"
    assert fault.fault.statement.startswith("7 samples lost") and fault.after < 1.2


def test_without_a_fault_or_where_more_is_missing_none_is_found():
    assert found(timed(73, 1.0, FRICTION)) == ()
    assert found(timed(74, 1.004, FRICTION | BUMP)) == ()


def test_a_recording_that_alone_reaches_a_force_is_of_no_other_rig():
    """The brake acts from 3 mm on: the others, of smaller amplitude, need no law."""
    brake = {"eddy_brake": {"coefficient": 2.0, "low": -3e-3, "high": -1.5e-3}}
    releases = tuple(Release(n, "", y) for n, y in zip("abc", (-6.5e-3, -3e-3, -2e-3), strict=True))
    campaign = small_rig.record(4, brake, rig=small_rig.PLAIN, releases=releases)
    assert not faults_beside_physics(cleaned(campaign), campaign, SEARCHED)


@pytest.mark.parametrize("recordings", [1, 3])
def test_a_fault_beside_which_something_is_left_does_not_count(monkeypatch, recordings):
    """Of a recording by itself, or of all together once it is corrected."""

    def leaves(fit) -> bool:
        return len(fit.density.oscillator.campaign.recordings) == recordings

    monkeypatch.setattr(first_physics, "leaves_something", leaves)
    assert found(*slow_clock()) == ()


@pytest.mark.long
def test_what_physics_hid_is_corrected_before_more_is_searched():
    told: list[str] = []
    answer = diagnose(
        timed(75, 1.004, FRICTION), rng=np.random.default_rng(0), effects=CATALOGUE, search=False,
        progress=told.append,
    )  # fmt: skip
    first = next(i for i, words in enumerate(told) if words.startswith("scoring"))
    assert any("recording_clock" in words for words in told[:first])
    assert answer.verdict == "named" and [e.id for e in answer.effects] == ["coulomb_friction"]
    assert answer.corrected is not None
    assert [f.id for f in answer.corrected.faults] == ["recording_clock"]
