"""A gain that changes in mid-record, told by a model with the physics that is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults import changes
from bayesimpact.diagnosis.faults.change_point import change_scores, parameter_basis
from bayesimpact.diagnosis.faults.changes import change_instead
from bayesimpact.diagnosis.faults.gain_step import gain_step_beside
from bayesimpact.diagnosis.faults.recording_faults import cleaned_campaign, comparisons
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.revision import first_revision
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import EFFECTS

BY_ID = {e.id: e for e in EFFECTS}
PHYSICS: Mapping[str, Mapping[str, Any]] = {
    "spring_cubic": {"stiffness": 6e6},
    "coulomb_friction": {"force": 0.02},
}
MISSING: Mapping[str, Mapping[str, Any]] = {
    "spring_cubic": {"stiffness": 2e6},
    "quadratic_drag": {"coefficient": 0.3},
    "stiffness_drift": {"rate": -4e-3},
    "contact_damping_indentation": {"coefficient": 4e4},
    "knock": {"impulse": 0.004, "time": 0.9, "width": 0.01},
}
PLACE = 900  # sample
WITHOUT_STOP: Mapping[str, Any] = {
    "rig": small_rig.PLAIN,
    "releases": (
        *small_rig.PLAIN_RELEASES,
        replace(small_rig.PLAIN_RELEASES[0], name="c", y0=5.5e-3, v0=0.0),
    ),
}


def recorded(
    effects: Mapping[str, Any], times: float = 1.0, *, hidden: bool = False, **how: Any
) -> Campaign:
    """A campaign of which later readings of the second recording are so many times as large; with
    the step `hidden` they are near zero there.
    """
    campaign = small_rig.record(5, effects, **how)
    recordings = list(campaign.recordings)
    samples = recordings[1].samples.copy()
    near = np.abs(samples[PLACE - 50 : PLACE + 50])
    samples[PLACE - 50 + int(np.argmin(near)) if hidden else PLACE :] *= times
    recordings[1] = replace(recordings[1], samples=samples)
    return replace(campaign, recordings=tuple(recordings))


def fits(campaign: Campaign, names: Sequence[str]) -> tuple[Fit, Fit]:
    """Of the base model, and with effects."""
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    if not names:
        return base, base
    effects = [BY_ID[name] for name in names]
    return base, fit_from(base, effects, {}, campaign_scales(base)).fit


@pytest.mark.parametrize("times", [0.7, 0.97, 1.01, 1.03, 1.5])
def test_size_and_place_are_told(times: float) -> None:
    """The model fits the corrected readings, of which none is lost but beside the place."""
    base, found = fits(recorded(PHYSICS, times), [*PHYSICS])
    told = gain_step_beside(found)
    assert told is not None
    compared, fit = told
    fault, percent = compared.fault, 100 * (times - 1)
    assert (fault.id, fault.recording) == ("recording_gain", "b")
    assert abs(fault.size - percent) < 4 * fault.error < 0.1 * abs(percent)
    assert 0 <= PLACE - round(1e3 * fault.start_s) < 20
    assert compared.after < 1.2 < compared.before  # noise has changed with the readings
    assert fit.rms < 1.05 * small_rig.NOISE
    whole, after = found.density.oscillator.campaign, compared.campaign
    assert after.recordings[1].count > whole.recordings[1].count - 40
    np.testing.assert_array_equal(after.recordings[0].samples, whole.recordings[0].samples)
    revision = first_revision(base, found, lambda message: None)
    assert revision is not None
    assert [one.fault.id for one in revision.faults] == ["recording_gain"]
    assert revision.base.density.oscillator.campaign == revision.found.density.oscillator.campaign


def test_such_a_recording_is_of_no_other_rig() -> None:
    """By its own parameters it would be; knocks would explain it, too."""
    campaign = recorded({}, 1.05, hidden=True, **WITHOUT_STOP)
    cleaned = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)
    fit = cleaned.identification.fit
    told = change_instead(comparisons(cleaned, campaign), fit, fit, campaign)
    assert [(one.fault.id, one.fault.recording) for one in told] == [("recording_gain", "b")]
    assert told[0].fault.size == pytest.approx(5.0, abs=4 * told[0].fault.error)


def test_no_physics_is_named_for_it() -> None:
    campaign = recorded({}, 1.05, hidden=True)
    found = diagnose(campaign, rng=np.random.default_rng(0), search=False)
    assert (found.verdict, found.effects) == ("named", ())
    assert found.corrected is not None
    (fault,) = found.corrected.faults
    assert fault.id == "recording_gain" and "from 0.9" in fault.statement
    assert found.after.reduced_chi2 < 1.1


@pytest.mark.parametrize("stop", [True, False])
@pytest.mark.parametrize("effect", MISSING)
def test_missing_physics_is_no_change_of_a_gain(effect: str, stop: bool) -> None:
    if effect.startswith("contact") and not stop:
        pytest.skip("there is no contact")
    how = {} if stop else WITHOUT_STOP
    base, _ = fits(recorded({effect: MISSING[effect]}, **how), [])
    assert base.reduced_chi2 > 2.0
    assert gain_step_beside(base) is None


@pytest.mark.parametrize("times, knocked", [(0.9, False), (1.1, True)])
def test_knocks_are_told_where_they_leave_far_less(
    monkeypatch, times: float, knocked: bool
) -> None:
    """Each takes an unknown more than a gain."""
    gain: Any = SimpleNamespace(after=1.0 + times * EXCESS), "with the gain corrected"
    knocks: Any = (SimpleNamespace(after=2.0),), "plain", "without what lies beyond"
    monkeypatch.setattr(changes, "gain_step_beside", lambda found: gain)
    monkeypatch.setattr(changes, "knocks_beside", lambda base, found: knocks)
    monkeypatch.setattr(changes, "above_noise", lambda fit, chi2: chi2 - 1.0)
    fit: Any = object()
    told = changes.changes_beside(fit, fit)
    assert told == (knocks if knocked else ((gain[0],), gain[1], gain[1]))
    monkeypatch.setattr(changes, "gain_step_beside", lambda found: None)
    assert changes.changes_beside(fit, fit) is knocks


def test_adequate_model_shows_none() -> None:
    _, found = fits(recorded(PHYSICS), [*PHYSICS])
    assert gain_step_beside(found) is None


def test_score_is_that_of_an_explicit_column() -> None:
    _, found = fits(recorded(PHYSICS, 1.01), [*PHYSICS])
    recording = found.density.oscillator.campaign.recordings[1]
    scores = change_scores(found, 1, recording.samples, parameter_basis(found))
    column = np.where(np.arange(recording.samples.size) < PLACE, 0.0, recording.samples)
    part, noise = found.linearisation, found.density.likelihood.noise
    whole = np.concatenate([p.whole(found.mode.size) for p in part])
    ends = np.cumsum([p.residual.size for p in part])
    explicit = np.zeros(whole.shape[0])
    explicit[ends[0] : ends[1]] = noise.whitened(recording, column)
    scale = np.linalg.norm(whole, axis=0)
    both = np.column_stack([whole[:, scale > 0] / scale[scale > 0], explicit])
    residual = np.concatenate([p.residual for p in part])
    without, with_it = (
        float(np.sum((residual - x @ np.linalg.lstsq(x, residual, rcond=None)[0]) ** 2))
        for x in (both[:, :-1], both)
    )
    assert scores.explained[PLACE - scores.first] == pytest.approx(without - with_it, rel=1e-4)
