"""A hand that lets go in mid-swing is found against a fit, and physics is not taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import start_fault
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults.recording_faults import (
    Corrected,
    cleaned_campaign,
    without_faults,
)
from bayesimpact.diagnosis.faults.unfree_start import (
    BETTER,
    _alone,
    _ratio,
    unfree_starts,
)
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.linear_response.free_changes import motions_beside

pytestmark = pytest.mark.usefixtures("catalogue_alone")

PERIOD = 2 * np.pi * np.sqrt(small_rig.PLAIN.mass / small_rig.PLAIN.k1)


def plain(effects=None, duration: float = 4.0) -> Campaign:
    return small_rig.record(
        3, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=duration
    )


def fitted(campaign: Campaign) -> Fit:
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def pushed(campaign: Campaign, until: float) -> Campaign:
    """The first recording pushed by a force that ends at a time, s."""
    fit = fitted(campaign)
    o, first = fit.density.oscillator, campaign.recordings[0]
    push = np.where(first.times < until, 1.5 * np.sin(25.0 * first.times) + 1.0, 0.0)
    q = o.layout.slots(fit.mode)[[0]]
    moved, still = (
        motions_beside(o, 0, q, 0, waves=w[None])[0] for w in (push, np.zeros_like(push))
    )
    changed = replace(first, samples=first.samples + moved - still)
    return replace(campaign, recordings=(changed, *campaign.recordings[1:]))


@pytest.mark.parametrize("share", [0.2, 0.45, 0.8, 1.8])
def test_a_push_that_ends_in_mid_swing_is_found(share):
    (fault,) = unfree_starts(fitted(pushed(plain(), share * PERIOD)))
    assert (fault.id, fault.recording, fault.action) == ("recording_start", "a", "cut")
    assert share * PERIOD - 2e-3 <= fault.size < 2.1 * max(share, 0.25) * PERIOD


@pytest.mark.parametrize(
    "effects",
    [
        None,
        {"spring_cubic": {"stiffness": 3e6}},
        {"quadratic_drag": {"coefficient": 3.0}},
        {"coulomb_friction": {"force": 0.1}},
    ],
    ids=["nothing", "cubic", "drag", "friction"],
)
def test_physics_is_no_start(effects):
    assert unfree_starts(fitted(plain(effects))) == ()


def test_physics_that_decays_with_the_motion_is_no_start() -> None:
    """A third of the amplitude leaves a thirtieth of a cubic force: the rest fits far better."""
    rig = replace(small_rig.PLAIN, c1=2.4)
    campaign = small_rig.record(
        3, {"spring_cubic": {"stiffness": 1e7}}, rig=rig, releases=small_rig.PLAIN_RELEASES
    )
    fit = fitted(campaign)
    at = round(3 * PERIOD / campaign.recordings[0].interval)
    assert _ratio(_alone(fit, 0, 0), _alone(fit, 0, at), at) > BETTER
    assert unfree_starts(fit) == ()


def test_channels_of_one_motion_are_fitted_each_from_their_common_start():
    """The second one has no state of its own in the whole campaign's fit."""
    campaign = plain({"spring_cubic": {"stiffness": 3e6}})
    one, noise = campaign.recordings[0], np.random.default_rng(1)
    samples = one.samples + small_rig.NOISE * noise.standard_normal(one.samples.size)
    other = replace(one, name="other", samples=samples)
    pair = tuple(replace(r, motion_name="first") for r in (one, other))
    fit = fitted(replace(campaign, recordings=pair))
    assert "y0[other]" not in fit.names
    assert unfree_starts(fit) == ()


def test_a_channel_of_free_gain_is_fitted_with_its_own_gain_and_prior() -> None:
    campaign = plain()
    one = campaign.recordings[0]
    other = replace(one, name="other", samples=1.04 * one.samples, free_gain=True)
    pair = tuple(replace(r, motion_name="first") for r in (one, other))
    fit = fitted(replace(campaign, recordings=pair))
    alone = _alone(fit, 1, 0)
    assert alone.value("gain[other]") == pytest.approx(1.04, abs=0.1)
    own, whole = (f.density.priors.parameters[f.names.index("gain[other]")] for f in (alone, fit))
    assert own == whole
    assert alone.reduced_chi2 == pytest.approx(1.0, abs=0.15)


@pytest.mark.long
def test_physics_is_named_without_the_push():
    """A drift of the probe adds to any motion, so that what is put together here is one."""
    campaign = pushed(plain({"sensor_drift": {"rate": 2e-5}}, duration=1.5), 0.4 * PERIOD)
    effects = tuple(BY_ID[i] for i in ("sensor_drift", "spring_cubic", "coulomb_friction"))

    def named(campaign: Campaign, effects=effects) -> tuple[str, list[str], list[str]]:
        found = diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)
        faults = found.corrected.faults if found.corrected else ()
        return found.verdict, [e.id for e in found.effects], [f.id for f in faults]

    assert named(campaign) == ("named", ["sensor_drift"], ["recording_start"])
    assert named(replace(campaign, keep_faults=True), effects[:1])[2] == []


def test_what_leaves_no_oscillation_is_not_set_aside() -> None:
    """A diagnosis of a decay whose start a fit took for unfree once ended there, in a refusal."""
    t = 0.02 * np.arange(300)
    samples = 1e-2 * np.exp(-2.5 * t) * np.cos(9.0 * t)
    samples += 1e-5 * np.random.default_rng(0).standard_normal(t.size)
    campaign = Campaign("rig", 1.0, (Recording("a", "", samples, 0.02),), stop=False)
    found = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)

    def cut(first: int) -> Corrected:
        fault = start_fault(campaign.recordings[0], first, 10.0, 4.0)
        return without_faults(found, [fault], campaign, rng=np.random.default_rng(0))

    assert cut(200) is found
    assert cut(30).identification.fit.density.oscillator.campaign.recordings[0].samples.size < 300
