"""A gain or a clock that is off, told by a model with the physics that is missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults import beside_model
from bayesimpact.diagnosis.faults.beside_model import fault_beside
from bayesimpact.diagnosis.faults.together import Hypothesis
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.revision import first_revision, revised
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import EFFECTS
from bayesimpact.trial.rig.recordings import Release

BY_ID = {e.id: e for e in EFFECTS}
PHYSICS = {"spring_cubic": {"stiffness": 6e6}, "coulomb_friction": {"force": 0.02}}
OFF = {"recording_gain": 3.0, "recording_clock": -0.25}  # %, as statements have them
Change = Callable[[Recording], Recording]
CHANGES: dict[str, Change] = {
    "recording_gain": lambda r: replace(r, samples=r.samples * 1.03),
    "recording_clock": lambda r: replace(r, interval=r.interval * (1 - 0.0025)),
}


def recorded(change: Change | None, at: int = 1, seed: int = 5) -> Campaign:
    campaign = small_rig.record(seed, PHYSICS)
    recordings = list(campaign.recordings)
    if change is not None:
        recordings[at] = change(recordings[at])
    return replace(campaign, recordings=tuple(recordings))


def fits(campaign: Campaign, *more: str) -> tuple[Fit, Fit]:
    """Of the base model and of the physics in the recordings, with more effects."""
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    effects = [BY_ID[name] for name in (*PHYSICS, *more)]
    return base, fit_from(base, effects, {}, campaign_scales(base)).fit


def state_of(fit: Fit) -> Any:
    """That leaves something."""
    return SimpleNamespace(candidate=SimpleNamespace(fit=fit), is_white=False)


@pytest.mark.parametrize("more", [(), ("gap_per_recording",)])
@pytest.mark.parametrize("kind", CHANGES)
def test_a_fault_is_told_with_its_size(kind: str, more: tuple[str, ...]) -> None:
    """Also where gaps of every recording's own have taken its place."""
    base, found = fits(recorded(CHANGES[kind]), *more)
    told = fault_beside(base, found)
    assert told is not None
    compared, fit = told
    assert (compared.fault.id, compared.fault.recording) == (kind, "b")
    assert compared.fault.size == pytest.approx(OFF[kind], rel=0.03)
    assert abs(compared.fault.size - OFF[kind]) < 4 * compared.fault.error < 0.2 * abs(OFF[kind])
    assert fit.reduced_chi2 < 1.1 < compared.before
    assert {e.id for e in fit.density.oscillator.effects} == set(PHYSICS)
    assert fit.density.oscillator.campaign is compared.campaign
    assert first_revision(base, found, print) is not None


def test_a_search_is_revised_without_all_that_is_off() -> None:
    """A spike shows once the clock is right, and readings with it hardly tell of that."""
    campaign = recorded(CHANGES["recording_clock"])
    spiked, *others = campaign.recordings
    samples = spiked.samples.copy()
    samples[901] += 30 * small_rig.NOISE
    campaign = replace(campaign, recordings=(replace(spiked, samples=samples), *others))
    base, found = fits(campaign)
    told: list[str] = []
    anew = revised(base, state_of(found), told.append)
    assert anew is not None and anew.first is not None
    kinds = {(one.fault.id, one.fault.recording) for one in anew.faults}
    assert kinds == {("recording_clock", "b"), ("recording_spikes", "a")}, told
    assert anew.first.reduced_chi2 < 1.1
    assert anew.base.density.oscillator.campaign is anew.first.density.oscillator.campaign
    assert revised(anew.base, state_of(anew.first), told.append) is None


def test_a_gain_that_shrinks_a_recording_leaves_what_its_noise_would_be() -> None:
    """Without that a recording divided by twenty would leave nothing of a third of the misfit."""
    _, found = fits(recorded(None))
    gain = beside_model._Guess(Hypothesis("recording_gain", 1), float(np.log(20.0)), 0.1, 90.0)
    clock = replace(gain, hypothesis=Hypothesis("recording_clock", 1))
    sizes = found.density.likelihood.sizes
    expected = 20.0 ** (2 * float(sizes[1] / sizes.sum()))
    assert beside_model._left(gain, found) == pytest.approx(expected * found.reduced_chi2)
    assert beside_model._left(clock, found) == found.reduced_chi2


def test_physics_that_is_missing_is_no_fault() -> None:
    """Of each law alone, the other one left out."""
    campaign = recorded(None)
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    for name in PHYSICS:
        found = fit_from(base, [BY_ID[name]], {}, campaign_scales(base)).fit
        assert found.reduced_chi2 > 2.0
        assert fault_beside(base, found) is None


@pytest.mark.parametrize(
    ("place", "amplitudes", "imitated"),
    [
        (1e-3, (6.5e-3, 3e-3, 2e-3), ("recording_clock", "c")),
        (3e-3, (6.5e-3, 3e-3, 2e-3), ("recording_gain", "a")),
        (1e-3, (6.5e-3, 5e-3, 1.5e-3), ("recording_gain", "c")),
    ],
)
def test_a_fault_that_a_force_of_all_recordings_explains_is_none(
    place: float, amplitudes: tuple[float, ...], imitated: tuple[str, str]
) -> None:
    """A magnetic detent, that no model holds, changes the recording with another amplitude most."""
    detent = {"stiffness": -40.0, "place": place, "width": 4e-4}
    effects = {"spring_cubic": PHYSICS["spring_cubic"], "detent": detent}
    releases = tuple(Release(n, "", -y) for n, y in zip("abc", amplitudes, strict=True))
    campaign = small_rig.record(3, effects, rig=small_rig.PLAIN, releases=releases)
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    found = fit_from(base, [BY_ID["spring_cubic"]], {}, campaign_scales(base)).fit
    told = fault_beside(base, found)
    assert told is not None and (told[0].fault.id, told[0].fault.recording) == imitated
    assert first_revision(base, found, print) is None


def test_recordings_that_agree_have_none() -> None:
    base, found = fits(recorded(None), "gap_per_recording")
    assert fault_beside(base, found) is None and first_revision(base, found, print) is None


def test_gaps_of_every_recordings_own_are_no_gain_of_one() -> None:
    """All three differ: one corrected gain leaves the others apart."""
    gaps = {"gap_per_recording": {"g": {"a": 1.1e-3, "b": 1.06e-3, "c": 1.15e-3}}}
    campaign = small_rig.record(7, {**PHYSICS, **gaps})
    base, found = fits(campaign, "gap_per_recording")
    assert found.reduced_chi2 < 1.1
    assert fault_beside(base, found) is None


def test_what_is_kept_as_read_is_not_asked() -> None:
    base, found = fits(recorded(CHANGES["recording_gain"]))
    campaign = found.density.oscillator.campaign
    oscillator = replace(found.density.oscillator, campaign=replace(campaign, keep_faults=True))
    likelihood = replace(found.density.likelihood, oscillator=oscillator)
    kept = replace(found, density=replace(found.density, likelihood=likelihood))
    assert fault_beside(base, kept) is None


def test_of_two_recordings_neither_is_the_faulty_one() -> None:
    campaign = recorded(CHANGES["recording_gain"])
    base, found = fits(replace(campaign, recordings=campaign.recordings[:2]))
    assert fault_beside(base, found) is None


def test_directions_are_what_a_fault_changes() -> None:
    """Against differences of the residual of corrected recordings."""
    _, found = fits(recorded(None))
    for kind in CHANGES:
        hypothesis = beside_model.Hypothesis(kind, 1)
        (direction,) = beside_model._directions(found, [hypothesis])[1].T
        small = 1e-5
        step = beside_model.Weighed(hypothesis, 0.0, value=small)
        other = beside_model.corrected(found.density.oscillator.campaign, 1, step)
        moved = found.with_recordings(other.recordings)
        sigma = found.mode[found.density.likelihood.sigma_columns][1]
        change = (found.residuals[1] - moved.residuals[1]) / small / sigma
        assert change == pytest.approx(direction, abs=0.02 * float(np.abs(direction).max()))
