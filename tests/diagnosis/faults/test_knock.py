"""A knock in mid-record, told by a model with the physics that is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.faults.change_point import parameter_basis
from bayesimpact.diagnosis.faults.first_physics import faults_beside_physics
from bayesimpact.diagnosis.faults.knock import _score, _sums, knocks_beside, likeliest_jump
from bayesimpact.diagnosis.faults.recording_faults import cleaned_campaign, fault_as_read
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.revision import first_revision, revised
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import EFFECTS, SEARCHED
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release

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
    "obstacle_mass": {"mass": 7.5e-3},  # the end of one contact would be taken for one
}
IMPULSE, WIDTH = 0.004, 0.01  # N s, s
OTHER_STATES = (("second", -4.3e-3, 4e-3), ("third", -4.8e-3, -6e-3))  # m, m/s
BREAKS = (900, 2200)  # samples
WITHOUT = MeasuringChain(noise=small_rig.NOISE)


def recorded(effects: Mapping[str, Any], time: float | None = None, **how: Any) -> Campaign:
    """A campaign of which the second recording gets a knock."""
    campaign = small_rig.record(5, effects, **how)
    if time is None:
        return campaign
    knock = {"impulse": IMPULSE, "time": time, "width": WIDTH}
    knocked = small_rig.record(5, {**effects, "knock": knock}, **how)
    recordings = list(campaign.recordings)
    recordings[1] = knocked.recordings[1]
    return replace(campaign, recordings=tuple(recordings))


def fits(campaign: Campaign, *names: str) -> tuple[Fit, Fit]:
    """Of the base model, and with effects."""
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    if not names:
        return base, base
    effects = [BY_ID[name] for name in names]
    return base, fit_from(base, effects, {}, campaign_scales(base)).fit


@pytest.mark.parametrize(
    ("stop", "time", "kept"), [(True, 0.71, "start_s"), (False, 1.36, "end_s")]
)
def test_a_knock_is_told_and_what_follows_it_left_out(stop: bool, time: float, kept: str) -> None:
    """The longer part stays, and the model fits it."""
    how = {} if stop else {"rig": small_rig.PLAIN, "releases": small_rig.PLAIN_RELEASES}
    base, found = fits(recorded(PHYSICS, time, **how), *PHYSICS)
    told = knocks_beside(base, found)
    assert told is not None
    (compared,), plain, first = told
    fault = compared.fault
    assert (fault.id, fault.recording) == ("recording_knock", "b")
    assert fault.remedy.startswith(kept)
    assert fault.start_s - 0.03 < time < fault.end_s + 0.03
    assert first.reduced_chi2 < 1.1 < found.reduced_chi2
    assert plain.density.oscillator.campaign is compared.campaign
    campaign = found.density.oscillator.campaign
    sizes = [r.samples.size for r in campaign.recordings]
    after = [r.samples.size for r in compared.campaign.recordings]
    assert [a == b for a, b in zip(sizes, after, strict=True)].count(False) == 1
    assert after[1] > 0.6 * sizes[1]


def test_what_stays_is_free_of_a_blow_that_lasts() -> None:
    """For a quarter of a period: the first readings after it would be a second mode's."""
    time, width = 0.7, 0.25 * 2 * np.pi * float(np.sqrt(small_rig.PLAIN.mass / small_rig.PLAIN.k1))
    effects = {
        "spring_cubic": PHYSICS["spring_cubic"],
        "knock": {"impulse": 2 * IMPULSE, "time": time, "width": width},
    }
    releases = small_rig.PLAIN_RELEASES
    struck = small_rig.record(5, effects, rig=small_rig.PLAIN, releases=releases, duration=2.0)
    told = knocks_beside(*fits(struck, "spring_cubic"))
    assert told is not None and len(told[0]) == 2
    for one in told[0]:
        ((first, end),) = one.fault.spans
        assert first == 0 and time + width < end * struck.recordings[0].interval < time + 2 * width
    assert told[2].reduced_chi2 < 1.03


def knocked_about() -> Campaign:
    """A recording that goes on from another state twice, and another one that does once."""
    releases = (*small_rig.RELEASES[:2], replace(small_rig.RELEASES[2], y0=-4e-3))
    more = [replace(releases[1], name=n, y0=y, v0=v) for n, y, v in OTHER_STATES]
    whole = small_rig.record(5, PHYSICS, releases=(*releases, *more), duration=4.0, chain=WITHOUT)
    _, b, _, second, third = (r.samples for r in whole.recordings)
    first, last = BREAKS
    glued = np.concatenate([b[:first], second[first:last], third[last:]])
    knock = {"impulse": IMPULSE, "time": 1.7, "width": WIDTH}
    again = small_rig.record(
        6, {**PHYSICS, "knock": knock}, releases=releases, duration=4.0, chain=WITHOUT
    )
    recordings = list(whole.recordings[:3])
    recordings[1] = replace(recordings[1], samples=glued)
    recordings[2] = again.recordings[2]
    return replace(whole, recordings=tuple(recordings))


def test_several_knocks_are_told_together() -> None:
    """No single new start leaves far less; of every recording its longest part stays."""
    base, found = fits(knocked_about(), *PHYSICS)
    told = knocks_beside(base, found)
    assert told is not None
    compared, plain, first = told
    edges = [(c.fault.recording, c.fault.start_s, c.fault.end_s) for c in compared]
    wanted = [("b", 1e-3 * at) for at in BREAKS] + [("c", 1.705)]
    assert len(edges) == len(wanted)
    for (name, start, end), (own, at) in zip(sorted(edges), wanted, strict=True):
        assert name == own
        assert start - 0.03 < at < end + 0.03
    sizes = [r.samples.size for r in first.density.oscillator.campaign.recordings]
    assert sizes == [r.samples.size for r in plain.density.oscillator.campaign.recordings]
    assert sizes[0] == 4000
    assert sizes[1] == pytest.approx(4000 - BREAKS[1], abs=30)
    assert sizes[2] == pytest.approx(4000 - 1705, abs=30)
    assert first.reduced_chi2 < 1.1
    assert first.names == found.names
    campaign = found.density.oscillator.campaign
    before = [campaign, *(c.campaign for c in compared)]
    for name, size in (("b", sizes[1]), ("c", sizes[2])):
        spans = [
            fault_as_read(c.fault, now, campaign).spans[0]
            for c, now in zip(compared, before, strict=False)
            if c.fault.recording == name
        ]
        beyond = np.concatenate([np.arange(*span) for span in spans])
        assert sorted(beyond) == list(range(4000 - size))  # each reading once


def test_revised_search_begins_without_it() -> None:
    base, found = fits(recorded(PHYSICS, 0.71), *PHYSICS)
    assert first_revision(base, found, print) is not None
    state: Any = SimpleNamespace(candidate=SimpleNamespace(fit=found), is_white=False)
    revision = revised(base, state, lambda message: None)
    assert revision is not None and revision.first is not None
    assert [one.fault.id for one in revision.faults] == ["recording_knock"]
    assert revision.first.names == found.names


@pytest.mark.parametrize("names", [(), ("spring_cubic",)])
def test_a_recording_with_a_knock_is_of_no_other_rig(names: tuple[str, ...]) -> None:
    """By its own parameters, beside the law that is asked for first, it would be."""
    plain: dict[str, Any] = {"rig": small_rig.PLAIN, "releases": [*small_rig.PLAIN_RELEASES]}
    plain["releases"].append(replace(small_rig.PLAIN_RELEASES[0], name="c", y0=5.5e-3, v0=0.0))
    campaign = recorded({name: PHYSICS[name] for name in names}, 0.9, **plain)
    cleaned = cleaned_campaign(campaign, rng=np.random.default_rng(0), search=False)
    steps = faults_beside_physics(cleaned, campaign, SEARCHED)
    assert [(one.fault.id, one.fault.recording) for step in steps for one in step] == [
        ("recording_knock", "b")
    ]


@pytest.mark.parametrize("effect", MISSING)
def test_missing_physics_is_no_knock(effect: str) -> None:
    """It does not end with a new start."""
    base, _ = fits(recorded({effect: MISSING[effect]}))
    assert base.reduced_chi2 > 2.0
    assert knocks_beside(base, base) is None


@pytest.mark.parametrize(
    ("law", "values", "others"),
    [
        ("detent", {"stiffness": -160.0, "place": -2e-3, "width": 4e-4}, (3e-3, 2e-3)),
        ("contact_preload", {"force": 0.1}, (4.5e-3, 5.5e-3)),
    ],
)
def test_a_knock_that_a_force_of_all_recordings_explains_is_none(
    law: str, values: Mapping[str, float], others: tuple[float, float]
) -> None:
    """Beside a stop a force that no model holds puts one contact off, and what follows it."""
    amplitudes = (6.5e-3, *others)
    releases = [Release(n, k, -y) for n, k, y in zip("abc", "112", amplitudes, strict=True)]
    effects = {"spring_cubic": PHYSICS["spring_cubic"], law: values}
    campaign = small_rig.record(3, effects, releases=releases)
    base, found = fits(campaign, "spring_cubic")
    assert knocks_beside(base, found) is not None
    assert first_revision(base, found, print) is None


def test_adequate_model_shows_no_jump() -> None:
    _, found = fits(recorded(PHYSICS), *PHYSICS)
    assert all(likeliest_jump(found, r) is None for r in range(3))


def test_score_is_that_of_a_simulated_jump() -> None:
    """Against the explicit column of a jump at one sample, stretches of free changes included."""
    _, found = fits(recorded(PHYSICS, 0.71), *PHYSICS)
    r, at = 1, 900
    signals = np.column_stack([parameter_basis(found)[r], found.linearisation[r].residual]).T
    score = _score(_sums(found, r, signals, 0))[at]
    oscillator, sigma = found.density.oscillator, found.density.likelihood.noise
    y = oscillator.displacements(found.mode)[r]
    (v,) = oscillator.motions_of(
        np.array([r]), oscillator.layout.slots(found.mode)[[r]], np.array([1])
    )
    columns = []
    for change in ([1e-9, 0.0], [0.0, 1e-8]):
        states = [np.array([[at, y[at] + s * change[0], v[at] + s * change[1]]]) for s in (-1, 1)]
        low, high = (oscillator.predict_restarted(r, found.mode[None], s)[0] for s in states)
        columns.append((high - low) / np.abs(change).max())
    recording = oscillator.campaign.recordings[r]
    moved = sigma.whitened(recording, np.array(columns))
    basis = parameter_basis(found)[r]
    slope = moved @ found.linearisation[r].residual
    size = moved @ moved.T - (moved @ basis) @ (moved @ basis).T
    assert score == pytest.approx(slope @ np.linalg.solve(size, slope), rel=0.02)
