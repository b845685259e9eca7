"""Which effects are needed where something remains, on made-up evidence."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID
from made_up_evidence import (
    COST,
    DRAG,
    FRICTION,
    OF_MOTION,
    OF_TIME,
    beside_force,
    candidate,
    examined,
    remaining,
    selection,
    something_left,
    verdict_of,
    with_misfit,
)

from bayesimpact.diagnosis.selection import decision
from bayesimpact.diagnosis.selection.decision import decide, in_its_place, leads_without
from bayesimpact.diagnosis.thresholds import (
    ALPHA,
    APART,
    DECISIVE,
    EXCESS,
)
from bayesimpact.model.effects.effect import Effect


def test_an_effect_is_partly_the_answer_when_it_takes_most_of_the_misfit():
    found = decide(remaining(something_left(), 100.0, 10.0))
    assert found.verdict == "partly" and [e.id for e in found.effects] == [FRICTION]
    enough = 1 + 9.0 * EXCESS
    assert verdict_of(remaining(something_left(), enough + 0.1, 10.0)) == "partly"
    assert verdict_of(remaining(something_left(), enough - 0.1, 10.0)) == "unknown"


def test_an_effect_that_another_could_stand_for_is_not_needed():
    near, far = (candidate(DRAG, 100.0 - DECISIVE + x) for x in (0.1, -0.1))
    assert verdict_of(remaining(something_left(), 100.0, 10.0, near)) == "unknown"
    assert verdict_of(remaining(something_left(), 100.0, 10.0, far)) == "partly"


@pytest.mark.parametrize(("off", "verdict"), [(0.2, "unknown"), (0.3, "partly")])
def test_a_size_near_that_of_a_law_without_parameters_is_no_name(
    monkeypatch: pytest.MonkeyPatch, off: float, verdict: str
) -> None:
    """A cubic spring of about -k1 / 6 in angles may be a pendulum, whatever else its size does."""
    monkeypatch.setattr(decision, "campaign_scales", lambda fit: None)
    at = {"spring_cubic.stiffness": -0.2}
    monkeypatch.setattr(decision, "equivalent", lambda *_: at)
    chosen = examined(candidate("spring_cubic", 100.0), ALPHA / 2, ALPHA / 2, 2 * DECISIVE)
    pendulum = with_misfit(candidate("pendulum_sine", 50.0), 60.0)
    found = remaining(chosen, 100.0, 10.0, pendulum)
    found.chosen.candidate.fit.value = lambda name: at[name] * (1.0 + off)
    said = decide(found)
    assert said.verdict == verdict
    alike = [[e.id for e in group] for group in said.either]
    assert alike == ([["spring_cubic", "pendulum_sine"]] if verdict == "unknown" else [])


@pytest.mark.parametrize("effect", ["released_mode", FRICTION])
def test_a_line_that_a_refused_line_could_stand_for_is_not_needed(effect: str) -> None:
    """Whose line may be the motion's own is no name, but as good an explanation of a line."""
    chosen = examined(candidate(effect, 100.0), p_force=ALPHA / 2, force_evidence=2 * DECISIVE)
    forced = candidate("harmonic_forcing", 130.0)
    refused = replace(forced, log_evidence=-np.inf, refused=forced.log_evidence)
    is_line = effect == "released_mode"
    assert verdict_of(remaining(chosen, 100.0, 10.0, refused)) == (
        "unknown" if is_line else "partly"
    )
    behind = replace(refused, refused=forced.log_evidence - 30.0 - DECISIVE - 0.1)
    assert verdict_of(remaining(chosen, 100.0, 10.0, behind)) == "partly"


def test_an_effect_that_a_residual_force_replaces_is_not_needed():
    """By the decisive odds, and with a residual force beside the effect as well."""
    lead = 100.0 - COST
    for beside, instead, verdict in (
        (0.0, lead + DECISIVE + 0.1, "unknown"),
        (0.0, lead + DECISIVE - 0.1, "partly"),
        (110.0, lead + DECISIVE + 0.1, "partly"),
        (110.0, lead + 10.0 + DECISIVE + 0.1, "unknown"),
    ):
        found = remaining(something_left(), 100.0, 10.0, beside=beside, instead=instead)
        assert verdict_of(found) == verdict, (beside, instead)


@pytest.mark.parametrize("effect", [FRICTION, "stiffness_drift", "sensor_cubic"])
@pytest.mark.parametrize("force", [OF_MOTION, OF_TIME], ids=["motion", "time"])
def test_a_residual_force_that_cannot_be_the_effect_is_another_explanation(
    effect: str, force: Effect
) -> None:
    """It then unseats the effect where it is likelier at all."""
    restates = {(FRICTION, OF_MOTION.equation), ("stiffness_drift", OF_TIME.equation)}
    chosen = examined(candidate(effect, 100.0), p_force=ALPHA / 2, force_evidence=2 * DECISIVE)
    needed = DECISIVE if (effect, force.equation) in restates else 0.0
    for more, verdict in ((0.1, "unknown"), (-0.1, "partly")):
        lead = 100.0 - COST + needed + more
        found = remaining(chosen, 100.0, 10.0, instead=lead, force=force)
        assert verdict_of(found) == verdict


def test_a_search_that_ended_by_its_limit_needs_only_what_it_has_compared():
    """The effect and another one in its place, both with a residual force beside, and such a force
    in its place; where nothing else was tried in its place, it was compared with nothing.
    """
    found = remaining(something_left(), 100.0, 10.0, beside=110.0, instead=100.0)
    assert verdict_of(found) == "partly" and verdict_of(replace(found, finished=False)) == "unknown"
    other = candidate(DRAG, 50.0)
    ended = remaining(something_left(), 100.0, 10.0, other, beside=110.0, instead=100.0)
    fitted = {frozenset([DRAG]): beside_force(other, 50.0)}
    ended = replace(ended, finished=False, residual={**ended.residual, **fitted})
    assert verdict_of(ended) == "partly"
    for missing in ended.residual:
        some = {key: model for key, model in ended.residual.items() if key != missing}
        assert verdict_of(replace(ended, residual=some)) == "unknown"


def test_an_effect_whose_place_another_can_take_beside_a_residual_force_is_not_needed():
    """What remains may be what tells two laws apart."""
    other = candidate(DRAG, 50.0)
    for beside, verdict in (
        (100.0 - DECISIVE + 0.1, "unknown"),
        (100.0 - DECISIVE - 0.1, "partly"),
    ):
        found = remaining(something_left(), 100.0, 10.0, other)
        residual = {frozenset([DRAG]): beside_force(other, beside)}
        assert in_its_place(found, (BY_ID[FRICTION],)) is other
        assert verdict_of(replace(found, residual=residual)) == verdict


def test_what_has_more_to_fit_with_must_be_likelier_to_unseat_an_effect():
    """power_damping has two parameters where friction has one: with and without a force beside."""
    for gain, verdict in ((100.1, "unknown"), (99.9, "partly")):
        larger = candidate("power_damping", gain)
        assert verdict_of(remaining(something_left(), 100.0, 10.0, larger)) == verdict
        behind = candidate("power_damping", 50.0)
        found = remaining(something_left(), 100.0, 10.0, behind)
        residual = {frozenset(["power_damping"]): beside_force(behind, gain)}
        assert verdict_of(replace(found, residual=residual)) == verdict


def test_a_larger_set_is_compared_with_what_is_likeliest_with_the_effect_and_no_larger():
    """A third law that both may take in says nothing of the effect."""
    rival = candidate(f"{DRAG} gap_wear", 101.0 + COST)
    assert verdict_of(remaining(something_left(), 100.0, 10.0, rival)) == "unknown"
    for gain, verdict in ((101.1, "partly"), (100.9, "unknown")):
        both = candidate(f"{FRICTION} gap_wear", gain + COST)
        assert verdict_of(remaining(something_left(), 100.0, 10.0, rival, both)) == verdict
    larger = candidate(f"{FRICTION} gap_wear gap_per_recording", 110.0 + 2 * COST)
    assert verdict_of(remaining(something_left(), 100.0, 10.0, rival, larger)) == "unknown"


def test_a_set_that_trails_a_simpler_one_with_the_effect_says_nothing_against_it():
    """Though it is no larger than the chosen set: that one has a larger law beside the effect."""
    chosen = examined(
        candidate(f"{FRICTION} power_damping", 100.0 + COST),
        p_force=ALPHA / 2,
        force_evidence=2 * DECISIVE,
    )
    rival = candidate("power_damping spring_cubic", 97.0 + COST)
    for gain, leads in ((97.1, True), (96.9, False)):
        simpler = candidate(f"{FRICTION} {DRAG}", gain + COST)
        found = selection(chosen, rival, simpler)
        assert leads_without(found, (BY_ID[FRICTION],)) == leads


@pytest.mark.parametrize(
    ("others", "told"),
    [
        ((DRAG,), (FRICTION, DRAG)),
        ((DRAG, "power_damping"), (FRICTION, DRAG, "power_damping")),
        ((DRAG, "structural_damping", "power_damping"), None),  # too many
        (("spring_cubic",), None),  # not of its family
    ],
)
def test_of_a_group_one_is_needed_where_likely_sets_have_one_each(
    others: tuple[str, ...], told: tuple[str, ...] | None
) -> None:
    near = [candidate(i, 99.0 - n) for n, i in enumerate(others)]
    found = remaining(something_left(), 100.0, 10.0, *near)
    decision = decide(found)
    assert decision.verdict == "unknown" and decision.rivals == ()
    assert [tuple(e.id for e in g) for g in decision.either] == ([told] if told else [])
    beside = {frozenset[str](): beside_force(found.base.candidate, 200.0)}
    assert decide(replace(found, residual=beside)).either == ()


def test_an_effect_may_stand_out_by_the_force_that_is_left_without_it():
    """About the motion's own frequencies: a misfit grows with phase errors, a force does not."""
    for without_it, verdict in ((EXCESS + 0.1, "partly"), (EXCESS - 0.1, "unknown")):
        found = remaining(something_left(), 15.0, 10.0)
        power = {frozenset([FRICTION]): 1.0, frozenset[str](): without_it}
        assert verdict_of(replace(found, power=power)) == verdict


@pytest.mark.parametrize(("leaves_noise", "verdict"), [(True, "partly"), (False, "unknown")])
def test_a_force_of_time_that_leaves_more_than_noise_lets_nothing_stand_out(leaves_noise, verdict):
    found = remaining(something_left(), 15.0, 10.0)
    power = {frozenset([FRICTION]): 1.0, frozenset[str](): 2 * EXCESS}
    assert (
        verdict_of(replace(found, power=power, own=SimpleNamespace(leaves_noise=leaves_noise)))
        == verdict
    )


def test_odds_are_those_beside_a_force_of_time_where_one_remains():
    """What the force explains of the base model as well is no evidence for an effect."""
    found = remaining(something_left(), 100.0, 10.0)
    alone = found.log_odds(found.chosen.candidate)
    for share, verdict in ((100.0 - COST - DECISIVE + 0.1, "unknown"), (50.0, "partly")):
        base = found.base.candidate.fit
        beside = SimpleNamespace(
            log_evidence_gain=lambda fit, _, own=(base, share): own[1] * (fit is own[0])
        )
        seen = replace(found, beside=beside)
        assert seen.log_odds(found.chosen.candidate) == pytest.approx(alone - share)
        assert verdict_of(seen) == verdict


def test_a_set_without_it_that_is_likelier_by_itself_unseats_an_effect():
    """Beside a force of time, which takes what that set explains, it trails."""
    found = remaining(something_left(), 100.0, 10.0)
    other = candidate(f"{DRAG} spring_cubic", 0.0)
    reached = found.log_odds(found.chosen.candidate) + other.price(COST)
    for ahead, verdict in ((DECISIVE + 0.1, "unknown"), (DECISIVE - 0.1, "partly")):
        other = candidate(f"{DRAG} spring_cubic", reached + ahead)
        beside = SimpleNamespace(
            log_evidence_gain=lambda fit, _, own=other: 0.0 if fit is own.fit else 100.0
        )
        tried = (*found.tried, other)
        assert verdict_of(replace(found, tried=tried, beside=beside)) == verdict


def test_nothing_is_needed_where_a_free_force_leaves_far_less():
    """What the noise level is uncertain by (six per cent of a thousand samples) is the least."""
    for free, verdict in (
        (1.0 + 9.0 / EXCESS + 0.02, "partly"),
        (1.0 + 9.0 / EXCESS - 0.02, "unknown"),
    ):
        found = remaining(something_left(), 100.0, 10.0, beside=100.0 + COST, instead=100.0)
        model = found.residual[frozenset()]
        residual = {**found.residual, frozenset(): with_misfit(model, free)}
        assert verdict_of(replace(found, residual=residual)) == verdict, free


def test_an_effect_is_needed_where_it_does_what_a_free_force_does_not() -> None:
    """With that force beside it, it is decisively likelier than the force alone."""
    for more, verdict in ((0.1, "partly"), (-0.1, "unknown")):
        beside = 100.0 + COST + DECISIVE + more
        found = remaining(something_left(), 100.0, 10.0, beside=beside, instead=100.0)
        alone = with_misfit(found.residual[frozenset()], 1.1)
        assert (
            verdict_of(replace(found, residual={**found.residual, frozenset(): alone})) == verdict
        )


@pytest.mark.parametrize(("apart", "verdict"), [(APART + 0.1, "partly"), (APART - 0.1, "unknown")])
def test_an_effect_that_its_own_interval_does_not_hold_apart_is_not_needed(apart, verdict):
    """Intervals beside a remainder may contain no effect at all; no name then stands beside one."""
    found = remaining(something_left(), 100.0, 10.0)
    assert verdict_of(replace(found, apart={FRICTION: apart})) == verdict


@pytest.mark.parametrize(("more", "names"), [(0.1, ["power_damping"]), (-0.1, [])])
def test_a_law_is_told_from_the_one_that_it_refines_where_that_leaves_far_more(more, names):
    """Its odds alone do not tell: what remains may be all that speaks for its further parameter."""
    chosen = examined(
        candidate("power_damping", 100.0), p_force=ALPHA / 2, force_evidence=2 * DECISIVE
    )
    refined = with_misfit(candidate(DRAG, 50.0), 1.0 + 9.0 * EXCESS + more)
    decision = decide(remaining(chosen, 100.0, 10.0, refined))
    assert [e.id for e in decision.effects] == names
    either = [] if names else [("power_damping", DRAG)]
    assert [tuple(e.id for e in g) for g in decision.either] == either


@pytest.mark.parametrize(("instead", "told"), [(0.1, True), (-0.1, False)])
def test_a_law_that_a_residual_force_makes_of_the_one_it_refines_is_told_with_that(instead, told):
    """Far more is left with the simpler law alone, but none of that beside a residual force."""
    chosen = examined(
        candidate("power_damping", 100.0), p_force=ALPHA / 2, force_evidence=2 * DECISIVE
    )
    refined = with_misfit(candidate(DRAG, 50.0), 90.0)
    found = remaining(chosen, 100.0, 10.0, refined, beside=110.0, instead=50.0)
    beside = beside_force(refined, 110.0 - DECISIVE + instead)
    decision = decide(replace(found, residual={**found.residual, frozenset([DRAG]): beside}))
    assert [e.id for e in decision.effects] == ([] if told else ["power_damping"])
    either = [("power_damping", DRAG)] if told else []
    assert [tuple(e.id for e in g) for g in decision.either] == either
