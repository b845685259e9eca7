"""The rules of the verdict on made-up evidence: rivals, elaborations, unknown physics."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID
from made_up_evidence import COST, DRAG, FRICTION, candidate, examined, selection, verdict_of
from scipy.signal import lfilter

from bayesimpact.diagnosis.candidates.promising import refit_candidates
from bayesimpact.diagnosis.selection.decision import decide, ordered
from bayesimpact.diagnosis.selection.outcome import colour_p
from bayesimpact.diagnosis.thresholds import (
    ALPHA,
    DECISIVE,
    largest_log_odds,
)
from bayesimpact.inference.noise.whitening import Noise


def test_nothing_missing_is_adequate_and_an_alarm_without_a_name_is_unknown():
    assert verdict_of(selection(examined(candidate("", 0.0)))) == "adequate"
    for alarm in ({"p_force": ALPHA / 2, "force_evidence": DECISIVE + 0.1}, {"p_catalogue": 1e-5}):
        assert verdict_of(selection(examined(candidate("", 0.0), **alarm))) == "unknown"


@pytest.mark.parametrize(("correlation", "left"), [(0.8, 0.6), (0.8, 0.4), (0.0, 0.6)])
def test_coloured_noise_of_half_the_signal_may_be_the_motion(
    correlation: float, left: float
) -> None:
    alone = candidate("", 0.0)
    noise = Noise(correlation, level=1.0)
    density = SimpleNamespace(likelihood=SimpleNamespace(noise=noise))
    fit = SimpleNamespace(**{**vars(alone.fit), "density": density, "rms": left, "signal": 1.0})
    verdict = verdict_of(selection(examined(replace(alone, fit=fit))))
    assert verdict == ("unknown" if correlation and left > 0.5 else "adequate")


def test_a_name_needs_decisive_odds_over_every_rival():
    chosen = examined(candidate(FRICTION, 100.0))
    far = candidate(DRAG, 100.0 - DECISIVE - 0.1)
    near = candidate(DRAG, 100.0 - DECISIVE + 0.1)
    assert verdict_of(selection(chosen, far)) == "named"
    found = selection(chosen, near)
    assert verdict_of(found) == "ambiguous" and found.rivals() == (near,)


def test_the_base_model_itself_is_a_rival():
    weak = examined(candidate(FRICTION, COST + DECISIVE - 0.1))
    assert verdict_of(selection(weak)) == "ambiguous"
    assert verdict_of(selection(examined(candidate(FRICTION, COST + DECISIVE + 0.1)))) == "named"


@pytest.mark.parametrize(("left", "verdict"), [(1.0, "adequate"), (1.5, "unknown")])
def test_a_model_that_loses_to_nothing_is_no_name(left: float, verdict: str) -> None:
    """Whatever a search ends with: it leaves nothing, but is decisively less likely."""
    noise = Noise(level=1.0, level_error=0.05)  # chi2 of 1.3 is within three of these errors
    density = SimpleNamespace(likelihood=SimpleNamespace(noise=noise))
    behind = examined(candidate(FRICTION, COST - DECISIVE - 0.1))
    found = selection(behind, candidate(DRAG, COST + 1.0), base_chi2=left)
    vars(found.base.candidate.fit).update(density=density)
    decision = decide(found)
    assert (decision.verdict, decision.effects, decision.rivals) == (verdict, (), ())
    near = selection(examined(candidate(FRICTION, COST - DECISIVE + 0.1)))
    assert verdict_of(near) == "ambiguous"


def test_rivals_are_told_likeliest_first() -> None:
    near, nearer = candidate(DRAG, 97.0), candidate("spring_cubic", 99.0)
    found = selection(examined(candidate(FRICTION, 100.0)), near, nearer)
    found = replace(found, tried=found.tried[::-1])
    assert found.rivals() == (nearer, near)


def test_supersets_and_elaborations_are_no_rivals():
    chosen = examined(candidate("contact_no_tension", 100.0))
    superset = candidate("contact_no_tension spring_cubic", 104.0)
    elaboration = candidate("obstacle_mass", 99.0)  # no tension is its null
    assert verdict_of(selection(chosen, superset, elaboration)) == "named"
    # the other way round the simpler model is a rival
    heavier = examined(candidate("obstacle_mass", 100.0))
    assert verdict_of(selection(heavier, candidate("contact_no_tension", 98.0))) == "ambiguous"
    assert verdict_of(selection(heavier, candidate("contact_no_tension", 90.0))) == "named"


def test_a_pair_is_compared_with_what_lacks_one_of_its_members():
    chosen = examined(candidate(f"{FRICTION} spring_cubic", 200.0))
    alone = candidate(FRICTION, 200.0 - COST - DECISIVE + 0.1)
    assert verdict_of(selection(chosen, alone)) == "ambiguous"
    swapped = candidate(f"{DRAG} spring_cubic", 196.0)
    found = selection(chosen, swapped)
    assert verdict_of(found) == "ambiguous" and found.rivals() == (swapped,)
    single = examined(candidate("harmonic_forcing", 200.0))
    pair = candidate("gap_wear gap_per_recording", 200.1 + COST)
    assert selection(single, pair).rivals() == (pair,)  # a rival may be larger
    assert not selection(single, candidate("gap_wear gap_per_recording", 199.9 + COST)).rivals()


def test_what_remains_needs_decisive_odds():
    """Beside a name and beside the base model: a small p-value alone is no alarm."""
    for evidence, white in ((DECISIVE - 0.1, True), (DECISIVE + 0.1, False)):
        chosen = examined(candidate(FRICTION, 100.0), p_force=ALPHA / 2, force_evidence=evidence)
        assert chosen.is_white == white
    by_chance = examined(candidate(FRICTION, 2192.0), p_catalogue=0.0026)
    assert by_chance.is_white and verdict_of(selection(by_chance)) == "named"
    assert not examined(candidate(FRICTION, 2192.0), p_catalogue=1e-5).is_white
    for alarm in ({"p_force": ALPHA / 2, "force_evidence": DECISIVE - 0.1}, {"p_catalogue": 3e-4}):
        assert verdict_of(selection(examined(candidate("", 0.0), **alarm))) == "adequate"


def test_a_p_value_stands_for_odds_of_a_bound():
    """Sellke, Bayarri and Berger 2001, Table 1: p = 0.05, 0.01, 0.001 -> 2.5, 8.0, 53 to one."""
    for p, odds in ((0.05, 2.46), (0.01, 7.99), (0.001, 53.3)):
        assert np.exp(largest_log_odds(p)) == pytest.approx(odds, rel=0.005)
    assert largest_log_odds(0.5) == 0.0 and np.isfinite(largest_log_odds(0.0))


@pytest.mark.parametrize("ids", [FRICTION, f"{FRICTION} spring_cubic"])
def test_a_free_force_that_beats_the_chosen_effects_is_unknown_physics(ids):
    imitation = examined(candidate(ids, 200.0))
    object.__setattr__(imitation.candidate.fit, "log_likelihood", 2300.0)  # a heavy prior volume
    odds = 200.0 - COST * (len(ids.split()) - 1)  # a free force costs as much as an effect
    assert verdict_of(selection(imitation, force_evidence=odds + DECISIVE + 0.1)) == "unknown"
    assert verdict_of(selection(imitation, force_evidence=odds + DECISIVE - 0.1)) == "named"


def test_no_force_can_gain_more_than_a_model_that_leaves_nothing():
    """The linearised problem promises too much where effects are large."""
    assert (
        verdict_of(selection(examined(candidate(FRICTION, 200.0)), force_evidence=300.0)) == "named"
    )


def test_probabilities_weigh_all_models():
    chosen = examined(candidate(FRICTION, 100.0))
    rivals = (candidate(DRAG, 98.0), candidate(f"{FRICTION} {DRAG}", 101.0))
    found = selection(chosen, *rivals)
    weights = np.exp([0.0, 100 - COST, 98 - COST, 101 - 2 * COST])
    assert found.probability(FRICTION) == pytest.approx((weights[1] + weights[3]) / weights.sum())
    assert found.probability(DRAG) == pytest.approx((weights[2] + weights[3]) / weights.sum())
    assert found.probability("gap_wear") == 0.0
    assert found.log_odds(rivals[1]) == pytest.approx(101 - 2 * COST)


def test_effects_are_ordered_by_what_the_model_loses_without_them():
    chosen = examined(candidate(f"{FRICTION} spring_cubic", 200.0))
    found = selection(chosen, candidate(FRICTION, 50.0), candidate("spring_cubic", 150.0))
    effects = chosen.candidate.effects
    assert [e.id for e in ordered(found, effects)] == ["spring_cubic", FRICTION]
    assert ordered(found, effects[:1]) == effects[:1]


def scores(*gains: float, effect: str = FRICTION):
    rows = tuple(SimpleNamespace(gain=g, effect=BY_ID[effect]) for g in gains)
    return SimpleNamespace(best=lambda: rows)


def test_what_promises_a_refit():
    def kept(*gains: float) -> list[float]:
        return [s.gain for s in refit_candidates(scores(*gains))]

    assert kept(100.0, 41.0, 39.0, 3.0) == [100.0, 41.0]
    assert kept(6.0, 4.5, 3.9) == [6.0, 4.5]
    assert kept(5000.0, 500.0, 480.0) == [5000.0, 500.0]
    assert kept() == []


def test_what_is_on_or_off_is_fitted_wherever_something_is_to_be_gained():
    for effect in ("contact_no_tension", "obstacle_mass"):
        assert [s.gain for s in refit_candidates(scores(9.0, 0.1, effect=effect))] == [9.0, 0.1]
        assert [s.gain for s in refit_candidates(scores(7.0, 0.1, effect=effect))] == [7.0]


def test_many_effects_that_imitate_one_force_in_contact_are_unknown():
    """Three effects against the force fitted with the parameters; a decisive lead is needed."""
    three = "contact_damping_per_case contact_no_tension gap_wear"
    found = selection(examined(candidate(three, 500.0)))
    assert verdict_of(found) == "named"
    lead = found.log_odds(found.chosen.candidate)
    assert verdict_of(replace(found, contact_odds=lead + COST + DECISIVE - 0.1)) == "named"
    assert verdict_of(replace(found, contact_odds=lead + COST + DECISIVE + 0.1)) == "unknown"


def test_the_unknown_force_is_the_likeliest_of_its_forms():
    found = selection(examined(candidate("", 0.0), force_evidence=20.0))
    assert found.unknown is found.base.force
    contact = SimpleNamespace(log_evidence=30.0)
    assert replace(found, contact=contact).unknown is contact


@pytest.mark.parametrize(
    ("ids", "chi2", "correlation", "smoothing", "of_one_colour"),
    [
        (FRICTION, 1.7, 0.6, None, True),
        (FRICTION, 1.7, 0.0, None, False),  # a level of noise that is too low is no colour
        (FRICTION, 1.3, 0.6, None, False),
        ("", 1.7, 0.6, None, False),
        (FRICTION, 1.7, 0.6, "savgol", False),
    ],
)
def test_a_name_leaves_nothing_of_one_colour_above_the_noise(
    ids: str, chi2: float, correlation: float, smoothing: str | None, of_one_colour: bool
) -> None:
    model = candidate(ids, 100.0, chi2)
    noise = np.random.default_rng(0).standard_normal(200)
    residual = lfilter([1.0], [1.0, -correlation], noise)
    likelihood = SimpleNamespace(noise=SimpleNamespace(level_error=0.06, smoothing=smoothing))
    model.fit.density = SimpleNamespace(likelihood=likelihood)
    model.fit.linearisation = [SimpleNamespace(residual=residual)]
    found = replace(examined(model), colour_p=colour_p(model))
    assert found.is_white is not of_one_colour
