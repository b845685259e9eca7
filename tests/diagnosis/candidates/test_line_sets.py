"""A harmonic force that the equation of motion asks for, and the search that begins beside it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.quantity import Quantity
from bayesimpact.diagnosis.candidates.equation_error import Path, measured_paths, without_rest
from bayesimpact.diagnosis.candidates.likely_sets import EffectSet, LikelySets
from bayesimpact.diagnosis.candidates.line_sets import _waves, sets_with_a_line
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import base_candidate, fit_from
from bayesimpact.diagnosis.selection.asking import Asking
from bayesimpact.diagnosis.selection.unlisted import Unlisted
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED
from bayesimpact.trial.rig.recordings import Effects

FORCE = BY_ID["harmonic_forcing"]
STRONG = {"amplitude": 0.15, "frequency": 2.3, "phase": 1.0}  # below the motion's own frequency
SECOND_STAGE = {"depth": 4e-4, "stiffness": 4000.0}
NEAR_MODE = {"base_motion": {"frequency": 6.9, "damping": 0.005, "mass_ratio": 0.006}}


def stopped(effects: Effects) -> Campaign:
    return small_rig.record(3, effects, duration=3.0)


def plain(effects: Effects) -> Campaign:
    return small_rig.record(
        3, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0, rate=500.0
    )


def fitted(campaign: Campaign) -> Fit:
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def asked_for(fit: Fit, *, flight: bool) -> list[EffectSet]:
    problem = LikelySets(fit, SEARCHED, campaign_scales(fit), flight=flight)
    return sets_with_a_line(problem, FORCE, 5)


@pytest.fixture(scope="module")
def shaken() -> Fit:
    return fitted(stopped({"harmonic_forcing": STRONG}))


def test_a_force_slower_than_the_motion_is_asked_for_in_flight(shaken: Fit) -> None:
    """So near its numbers that a fit from there leaves nothing."""
    assert shaken.reduced_chi2 > 100
    first = asked_for(shaken, flight=True)[0]
    assert [e.id for e in first.effects] == ["harmonic_forcing"]
    value = first.values
    assert value["harmonic_forcing.frequency"] == pytest.approx(STRONG["frequency"], rel=0.01)
    assert value["harmonic_forcing.amplitude"] == pytest.approx(STRONG["amplitude"], rel=0.05)
    for r in shaken.density.oscillator.campaign.recordings:
        away = value[f"harmonic_forcing.phase[{r.name}]"] - STRONG["phase"]
        assert abs(np.angle(np.exp(1j * away))) < 0.1
    found = fit_from(shaken, first.effects, value, campaign_scales(shaken)).fit
    assert found.reduced_chi2 < 1.1


def test_a_recording_that_tells_nothing_takes_nothing_from_the_amplitude(shaken: Fit) -> None:
    """In flight a short one may have no stretch at all."""
    first, second, *others = shaken.density.oscillator.campaign.recordings
    short = replace(second, used=np.arange(second.samples.size) < 60)
    fit = shaken.with_recordings((first, short, *others))
    value = asked_for(fit, flight=True)[0].values
    assert value["harmonic_forcing.amplitude"] == pytest.approx(STRONG["amplitude"], rel=0.05)


@pytest.mark.parametrize(
    "campaign",
    [
        stopped({}),
        stopped({"contact_second_stage": SECOND_STAGE}),
        plain({"spring_cubic": {"stiffness": 1e6}, "quadratic_drag": {"coefficient": 3.0}}),
    ],
)
def test_no_line_is_asked_for_where_other_effects_explain_as_much(campaign: Campaign) -> None:
    fit = fitted(campaign)
    assert asked_for(fit, flight=campaign.stop) == []


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
def test_integrals_of_waves_are_those_of_sampled_ones(quantity: Quantity) -> None:
    """The closed form against the sum over samples, as every other force is integrated."""
    campaign = small_rig.record(
        3,
        {},
        rig=small_rig.PLAIN,
        releases=small_rig.PLAIN_RELEASES,
        duration=3.0,
        quantity=quantity,
    )
    (path, *_) = measured_paths(fitted(campaign))
    grid = np.array([0.7, 2.0, 9.3])
    expected = _summed(path, grid)
    np.testing.assert_allclose(_waves(path, grid), expected, atol=1e-9 * np.abs(expected).max())


def _summed(path: Path, grid: np.ndarray) -> np.ndarray:
    angle = 2 * np.pi * grid[:, None] * path.t
    waves = -np.stack([np.sin(angle), np.cos(angle)], axis=1).reshape(2 * grid.size, -1)
    found = without_rest(path, path.rows.integrals(waves).T)
    return np.asarray(found.reshape(-1, grid.size, 2))


@pytest.mark.parametrize("is_shaken", [True, False])
def test_a_refused_line_counts_on_the_way_where_it_was_asked_for(
    is_shaken: bool,
) -> None:
    search = Unlisted((FORCE,), None, np.random.default_rng(0), print)  # type: ignore[arg-type]
    search.is_driven = is_shaken
    refused: Any = SimpleNamespace(
        effects=(FORCE,), log_evidence=-np.inf, refused=50.0, price=lambda cost: cost
    )
    promise = 50.0 - search.cost if is_shaken else -np.inf
    assert search.promise(refused) == promise


@pytest.mark.long
def test_a_force_slower_than_the_motion_is_named_beside_what_the_stop_does() -> None:
    campaign = stopped({"harmonic_forcing": STRONG, "contact_second_stage": SECOND_STAGE})
    said: list[str] = []
    names = (
        "harmonic_forcing", "contact_second_stage", "contact_hardening", "contact_damping_speed",
        "spring_cubic", "quadratic_drag", "coulomb_friction", "base_motion",
    )  # fmt: skip
    found = diagnose(
        campaign,
        rng=np.random.default_rng(0),
        effects=tuple(BY_ID[name] for name in names),
        search=False,
        progress=lambda m: said.append(str(m)),
    )
    assert found.before.reduced_chi2 > 100 and found.after.reduced_chi2 < 1.1
    assert found.verdict == "named"
    assert {e.id for e in found.effects} == {"harmonic_forcing", "contact_second_stage"}
    assert next(one for one in said if one.startswith("fitting h")) == "fitting harmonic_forcing"


def test_a_mode_near_the_motions_own_frequency_is_no_force(shaken: Fit) -> None:
    """The equation of motion, which knows no mode, has a line for it; a step over periods ahead
    promises more of the mode, and of a force where there is one.
    """
    ringing = fitted(small_rig.record(3, NEAR_MODE, duration=6.0))
    assert ringing.reduced_chi2 > 100
    assert asked_for(ringing, flight=True)
    assert _begins_with_a_line(shaken)
    assert not _begins_with_a_line(ringing)


def _begins_with_a_line(fit: Fit) -> bool:
    search = Asking(SEARCHED, campaign_scales(fit), np.random.default_rng(0), lambda words: None)
    base = search.examine(base_candidate(fit))
    return search.with_a_line(base) is not base
