"""Recordings that each have a stop of their own: what a wrong label cannot bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.faults.alone import NAMES, SharedModel, fit_alone
from bayesimpact.diagnosis.faults.first_physics import faults_beside_physics
from bayesimpact.diagnosis.faults.own_stops import (
    share_stops,
    shared_places,
    shared_values,
    shown_label,
    with_own_stops,
)
from bayesimpact.diagnosis.faults.recording_faults import cleaned_campaign
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend
from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.trial.rig.recordings import Release

LAWS = {"contact_hardening": {"stiffness": 1.5e9}, "quadratic_drag": {"coefficient": 1.0}}
RELEASES = tuple(
    Release(name, case, y0)
    for name, case, y0 in (
        ("a", "1", -6.5e-3), ("b", "1", -4.5e-3), ("c", "2", -5.5e-3), ("d", "2", -4.8e-3),
        ("e", "2", -6.0e-3),
    )
)  # fmt: skip


@pytest.fixture(scope="module")
def recorded() -> Campaign:
    offsets = {release.name: 0.0 for release in RELEASES}
    chain = small_rig.MeasuringChain(noise=small_rig.NOISE, offsets=offsets)
    return small_rig.record(7, LAWS, releases=RELEASES, chain=chain)


def mislabelled(campaign: Campaign) -> Campaign:
    """Recording e, taken on stop 2, as one of stop 1."""
    recordings = [replace(r, case="1") if r.name == "e" else r for r in campaign.recordings]
    return replace(campaign, recordings=tuple(recordings))


def found(campaign: Campaign) -> list[tuple[str, str]]:
    before = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)
    assert before.identification.fit.reduced_chi2 > 100
    steps = faults_beside_physics(before, campaign, tuple(BY_ID[i] for i in LAWS))
    return [(one.fault.recording, one.fault.id) for step in steps for one in step]


def test_a_wrong_label_is_found_beside_strong_laws_and_no_right_one(recorded: Campaign) -> None:
    assert found(mislabelled(recorded)) == [("e", "recording_case")]
    assert found(recorded) == []


def test_it_is_told_of_the_recording_as_read(recorded: Campaign) -> None:
    """Readings cut at its start count, as in what other faults say."""
    wrong = mislabelled(recorded)
    rest = np.full(150, wrong.recordings[-1].samples[0])
    noise = small_rig.NOISE * np.random.default_rng(3).standard_normal(rest.size)
    late = replace(
        wrong.recordings[-1], samples=np.concatenate([rest + noise, wrong.recordings[-1].samples])
    )
    campaign = replace(wrong, recordings=(*wrong.recordings[:-1], late))
    before = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)
    cut = late.samples.size - before.identification.fit.residuals[-1].size
    assert cut > 100
    (((one,),),) = (faults_beside_physics(before, campaign, tuple(BY_ID[i] for i in LAWS)),)
    assert one.fault.id == "recording_case" and one.fault.spans == ((cut, late.samples.size),)


def test_stiffnesses_show_a_label() -> None:
    campaign = small_rig.record(1, releases=RELEASES, chain=small_rig.MeasuringChain(noise=1e-6))
    right = [5000.0, 5060.0, 3000.0, 2980.0, 3010.0]

    def shown(stiffness: list[float]) -> tuple[int, str] | None:
        names = (f"k2[{release.name}]" for release in RELEASES)
        return shown_label(campaign, dict(zip(names, stiffness, strict=True)))

    assert shown(right) is None
    assert shown([*right[:4], 5020.0]) == (4, "1")
    assert shown([5000.0, 4000.0, 3000.0, 2500.0, 3400.0]) is None  # scatter is no label
    assert shown([*right[:4], 4200.0]) is None  # nor is a stop that no other recording shows
    assert shown([*right[:4], -5020.0]) is None


def test_some_recordings_share_one_of_several_stops() -> None:
    campaign = small_rig.record(1)
    assert share_stops(campaign)
    assert not share_stops(replace(campaign, recordings=campaign.recordings[1:]))
    assert not share_stops(replace(campaign, recordings=campaign.recordings[:2]))


def test_parameters_find_their_places() -> None:
    """Of the stops by what feeds which recording, of all others by name."""
    fit = identify(small_rig.record(3), rng=np.random.default_rng(0), search=False).fit
    own = with_own_stops(fit)
    assert [n for n in own.names if n.startswith("k2")] == ["k2[a]", "k2[b]", "k2[c]"]
    assert own.reduced_chi2 == pytest.approx(fit.reduced_chi2, rel=0.01)
    layout = fit.density.oscillator.layout
    places = shared_places(own.density.oscillator.layout, layout)
    named = dict(zip(own.names, (layout.names[i] for i in places), strict=True))
    assert named.pop("k2[a]") == named.pop("k2[b]") == "k2[1]" and named.pop("k2[c]") == "k2[2]"
    assert all(one == other for one, other in named.items())
    known = dict(zip(own.names, map(float, own.mode), strict=True))
    values = shared_values(known, own.density.oscillator.layout, layout)
    assert set(values) == set(fit.names)
    assert values["k2[1]"] == pytest.approx((own.value("k2[a]") + own.value("k2[b]")) / 2)
    laws = [BY_ID["contact_damping_per_case"]]
    scales = campaign_scales(fit)
    layouts = (extend(f, laws, scales).oscillator.layout for f in (own, fit))
    places = shared_places(*layouts)
    assert np.bincount(places).max() == 2 and places.min() == 0


def test_a_recording_alone_has_the_damping_of_its_own_stop() -> None:
    """It is what makes stops differ, and says nothing of which stop it was."""
    law = BY_ID["contact_damping_per_case"]
    campaign = small_rig.record(4)
    model = SharedModel(Noise(level=small_rig.NOISE), (law,))
    alone = fit_alone(campaign, campaign.recordings[0], model)
    assert alone is not None and alone.reduced_chi2 < 1.2
    variance = dict(zip(NAMES, np.diag(alone.covariance), strict=True))
    assert variance["k2"] < 1.0 and variance["c2"] == 1e6
