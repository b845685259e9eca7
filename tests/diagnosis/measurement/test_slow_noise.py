"""Slow noise is told from a force, alone and beside an effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis import diagnose as whole
from bayesimpact.diagnosis.budget import begin
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults.recording_faults import cleaned_campaign
from bayesimpact.diagnosis.measurement.slow_noise import remaining_noise
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.whitening import Noise

pytestmark = pytest.mark.usefixtures("catalogue_alone")

RNG = np.random.default_rng
FEW = tuple(
    BY_ID[i]
    for i in ("quadratic_drag", "coulomb_friction", "contact_hardening", "base_motion", "gap_wear")
)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_control_with_slow_noise_is_adequate_and_says_so(seed):
    campaign = small_rig.with_slow(small_rig.record(seed), seed, 1.25)
    found = diagnose(campaign, rng=RNG(0), search=False)
    assert found.verdict == "adequate"
    noise = found.after.density.likelihood.noise
    assert not noise.is_independent
    (correlation, slow), (_, white) = noise.parts
    assert correlation == pytest.approx(0.95, abs=0.03)
    assert white == pytest.approx(1 / (1 + 1.25**2), abs=0.12) and slow == 1 - white
    assert 0.9 < found.after.reduced_chi2 < 1.1


@pytest.mark.long
def test_noise_of_many_correlation_times_is_noise():
    """As flicker noise is, which two of them do not follow."""
    campaign = small_rig.record(
        6, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, rate=500.0, duration=20.0
    )
    for number, correlation in enumerate((0.7, 0.95, 0.99, 0.999)):
        campaign = small_rig.with_slow(campaign, number, 1.0, correlation)
    found = diagnose(campaign, rng=RNG(0), effects=FEW, search=False)
    assert found.verdict == "adequate"
    assert len(found.after.density.likelihood.noise.parts) > 3


DRAG = {"quadratic_drag": {"coefficient": 3.0}}


@pytest.mark.long
def test_physics_beside_slow_noise_is_named_and_the_noise_found_beside_it():
    campaign = small_rig.with_slow(small_rig.record(2, DRAG), 2, 1.25)
    found = diagnose(campaign, rng=RNG(0), effects=FEW, search=False)
    assert [e.id for e in found.effects] == ["quadratic_drag"]
    assert found.verdict in ("named", "ambiguous")
    assert found.after.density.likelihood.noise.others
    low, _, high = found.intervals.quantiles("quadratic_drag.coefficient")
    assert low < 3.0 < high


@pytest.mark.parametrize("size", [0.05, 0.5, 3.0])
def test_physics_alone_is_no_slow_noise(size):
    effects = {"quadratic_drag": {"coefficient": size}}
    campaign = small_rig.record(3, effects)
    assert remaining_noise(identify(campaign, rng=RNG(0), search=False).fit) is None


def test_a_law_in_contact_that_no_force_of_time_follows_is_no_slow_noise():
    """Its kinks are finer than the force's knots; what slow noise leaves of it is not white."""
    campaign = small_rig.record(4, {"obstacle_restitution": {"coefficient": 0.8}})
    assert remaining_noise(identify(campaign, rng=RNG(0), search=False).fit) is None


@pytest.mark.parametrize("size", [0.0, 90.0])
def test_a_jump_of_the_readings_is_no_slow_noise(size: float) -> None:
    """AR(1) noise of a long memory follows one, and nothing is left but at the jump."""
    rng, t = RNG(1), np.arange(271) / 60.0
    clean = 0.0847 + 0.038 * np.exp(-0.0166 * t) * np.cos(6.084 * t + 1.2)
    noise = 3.3e-5 * rng.standard_normal(t.size)
    slow = 0.0 if size else Noise(0.97).coloured(rng, t.size, t[1], 3e-4)
    samples = clean + noise + slow + size * 3.3e-5 * (t >= 0.845)
    campaign = Campaign("decay", 0.1, (Recording("a", "", samples, t[1]),), stop=False)
    found = remaining_noise(identify(campaign, rng=RNG(0), search=False).fit)
    assert (found is None) is (size > 0.0)


def test_a_search_begins_with_slow_noise_whatever_was_corrected_before():
    campaign = small_rig.with_slow(small_rig.record(6), 6, 1.25)
    corrected = cleaned_campaign(campaign, rng=RNG(0), search=False)
    noise = corrected.identification.noise
    assert noise.others and corrected.identification.fit.density.likelihood.noise is noise
    found = whole._of_corrected(
        corrected,
        rng=RNG(0),
        effects=(),
        progress=lambda _: None,
        budget=begin(),
        first=None,
        as_read=campaign,
    )
    assert found.verdict == "adequate" and found.after.density.likelihood.noise is noise


@pytest.mark.long
def test_slow_noise_is_found_again_beside_a_fault_of_a_recording():
    campaign = small_rig.with_slow(small_rig.record(5), 5, 1.25)
    first, *others = campaign.recordings
    turned = replace(first, samples=-first.samples)
    campaign = replace(campaign, recordings=(turned, *others))
    found = diagnose(campaign, rng=RNG(0), effects=FEW, search=False)
    assert found.verdict == "named" and not found.effects
    assert [f.id for f in found.corrected.faults] == ["recording_reversed"]
    assert found.after.density.likelihood.noise.others
