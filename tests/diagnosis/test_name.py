"""The rules of the verdict on made-up evidence: rivals, elaborations, unknown physics."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.decision import decide, in_its_place, leads_without, ordered
from bayesimpact.diagnosis.learned import learned_drift, learned_force
from bayesimpact.diagnosis.naming import Naming, State
from bayesimpact.diagnosis.promising import refit_candidates
from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.diagnosis.thresholds import (
    ALPHA,
    APART,
    DECISIVE,
    EXCESS,
    largest_log_odds,
    p_value_of,
)
from bayesimpact.model.effects.effect import Effect

COST = 3.8


OCCAM = 10.0  # nats between likelihood and evidence of a model with effects


def candidate(ids: str, evidence: float, chi2: float = 1.0) -> Candidate:
    """Effects by name, separated by blanks; log evidence over the base model's."""
    likelihood = 2000.0 + evidence + (OCCAM if ids else 0.0)
    fit = SimpleNamespace(reduced_chi2=chi2, log_likelihood=likelihood)
    return Candidate(tuple(BY_ID[i] for i in ids.split()), fit, 1000.0 + evidence)


def state(
    model: Candidate, p_catalogue: float = 0.5, p_force: float = 0.5, force_evidence: float = 0.0
) -> State:
    force = SimpleNamespace(
        p_value=p_force, log_evidence=force_evidence, gain=force_evidence + 2 * OCCAM
    )
    drift = SimpleNamespace(p_value=0.5, log_evidence=-1.0, gain=0.0)
    return State(model, SimpleNamespace(p_value=p_catalogue), force, drift)


def naming(
    chosen: State, *others: Candidate, base_p: float = 1e-6, base_chi2: float = 1.0,
    force_evidence: float = 0.0,
) -> Naming:  # fmt: skip
    base = state(candidate("", 0.0, base_chi2), base_p, base_p, force_evidence)
    if not chosen.candidate.effects:
        base = chosen
    every = {c.ids: c for c in (base.candidate, chosen.candidate, *others)}
    worth = lambda c: c.log_evidence - COST * len(c.effects)  # noqa: E731
    return Naming(base, chosen, tuple(sorted(every.values(), key=worth, reverse=True)), COST)


FRICTION, DRAG = "coulomb_friction", "quadratic_drag"


def judge(found: Naming) -> str:
    return decide(found).verdict


def test_nothing_missing_is_adequate_and_an_alarm_without_a_name_is_unknown():
    assert judge(naming(state(candidate("", 0.0)))) == "adequate"
    for alarm in ({"p_force": ALPHA / 2, "force_evidence": DECISIVE + 0.1}, {"p_catalogue": 1e-5}):
        assert judge(naming(state(candidate("", 0.0), **alarm))) == "unknown"


def test_a_name_needs_decisive_odds_over_every_rival():
    chosen = state(candidate(FRICTION, 100.0))
    far = candidate(DRAG, 100.0 - DECISIVE - 0.1)
    near = candidate(DRAG, 100.0 - DECISIVE + 0.1)
    assert judge(naming(chosen, far)) == "named"
    found = naming(chosen, near)
    assert judge(found) == "ambiguous" and found.rivals() == (near,)


def test_the_base_model_itself_is_a_rival():
    weak = state(candidate(FRICTION, COST + DECISIVE - 0.1))
    assert judge(naming(weak)) == "ambiguous"
    assert judge(naming(state(candidate(FRICTION, COST + DECISIVE + 0.1)))) == "named"


def test_supersets_and_elaborations_are_no_rivals():
    chosen = state(candidate("contact_no_tension", 100.0))
    superset = candidate("contact_no_tension spring_cubic", 104.0)
    elaboration = candidate("obstacle_mass", 99.0)  # no tension is its null
    assert judge(naming(chosen, superset, elaboration)) == "named"
    # the other way round the simpler model is a rival
    heavier = state(candidate("obstacle_mass", 100.0))
    assert judge(naming(heavier, candidate("contact_no_tension", 98.0))) == "ambiguous"
    assert judge(naming(heavier, candidate("contact_no_tension", 90.0))) == "named"


def test_a_pair_is_compared_with_what_lacks_one_of_its_members():
    chosen = state(candidate(f"{FRICTION} spring_cubic", 200.0))
    alone = candidate(FRICTION, 200.0 - COST - DECISIVE + 0.1)
    assert judge(naming(chosen, alone)) == "ambiguous"
    swapped = candidate(f"{DRAG} spring_cubic", 196.0)
    found = naming(chosen, swapped)
    assert judge(found) == "ambiguous" and found.rivals() == (swapped,)
    single = state(candidate("harmonic_forcing", 200.0))
    pair = candidate("gap_wear gap_per_recording", 200.1 + COST)
    assert naming(single, pair).rivals() == (pair,)  # a rival may be larger
    assert not naming(single, candidate("gap_wear gap_per_recording", 199.9 + COST)).rivals()


OF_MOTION, OF_TIME = learned_force(-1.0, 1.0, 1.0, 1.0), learned_drift(10.0, 1.0, 1.0, 1.0)


def beside_force(model: Candidate, evidence: float, force: Effect = OF_MOTION) -> Candidate:
    """A model with a residual force, and its log evidence less what that costs."""
    return Candidate((*model.effects, force), model.fit, 1000.0 + evidence + COST)


def remaining(
    chosen: State, without: float, chi2: float, *others: Candidate, beside: float = 0.0,
    instead: float = 0.0, force: Effect = OF_MOTION,
) -> Naming:  # fmt: skip
    """A chosen single effect beside which something remains.

    `without`: misfit over the noise without it; `chi2`: with it; log evidences of a residual force
    `beside` the effect and `instead` of it, where above zero, less what a further effect costs.
    """
    found = naming(chosen, *others, base_chi2=without)
    base = found.base
    for model, misfit in ((chosen, chi2), (base, without)):
        target = SimpleNamespace(
            likelihood=SimpleNamespace(
                noise=SimpleNamespace(level=1.0, level_error=0.01), sizes=np.array([1000.0])
            )
        )
        vars(model.candidate.fit).update(
            target=target, sums=np.array([1000.0 * misfit]), reduced_chi2=misfit
        )
    residual = {
        frozenset(m.candidate.ids): beside_force(m.candidate, e, force)
        for m, e in ((chosen, beside), (base, instead))
        if e
    }
    states = {frozenset(m.candidate.ids): m for m in (chosen, base)}
    return replace(found, states=states, residual=residual)


def something_left() -> State:
    return state(candidate(FRICTION, 100.0), p_force=ALPHA / 2, force_evidence=2 * DECISIVE)


def test_an_effect_is_partly_the_answer_when_it_takes_most_of_the_misfit():
    found = decide(remaining(something_left(), 100.0, 10.0))
    assert found.verdict == "partly" and [e.id for e in found.effects] == [FRICTION]
    enough = 1 + 9.0 * EXCESS
    assert judge(remaining(something_left(), enough + 0.1, 10.0)) == "partly"
    assert judge(remaining(something_left(), enough - 0.1, 10.0)) == "unknown"


def test_an_effect_that_another_could_stand_for_is_not_needed():
    near, far = (candidate(DRAG, 100.0 - DECISIVE + x) for x in (0.1, -0.1))
    assert judge(remaining(something_left(), 100.0, 10.0, near)) == "unknown"
    assert judge(remaining(something_left(), 100.0, 10.0, far)) == "partly"


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
        assert judge(found) == verdict, (beside, instead)


@pytest.mark.parametrize("effect", [FRICTION, "stiffness_drift", "sensor_cubic"])
@pytest.mark.parametrize("force", [OF_MOTION, OF_TIME], ids=["motion", "time"])
def test_a_residual_force_that_cannot_be_the_effect_is_another_explanation(
    effect: str, force: Effect
) -> None:
    """It then unseats the effect where it is likelier at all."""
    restates = {(FRICTION, OF_MOTION.equation), ("stiffness_drift", OF_TIME.equation)}
    chosen = state(candidate(effect, 100.0), p_force=ALPHA / 2, force_evidence=2 * DECISIVE)
    needed = DECISIVE if (effect, force.equation) in restates else 0.0
    for more, verdict in ((0.1, "unknown"), (-0.1, "partly")):
        lead = 100.0 - COST + needed + more
        found = remaining(chosen, 100.0, 10.0, instead=lead, force=force)
        assert judge(found) == verdict


def test_a_search_that_ended_by_its_limit_needs_only_what_it_has_compared():
    """The effect with a residual force beside, and such a force in its place."""
    found = remaining(something_left(), 100.0, 10.0, beside=110.0, instead=100.0)
    ended = replace(found, finished=False)
    assert judge(found) == judge(ended) == "partly"
    for missing in found.residual:
        some = {key: model for key, model in found.residual.items() if key != missing}
        assert judge(replace(ended, residual=some)) == "unknown"
    other = candidate(DRAG, 50.0)
    ended = remaining(something_left(), 100.0, 10.0, other, beside=110.0, instead=100.0)
    ended = replace(ended, finished=False)
    assert judge(ended) == "unknown"
    fitted = {frozenset([DRAG]): beside_force(other, 50.0)}
    assert judge(replace(ended, residual={**ended.residual, **fitted})) == "partly"


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
        assert judge(replace(found, residual=residual)) == verdict


def test_what_has_more_to_fit_with_must_be_likelier_to_unseat_an_effect():
    """power_damping has two parameters where friction has one: with and without a force beside."""
    for gain, verdict in ((100.1, "unknown"), (99.9, "partly")):
        larger = candidate("power_damping", gain)
        assert judge(remaining(something_left(), 100.0, 10.0, larger)) == verdict
        behind = candidate("power_damping", 50.0)
        found = remaining(something_left(), 100.0, 10.0, behind)
        residual = {frozenset(["power_damping"]): beside_force(behind, gain)}
        assert judge(replace(found, residual=residual)) == verdict


def test_a_larger_set_is_compared_with_what_is_likeliest_with_the_effect_and_no_larger():
    """A third law that both may take in says nothing of the effect."""
    rival = candidate(f"{DRAG} gap_wear", 101.0 + COST)
    assert judge(remaining(something_left(), 100.0, 10.0, rival)) == "unknown"
    for gain, verdict in ((101.1, "partly"), (100.9, "unknown")):
        both = candidate(f"{FRICTION} gap_wear", gain + COST)
        assert judge(remaining(something_left(), 100.0, 10.0, rival, both)) == verdict
    larger = candidate(f"{FRICTION} gap_wear gap_per_recording", 110.0 + 2 * COST)
    assert judge(remaining(something_left(), 100.0, 10.0, rival, larger)) == "unknown"


def test_a_set_that_trails_a_simpler_one_with_the_effect_says_nothing_against_it():
    """Though it is no larger than the chosen set: that one has a larger law beside the effect."""
    chosen = state(
        candidate(f"{FRICTION} power_damping", 100.0 + COST),
        p_force=ALPHA / 2,
        force_evidence=2 * DECISIVE,
    )
    rival = candidate("power_damping spring_cubic", 97.0 + COST)
    for gain, leads in ((97.1, True), (96.9, False)):
        simpler = candidate(f"{FRICTION} {DRAG}", gain + COST)
        found = naming(chosen, rival, simpler)
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
    assert decision.verdict == "unknown"
    assert [tuple(e.id for e in g) for g in decision.either] == ([told] if told else [])
    beside = {frozenset[str](): beside_force(found.base.candidate, 200.0)}
    assert decide(replace(found, residual=beside)).either == ()


def test_an_effect_may_stand_out_by_the_force_that_is_left_without_it():
    """About the motion's own frequencies: a misfit grows with phase errors, a force does not."""
    for without_it, verdict in ((EXCESS + 0.1, "partly"), (EXCESS - 0.1, "unknown")):
        found = remaining(something_left(), 15.0, 10.0)
        power = {frozenset([FRICTION]): 1.0, frozenset[str](): without_it}
        assert judge(replace(found, power=power)) == verdict


def test_odds_are_those_beside_a_force_of_time_where_one_remains():
    """What the force explains of the base model as well is no evidence for an effect."""
    found = remaining(something_left(), 100.0, 10.0)
    alone = found.log_odds(found.chosen.candidate)
    for share, verdict in ((100.0 - COST - DECISIVE + 0.1, "unknown"), (50.0, "partly")):
        base = found.base.candidate.fit
        beside = SimpleNamespace(gain=lambda fit, own=share, base=base: own if fit is base else 0.0)
        seen = replace(found, beside=beside)
        assert seen.log_odds(found.chosen.candidate) == pytest.approx(alone - share)
        assert judge(seen) == verdict


def test_nothing_is_needed_where_a_free_force_leaves_far_less():
    """What the noise level is uncertain by (six per cent of a thousand samples) is the least."""
    for free, verdict in (
        (1.0 + 9.0 / EXCESS + 0.02, "partly"),
        (1.0 + 9.0 / EXCESS - 0.02, "unknown"),
    ):
        found = remaining(something_left(), 100.0, 10.0, beside=100.0 + COST, instead=100.0)
        model = found.residual[frozenset()]
        residual = {**found.residual, frozenset(): with_misfit(model, free)}
        assert judge(replace(found, residual=residual)) == verdict, free


def with_misfit(model: Candidate, chi2: float) -> Candidate:
    fit = SimpleNamespace(**{**vars(model.fit), "sums": np.array([1000.0 * chi2])})
    return replace(model, fit=fit)


def test_an_effect_is_needed_where_it_does_what_a_free_force_does_not() -> None:
    """With that force beside it, it is decisively likelier than the force alone."""
    for more, verdict in ((0.1, "partly"), (-0.1, "unknown")):
        beside = 100.0 + COST + DECISIVE + more
        found = remaining(something_left(), 100.0, 10.0, beside=beside, instead=100.0)
        alone = with_misfit(found.residual[frozenset()], 1.1)
        assert judge(replace(found, residual={**found.residual, frozenset(): alone})) == verdict


def test_what_remains_needs_decisive_odds():
    """Beside a name and beside the base model: a small p-value alone is no alarm."""
    for evidence, white in ((DECISIVE - 0.1, True), (DECISIVE + 0.1, False)):
        chosen = state(candidate(FRICTION, 100.0), p_force=ALPHA / 2, force_evidence=evidence)
        assert chosen.is_white == white
    by_chance = state(candidate(FRICTION, 2192.0), p_catalogue=0.0026)
    assert by_chance.is_white and judge(naming(by_chance)) == "named"
    assert not state(candidate(FRICTION, 2192.0), p_catalogue=1e-5).is_white
    for alarm in ({"p_force": ALPHA / 2, "force_evidence": DECISIVE - 0.1}, {"p_catalogue": 3e-4}):
        assert judge(naming(state(candidate("", 0.0), **alarm))) == "adequate"


def test_a_p_value_stands_for_odds_of_a_bound():
    """Sellke, Bayarri and Berger 2001, Table 1: p = 0.05, 0.01, 0.001 -> 2.5, 8.0, 53 to one."""
    for p, odds in ((0.05, 2.46), (0.01, 7.99), (0.001, 53.3)):
        assert np.exp(largest_log_odds(p)) == pytest.approx(odds, rel=0.005)
    assert largest_log_odds(0.5) == 0.0 and np.isfinite(largest_log_odds(0.0))
    assert p_value_of(np.log(53.3)) == pytest.approx(0.001, rel=0.01)


@pytest.mark.parametrize("ids", [FRICTION, f"{FRICTION} spring_cubic"])
def test_a_free_force_that_beats_the_chosen_effects_is_unknown_physics(ids):
    imitation = state(candidate(ids, 200.0))
    object.__setattr__(imitation.candidate.fit, "log_likelihood", 2300.0)  # a heavy prior volume
    odds = 200.0 - COST * (len(ids.split()) - 1)  # a free force costs as much as an effect
    assert judge(naming(imitation, force_evidence=odds + DECISIVE + 0.1)) == "unknown"
    assert judge(naming(imitation, force_evidence=odds + DECISIVE - 0.1)) == "named"


def test_no_force_can_gain_more_than_a_model_that_leaves_nothing():
    """The linearised problem promises too much where effects are large."""
    assert judge(naming(state(candidate(FRICTION, 200.0)), force_evidence=300.0)) == "named"


def test_probabilities_weigh_all_models():
    chosen = state(candidate(FRICTION, 100.0))
    rivals = (candidate(DRAG, 98.0), candidate(f"{FRICTION} {DRAG}", 101.0))
    found = naming(chosen, *rivals)
    weights = np.exp([0.0, 100 - COST, 98 - COST, 101 - 2 * COST])
    assert found.probability(FRICTION) == pytest.approx((weights[1] + weights[3]) / weights.sum())
    assert found.probability(DRAG) == pytest.approx((weights[2] + weights[3]) / weights.sum())
    assert found.probability("gap_wear") == 0.0
    assert found.log_odds(rivals[1]) == pytest.approx(101 - 2 * COST)


def test_effects_are_ordered_by_what_the_model_loses_without_them():
    chosen = state(candidate(f"{FRICTION} spring_cubic", 200.0))
    found = naming(chosen, candidate(FRICTION, 50.0), candidate("spring_cubic", 150.0))
    effects = chosen.candidate.effects
    assert [e.id for e in ordered(found, effects)] == ["spring_cubic", FRICTION]
    assert ordered(found, effects[:1]) == effects[:1]


def scores(*gains: float, effect: str = FRICTION):
    rows = tuple(SimpleNamespace(gain=g, effect=BY_ID[effect]) for g in gains)
    return SimpleNamespace(best=lambda: rows)


def test_what_is_worth_a_refit():
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
    found = naming(state(candidate(three, 500.0)))
    assert judge(found) == "named"
    lead = found.log_odds(found.chosen.candidate)
    assert judge(replace(found, contact_odds=lead + COST + DECISIVE - 0.1)) == "named"
    assert judge(replace(found, contact_odds=lead + COST + DECISIVE + 0.1)) == "unknown"


def test_the_unknown_force_is_the_likeliest_of_its_forms():
    found = naming(state(candidate("", 0.0), force_evidence=20.0))
    assert found.unknown is found.base.force
    contact = SimpleNamespace(log_evidence=30.0)
    assert replace(found, contact=contact).unknown is contact


@pytest.mark.parametrize(("apart", "verdict"), [(APART + 0.1, "partly"), (APART - 0.1, "unknown")])
def test_an_effect_that_its_own_interval_does_not_hold_apart_is_not_needed(apart, verdict):
    """Intervals beside a remainder may contain no effect at all; no name then stands beside one."""
    found = remaining(something_left(), 100.0, 10.0)
    assert judge(replace(found, apart={FRICTION: apart})) == verdict
