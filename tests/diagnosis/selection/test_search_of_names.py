"""The path through the models, on a table of made-up evidences: no model is ever fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_rigs import BY_ID
from made_up_models import EFFECTS, ENOUGH, A, B, C, D, N, S, Table, chosen

from bayesimpact.diagnosis.selection import elimination, outcome, ranked, search


def test_nothing_is_fitted_where_nothing_is_missing(run):
    assert chosen(run(table := Table({"": ENOUGH}))) == set() and table.fitted == []


def test_with_a_stop_the_sets_that_a_step_promises_most_of_are_fitted_first(run):
    """Whichever problem asks for them; where nothing large is left no other is fitted."""
    gains = {A: 5.0, S: 50.0, f"{S} {N}": ENOUGH}
    table = Table(
        gains, chi2=100.0, left={f"{S} {N}": 1.0}, asked=(S,), asked_in_flight=(A,),
        asked_ahead=(f"{S} {N}",),
    )  # fmt: skip
    assert chosen(run(table, (*EFFECTS, BY_ID[N]))) == {S, N}
    assert table.fitted[0] == {S, N} and {A} not in table.fitted[:3]


def test_with_a_stop_the_problems_are_posed_again_about_a_better_model(run):
    """As long as that leaves a large misfit and they lead on."""
    gains = {A: 50.0, f"{A} {C}": 60.0, f"{A} {B}": ENOUGH}
    table = Table(gains, chi2=100.0, left={f"{A} {B}": 1.0}, asked=(f"{A} {C}",),
                  asked_in_flight=(A,), asked_about={f"{A} {C}": (f"{A} {B}",)})  # fmt: skip
    assert chosen(run(table)) == {A, B}
    assert table.fitted[:3] == [{A, C}, {A}, {A, B}]


def test_an_effect_that_is_refused_ends_no_step(run):
    """A force of the motion's own frequency may explain most of anything."""
    gains = {A: 300.0, C: 200.0, f"{C} {B}": ENOUGH}
    assert chosen(run(Table(gains, chi2=50.0, left={A: 5.0}), refuted=(A,))) == {B, C}


def test_the_search_goes_on_where_leaving_out_has_made_room(run, monkeypatch):
    """Five effects are the most: with three that imitate one, a fourth and fifth find no place."""
    monkeypatch.setattr(ranked, "MOST_LARGE", 3)
    gains = {f"{A} {C} {D}": 300.0, f"{A} {B}": 300.0, f"{A} {B} {S}": ENOUGH}
    table = Table(gains, chi2=100.0, asked=(f"{A} {C} {D}",), seen={B: 1.0, C: 1.0, D: 1.0})
    assert chosen(run(table)) == {A, B, S}


def test_what_an_effect_refines_is_tried_in_its_place_whatever_scores_say(run, monkeypatch):
    """The simpler one has no score beside a model without both."""
    power = BY_ID["power_damping"]
    table = Table({A: 10.0, f"{A} {power.id}": ENOUGH, f"{A} {B}": ENOUGH + 4.0}, chi2=100.0,
                  asked=(A, f"{A} {power.id}"), seen={C: 1.0}, first=1)  # fmt: skip
    monkeypatch.setattr(elimination, "in_place_of", lambda *known: [])
    assert chosen(run(table, (*EFFECTS, power))) == {A, B}


@pytest.mark.parametrize(("gained", "found"), [(30.0, {A, C, N}), (1.0, {A, C})])
def test_an_effect_without_size_is_tried_beside_what_leaves_nothing(run, gained, found):
    """No score tells that it is missing; it costs what every effect does."""
    table = Table({A: 300.0, f"{A} {C}": ENOUGH, f"{A} {C} {N}": ENOUGH + gained})
    assert chosen(run(table, (*EFFECTS, BY_ID[N]))) == found
    assert frozenset({A, C, N}) in table.fitted


def test_the_best_single_effect_ends_the_search(run):
    table = Table({A: ENOUGH, B: 400.0})
    assert chosen(run(table)) == {A}
    assert all(len(ids) == 1 for ids in table.fitted)


def test_a_pair_is_reached_though_its_best_part_is_not_the_best_single(run):
    """Greedy selection from D alone would need three effects."""
    table = Table({D: 300.0, A: 280.0, B: 200.0, f"{A} {B}": 600.0, f"{D} {A} {B}": 601.0})
    assert chosen(run(table)) == {A, B}


def test_an_effect_that_is_hardly_needed_is_left_out(run):
    """Friction alone leaves nothing once it has been fitted from the pair."""
    table = Table({A: 505.0, B: 250.0, f"{A} {B}": 510.0}, forward={A: 300.0})
    assert chosen(run(table)) == {A}
    needed = Table({A: 497.0, B: 250.0, f"{A} {B}": 510.0}, forward={A: 300.0})
    assert chosen(run(needed)) == {A, B}


@pytest.mark.parametrize(("lost", "simpler"), [(5.4, True), (5.6, False)])
def test_where_something_remains_a_law_must_be_decisively_better_than_what_it_refines(
    run, monkeypatch, lost, simpler
):
    monkeypatch.setitem(BY_ID, B, replace(BY_ID[B], prefer=A))
    effects = tuple(BY_ID[i] for i in (A, B, C, D, S))
    gains = {A: 40.0, B: 40.0, C: 50.0, f"{B} {C}": 400.0, f"{A} {C}": 400.0 - lost}
    for left in (0.0, ENOUGH - 400.0):
        table = Table({k: v + left for k, v in gains.items()} | {"": 0.0}, chi2=100.0)
        expected = {A, C} if simpler and not left else {B, C}
        assert chosen(run(table, effects)) == expected


def test_an_exchange_replaces_an_imitation(run):
    """The path to the three leads over the pair {A, C}; from {A, B} one with D is better."""
    pairs = {f"{A} {C}": 450.0, f"{A} {B}": 440.0, f"{B} {C}": 430.0}
    triples = {f"{A} {B} {C}": 520.0, f"{A} {B} {D}": 560.0}
    table = Table({A: 400.0, C: 380.0, B: 300.0, D: 100.0} | pairs | triples)
    assert chosen(run(table)) == {A, B, D}


def test_what_the_last_exchange_leads_to_is_rid_of_what_it_does_not_need(run, monkeypatch):
    monkeypatch.setattr(elimination, "EXCHANGES", 1)
    pairs = {f"{A} {C}": 450.0, f"{A} {B}": 440.0, f"{B} {C}": 430.0, f"{B} {D}": 560.0}
    table = Table(
        {A: 400.0, C: 380.0, B: 300.0, D: 100.0, f"{A} {B} {C}": 520.0} | pairs,
        forward={f"{B} {D}": 310.0},
    )
    assert chosen(run(table)) == {B, D}


def test_an_exchange_begins_at_rivals_too(run):
    """No exchange leads from {A, B} to {D, S}, one from its equal {C, D} does."""
    singles = {A: 400.0, B: 390.0, C: 380.0, D: 100.0, S: 50.0}
    equal, far = {f"{A} {B}": 520.0, f"{C} {D}": 518.0}, {f"{A} {B}": 520.0, f"{C} {D}": 505.0}
    assert chosen(run(Table(singles | equal | {f"{D} {S}": 560.0}))) == {D, S}
    assert chosen(run(Table(singles | far | {f"{D} {S}": 560.0}))) == {A, B}


@pytest.mark.parametrize(("force", "found"), [(465.0, {C, D}), (490.0, {A, B, C})])
def test_exchanges_are_tried_before_a_model_is_given_up(run, force, found):
    """Three imitate two and leave something; not where a free force is likelier than the three."""
    gains = {A: 300.0, B: 250.0, C: 100.0, D: 80.0, f"{A} {B}": 450.0, f"{A} {B} {C}": 480.0}
    assert chosen(run(Table(gains | {f"{C} {D}": 520.0}, force=force))) == found


@pytest.mark.parametrize(("beside", "found"), [(100.0, {C, D}), (125.0, {A, B, C})])
def test_no_exchange_is_tried_beside_which_a_force_explains_a_lot(run, beside, found):
    """Beside the three a free force gains 40 nats, or 65."""
    gains = {A: 250.0, B: 240.0, C: 100.0, D: 80.0, f"{A} {B}": 360.0, f"{A} {B} {C}": 480.0}
    table = Table(gains | {f"{C} {D}": 520.0}, force=420.0, beside=beside)
    assert chosen(run(table)) == found


def test_a_force_in_place_of_all_effects_counts_each_independent_sample_once(run, monkeypatch):
    """As the odds of models do: else it ends a search whose next step explains all."""
    for module in (ranked, outcome):
        monkeypatch.setattr(module, "tempered_evidence", lambda model, n: model.log_evidence / n)
    table = Table({A: 100.0, f"{A} {B}": ENOUGH}, force=1000.0)
    assert chosen(run(table, repetition=10.0)) == {A, B}


def test_a_model_beside_which_a_force_explains_the_rest_is_not_extended(run):
    """Beside A a free force gains 200 nats, effects promise 20; beside B they promise 200."""
    table = Table({A: 100.0, B: 90.0, f"{A} {C}": 120.0, f"{B} {D}": 290.0}, force=300.0)
    run(table)
    assert frozenset({A, C}) not in table.fitted and frozenset({B, D}) in table.fitted


@pytest.mark.parametrize(("alone", "again"), [(-20.0, True), (-140.0, False)])
def test_an_effect_that_loses_more_than_there_is_to_gain_is_not_tried_again(run, alone, again):
    """A free force gains 130 nats; an effect that is on or off is fitted whatever its score."""
    gains = {A: 100.0, B: 60.0, C: 55.0, f"{A} {B}": 150.0}
    table = Table(gains, force=130.0, forward={N: alone})
    run(table, (*EFFECTS, BY_ID[N]))
    assert frozenset({N}) in table.fitted
    assert (frozenset({A, N}) in table.fitted) == again


def test_a_refusal_alone_is_no_contradiction_beside_others(run):
    """A force refused alone (it swings where the motion does) may be what B lacks."""
    gains = {A: 250.0, B: 300.0, f"{A} {B}": 520.0}
    table = Table(gains, force=100.0, forward={A: -np.inf})
    assert chosen(run(table)) == {A, B}


@pytest.mark.parametrize(("stuck", "fits"), [(545.0, 2), (559.0, 1)])
def test_a_model_is_fitted_again_from_where_more_is_promised(run, stuck, fits):
    """{C, D} is reached from C first; an exchange of {A, D} promises 560 nats of it."""
    gains = {A: 400.0, C: 390.0, D: 100.0, f"{A} {D}": 550.0, f"{C} {D}": 560.0}
    table = Table(gains, once={f"{C} {D}": stuck})
    found = run(table)
    assert table.fitted.count(frozenset({C, D})) == fits
    assert found.tried[0].log_evidence == (560.0 if fits == 2 else stuck)


def test_what_cannot_overtake_the_best_is_not_fitted(run):
    """B has 250 nats less than A: C promises 150 more, D 250; scores underrate by half at most."""
    table = Table({A: 400.0, B: 150.0, f"{B} {C}": 300.0, f"{B} {D}": 400.0})
    run(table)
    assert frozenset({B, C}) not in table.fitted and frozenset({B, D}) in table.fitted


def test_an_ascent_that_gave_up_near_the_best_is_finished_before_it_loses(run):
    table = Table({A: 480.0, B: 520.0, C: 300.0}, unfinished={A: 60.0, C: 400.0})
    assert chosen(run(table)) == {A}
    assert table.finished == [frozenset({A})]  # once, and none that is far behind


@pytest.mark.parametrize(("beside", "finished"), [(0.0, True), (20.0, False)])
def test_the_best_model_s_profile_is_followed_where_that_may_be_all_it_lacks(run, beside, finished):
    """A free force beside it gains 50 nats, or 70: more than it fell short of before."""
    table = Table({A: 470.0}, force=520.0, beside=beside, unfinished={A: 40.0})
    assert run(table).chosen.is_white == finished
    assert table.finished == [frozenset({A})] * finished


def test_a_force_in_contact_is_fitted_in_place_of_three_effects_only(run):
    gains = {A: 200.0, B: 190.0, f"{A} {B}": 400.0, f"{A} {B} {C}": 600.0}
    three = run(Table(gains, in_contact=650.0))
    assert chosen(three) == {A, B, C} and three.contact_odds == 650.0
    assert three.prefers_learned_force()
    two = run(Table(gains | {f"{A} {B}": 550.0}, in_contact=650.0))
    assert chosen(two) == {A, B} and two.contact_odds == -np.inf


def test_shapes_are_sought_anew_before_a_model_is_given_up(run):
    """The depth was found while friction was missing: a side minimum."""
    pair = f"{A} {S}"
    stuck = {f"{pair} {other}": 450.0 for other in (B, C, D)}
    table = Table({S: 300.0, A: 200.0, pair: 600.0}, forward=stuck, once={pair: 450.0})
    found = run(table)
    assert chosen(found) == {A, S} and found.chosen.is_white
    assert found.chosen.candidate.log_evidence == 600.0


def test_no_start_is_fitted_twice(run):
    """The restart of the pair from its first effect is where the pair came from."""
    steps = {A: 300.0, S: 100.0, f"{A} {S}": 400.0}
    table = Table(steps | {f"{A} {S} {other}": 410.0 for other in (B, C, D)})
    run(table)
    assert table.fitted.count(frozenset({A, S})) == 1


def test_an_examined_model_is_not_scored_again_for_a_restart(run, monkeypatch):
    pair = f"{A} {S}"
    table = Table({S: 300.0, A: 200.0, pair: 600.0}, forward={pair: 450.0}, once={pair: 450.0})
    scored, scan = [], table.scan

    def noted(fit, *rest, **more):
        scored.append((fit.ids, fit.gain))
        return scan(fit, *rest, **more)

    monkeypatch.setattr(table, "scan", noted)
    run(table)
    assert len(scored) == len(set(scored))


def test_where_something_remains_the_law_that_an_effect_refines_is_fitted_in_its_place(
    run, monkeypatch
):
    """Though neither scores nor time ask for it: no law is told from one that was not fitted."""
    monkeypatch.setattr(search._Search, "smaller", lambda self, examined: [])
    power = "power_damping"
    table = Table({power: 300.0, C: 280.0, f"{power} {C}": 450.0}, chi2=4.0)
    found = run(table, effects=(BY_ID[power], BY_ID[B], BY_ID[C]))
    assert set(found.chosen.candidate.ids) == {power, C}
    assert frozenset({B, C}) in {frozenset(c.ids) for c in found.tried}
