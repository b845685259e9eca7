"""What a nearly good model shows of the readings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.faults import outliers
from bayesimpact.diagnosis.faults.outliers import beside_spikes, residual_spikes
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection import revision, search
from bayesimpact.diagnosis.selection.revision import first_revision, misses_onsets, revised
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.onsets import without_onsets
from bayesimpact.inference.refitted import refitted

RNG = np.random.default_rng
DAMPED = replace(small_rig.RIG, c2=8.0)
CUBIC = {"spring_cubic": {"stiffness": 6e6}}


@pytest.fixture(scope="module")
def base() -> Fit:
    """A base fit that misses accelerations by far, its contacts by a sample and more."""
    chain = small_rig.MeasuringChain(noise=0.05, offsets=dict.fromkeys("abc", 0.0))
    campaign = small_rig.record(
        5, CUBIC, rig=DAMPED, chain=chain, quantity="acceleration", rate=2000.0, duration=3.0
    )
    return identify(campaign, rng=RNG(0), search=False).fit


@pytest.fixture(scope="module")
def good(base: Fit) -> Fit:
    return fit_from(base, [BY_ID["spring_cubic"]], {}, campaign_scales(base)).fit


@pytest.fixture(scope="module")
def across(good: Fit) -> Fit:
    """The good model, of readings one of which lies across the jump of an onset."""
    recordings = list(good.density.oscillator.campaign.recordings)
    used, before = without_onsets(good).recordings[0].used, recordings[0].used
    assert used is not None
    place = int(np.flatnonzero(~used if before is None else before & ~used)[0])
    samples = recordings[0].samples.copy()
    samples[place] += 1.0
    recordings[0] = replace(recordings[0], samples=samples)
    return good.with_recordings(recordings)


def test_onsets_are_those_of_the_good_model(base: Fit, good: Fit, across: Fit) -> None:
    """Without them one mode is found from any side: no step lies between."""
    assert base.reduced_chi2 > 30 and good.reduced_chi2 < 2.0
    assert misses_onsets(good) and first_revision(base, base, print) is None
    assert not misses_onsets(refitted(good, without_onsets(good)))
    examined: Any = SimpleNamespace(candidate=SimpleNamespace(fit=across), is_white=True)
    told: list[str] = []
    revision = revised(base, examined, told.append)
    assert revision is not None and revision.first is not None and told
    campaign = revision.first.density.oscillator.campaign
    assert campaign is revision.base.density.oscillator.campaign
    assert (
        first_revision(revision.base, revision.first, print) is None
        and 0.9 < revision.first.reduced_chi2 < 1.1
    )
    ends = [
        refitted(good, without_onsets(good), start=replace(good, mode=start)).log_posterior
        for start in good.draws(RNG(2), 6)
    ]
    assert np.ptp(ends) < 0.01


def test_readings_across_a_jump_bend_parameters_and_leave_no_residual(good: Fit) -> None:
    """So that onsets are set aside whether or not a reading beside one stands out."""
    left = [np.max(np.abs(x)) / good.density.likelihood.noise.level for x in good.residuals]
    assert max(left) < 5.0 and misses_onsets(good)
    smooth = replace(good.density.likelihood.noise, level=1e3)
    quiet = replace(good.density.likelihood, noise=smooth)
    assert not misses_onsets(replace(good, density=replace(good.density, likelihood=quiet)))


@pytest.mark.parametrize(("jump", "share"), [(0.0, 0.3), (0.0, 0.7), (6.0, 0.3), (6.0, 0.7)])
def test_a_change_of_slope_is_no_jump(jump: float, share: float) -> None:
    """As where a stiff obstacle without damping sets in, anywhere between two samples; a jump is
    told less what the change of slope may be.
    """
    t = np.arange(20.0) - 9.0 - share
    x = 0.1 * t + np.where(t > 0.0, 5.0 * t + jump, 0.0)
    assert max(jump - 5.0, 0.0) - 1e-9 < np.max(revision._jumps(x)) < jump + 1e-9


def test_a_spike_is_one_that_the_fit_without_it_misses(good: Fit) -> None:
    """And one that it explains is counted again."""
    recordings = list(good.density.oscillator.campaign.recordings)
    samples = recordings[1].samples.copy()
    samples[901] -= 1.5
    recordings[1] = replace(recordings[1], samples=samples)
    spiked = good.with_recordings(recordings)
    found = beside_spikes(spiked)
    assert found is not None
    ((fault,), clean) = found
    assert (fault.recording, fault.spans) == ("b", ((901, 902),))
    campaign = spiked.density.oscillator.campaign
    assert outliers._still_off(campaign, clean, [fault]) == (fault,)
    right = good.density.oscillator.campaign  # the reading as it was
    assert outliers._still_off(right, clean, [fault]) == ()
    assert beside_spikes(good) is None
    kept = replace(campaign, keep_faults=True)
    oscillator = replace(spiked.density.oscillator, campaign=kept)
    likelihood = replace(spiked.density.likelihood, oscillator=oscillator)
    assert (
        beside_spikes(replace(spiked, density=replace(spiked.density, likelihood=likelihood)))
        is None
    )


def test_of_displacements_there_is_nothing_to_revise() -> None:
    fit = identify(small_rig.record(5, CUBIC), rng=RNG(0), search=False).fit
    found = fit_from(fit, [BY_ID["spring_cubic"]], {}, campaign_scales(fit)).fit
    examined: Any = SimpleNamespace(candidate=SimpleNamespace(fit=found), is_white=True)
    assert first_revision(fit, found, print) is None
    assert revised(fit, examined, pytest.fail) is None


def test_draws_have_the_covariance_of_the_approximation_whatever_the_units(good: Fit) -> None:
    """Of scales ten decades apart; standard errors of 2,000 draws."""
    units = np.where(np.arange(good.mode.size) % 2 == 0, 1e6, 1e-6)
    scaled = replace(
        good, mode=units * good.mode, covariance=good.covariance * np.outer(units, units)
    )
    count = 2000
    z = (scaled.draws(RNG(3), count, 2.0) - scaled.mode) / scaled.sd
    expected = 4.0 * scaled.covariance / np.outer(scaled.sd, scaled.sd)
    error = np.sqrt((expected**2 + 16.0) / count)
    assert np.abs((z.T @ z / count - expected) / error).max() < 4.5


@dataclass(frozen=True)
class MadeUpSelection:
    """Which search it is of: the first, or the revised one."""

    of: str
    faults: tuple[Any, ...] = ()
    band_limited: bool = False


@pytest.mark.parametrize(
    ("cut", "posed", "white", "of"),
    [
        (True, True, False, "anew"),
        (False, True, False, "first"),
        (False, True, True, "anew"),
        (False, False, False, "first"),
    ],
)
def test_which_search_answers(
    monkeypatch: pytest.MonkeyPatch, cut: bool, posed: bool, white: bool, of: str
) -> None:
    """One that was cut short is no answer, whatever the revised one leaves."""
    made: list[Any] = []

    class Search:
        is_last, revision = False, None

        def __init__(self, *about: Any) -> None:
            self.budget = SimpleNamespace(may_search_again=lambda: True)
            made.append(self)

        def found(self, base: Any, first: Any) -> tuple[Any, Any]:
            self.revision = "told" if cut and not self.is_last else None
            examined = SimpleNamespace(
                candidate=SimpleNamespace(fit="reached", effects=()), is_white=white
            )
            return base, examined

        def selection(self, base: Any, examined: Any) -> MadeUpSelection:
            return MadeUpSelection("first" if self is made[0] else "anew")

    revision = (
        SimpleNamespace(base="clean", first=None, faults=("spike",), band_limited=True)
        if posed
        else None
    )
    monkeypatch.setattr(search, "_Search", Search)
    asked: list[Any] = []
    monkeypatch.setattr(search, "revised", lambda *about: asked.append(about[-1]) or revision)
    monkeypatch.setattr(search, "_beside_hums", lambda *about: None)
    fit: Any = "base"
    scales: Any = None
    found: Any = search.select_model(fit, (), scales, rng=RNG(0))
    assert found == MadeUpSelection(of, *((("spike",), True) if of == "anew" else ()))
    assert asked == ["told" if cut else None]  # what cut it is not told twice


def test_a_reading_across_the_jump_of_an_onset_is_no_spike(across: Fit) -> None:
    assert misses_onsets(across)
    assert residual_spikes(across, contacts=False) == ()
    assert beside_spikes(across) is None
