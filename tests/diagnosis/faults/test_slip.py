"""Samples missing near a turning point, told from the phase of all that follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults.alone import SharedModel, own_fit
from bayesimpact.diagnosis.faults.slip import (
    SampleShift,
    find_shift,
    likeliest_shift,
    put_right,
)
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.measurement import smooth

COUNT = 1500
PLACE = 700


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    whole = load_campaign(bundled_campaign("paper"))
    return replace(whole, recordings=(whole.recordings[4].part(0, COUNT + 10),))


@pytest.fixture(scope="module")
def noise(campaign: Campaign) -> Noise:
    return identify(campaign, rng=np.random.default_rng(0), search=False).noise


def lost(recording: Recording, count: int) -> Recording:
    x = recording.samples
    return replace(recording, samples=np.concatenate([x[:PLACE], x[PLACE + count :]]))


def shift_of(
    campaign: Campaign, recording: Recording, model: SharedModel
) -> tuple[SampleShift, Fit] | None:
    return find_shift(campaign, recording, model, own_fit(campaign, recording, model))


def test_readings_are_put_where_they_belong(campaign: Campaign) -> None:
    (whole,) = campaign.recordings
    between = PLACE - 2, PLACE + 3
    again = put_right(lost(whole, 4), between, 4)
    assert again.used is not None
    assert np.flatnonzero(~again.used).tolist() == list(range(PLACE - 2, PLACE + 7))
    np.testing.assert_array_equal(again.samples[again.used], whole.samples[again.used])
    twice = put_right(lost(whole, -4), between, -4)
    assert twice.used is not None and twice.samples.size == whole.samples.size
    assert np.flatnonzero(~twice.used).tolist() == list(range(PLACE - 2, PLACE + 3))
    np.testing.assert_array_equal(twice.samples[twice.used], whole.samples[twice.used])


@pytest.mark.parametrize("count", [-4, -1, 1, 2, 6, 14])
def test_the_count_and_the_place(campaign: Campaign, noise: Noise, count: int) -> None:
    spoiled = lost(campaign.recordings[0], count)
    found = shift_of(campaign, spoiled, SharedModel(noise))
    assert found is not None
    shift, fit = found
    assert shift.samples == count
    assert shift.earliest - 3 <= PLACE <= shift.latest + 3
    assert fit.reduced_chi2 < 1.1 < 0.5 * own_misfit(campaign, spoiled, noise)


def own_misfit(campaign: Campaign, recording: Recording, noise: Noise) -> float:
    fit = own_fit(campaign, recording, SharedModel(noise))
    assert fit is not None
    return fit.reduced_chi2


def test_the_score_is_what_a_fit_with_the_shift_gains(campaign: Campaign, noise: Noise) -> None:
    """In the linear regime: a tenth of a sample."""
    (sound,) = campaign.recordings
    before = own_fit(campaign, sound, SharedModel(noise))
    assert before is not None
    late = np.where(np.arange(sound.samples.size) < PLACE, 0.0, 0.1)
    moved = sound.samples + late * np.gradient(before.predicted[0])
    fit = own_fit(campaign, replace(sound, samples=moved), SharedModel(noise))
    assert fit is not None
    shift = likeliest_shift(fit)
    assert shift is not None
    remains = float(before.sums[0]) / COUNT
    gain = 0.5 * float(fit.sums[0] - before.sums[0]) / remains
    assert shift.gain == pytest.approx(gain, rel=0.03)
    error = 0.1 / np.sqrt(2 * gain)
    assert shift.samples == pytest.approx(0.1, abs=4 * error)


def test_nothing_is_found_where_nothing_is_missing(campaign: Campaign, noise: Noise) -> None:
    """White noise about the fit exceeds the threshold once in a million recordings."""
    fit = own_fit(campaign, campaign.recordings[0], SharedModel(noise))
    assert fit is not None and likeliest_shift(fit) is None
    rng = np.random.default_rng(5)
    for _ in range(10):
        fresh = fit.predicted[0] + noise.level * rng.standard_normal(fit.predicted[0].size)
        again = own_fit(
            campaign, replace(campaign.recordings[0], samples=fresh), SharedModel(noise)
        )
        assert again is not None and likeliest_shift(again) is None


def test_a_shift_that_may_begin_anywhere_is_no_slip() -> None:
    """Dry friction runs late little by little: no place is likelier than another by much."""
    creeping = small_rig.record(3, {"coulomb_friction": {"force": 0.01}}, duration=1.5)
    noise = identify(creeping, rng=np.random.default_rng(0), search=False).noise
    recording = creeping.recordings[1]
    fit = own_fit(creeping, recording, SharedModel(noise))
    assert fit is not None
    shift = likeliest_shift(fit)
    assert shift is not None and shift.latest - shift.earliest > 0.8 * recording.samples.size
    assert shift_of(creeping, recording, SharedModel(noise)) is None


def test_the_place_behind_a_filter(campaign: Campaign) -> None:
    """A filter's ends are left out: places count from the recording's first sample all the same."""
    filtering = Smoothing("savgol", 31, 2)
    (whole,) = campaign.recordings
    smoothed = replace(whole, samples=smooth(whole.samples, filtering, whole.interval))
    measurement = replace(campaign.measurement, smoothing=filtering)
    behind = replace(campaign, measurement=measurement, recordings=(smoothed,))
    noise = identify(behind, rng=np.random.default_rng(0), search=False).noise
    fit = own_fit(behind, lost(smoothed, 2), SharedModel(noise))
    assert fit is not None
    shift = likeliest_shift(fit)
    assert shift is not None and shift.place == pytest.approx(PLACE, abs=2)
    found = shift_of(behind, lost(smoothed, 2), SharedModel(noise))
    assert found is not None and found[0].samples == 2
    assert found[1].reduced_chi2 < 1.15
