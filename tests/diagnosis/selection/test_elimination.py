"""What is put in the place of an effect."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from effect_rigs import BY_ID
from made_up_models import A, B, Table

from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.selection import elimination, models, ranked
from bayesimpact.diagnosis.selection.elimination import Elimination
from bayesimpact.model.effects import SEARCHED, UNTRIED

RNG = np.random.default_rng
FRICTION, DRAG, SPRING = "coulomb_friction", "quadratic_drag", "spring_cubic"
HYSTERESIS = "hysteresis_bouc_wen"


def model(ids: str, chi2: float) -> Candidate:
    shapeless = SimpleNamespace(
        oscillator=SimpleNamespace(layout=SimpleNamespace(parameters=())),
        priors=SimpleNamespace(lower=(), upper=()),
    )
    fit: Any = SimpleNamespace(
        reduced_chi2=chi2, converged=True, log_likelihood=-500.0 * chi2, density=shapeless
    )
    return Candidate(tuple(BY_ID[i] for i in ids.split()), fit, 0.0)


@pytest.mark.parametrize(("base", "seen"), [(400.0, 100.0), (400.0, 1000.0), (4.0, 100.0)])
def test_laws_that_are_asked_for_take_the_place_where_scores_see_nothing(base, seen) -> None:
    """Where the misfit was large the model without either law may stand in a side minimum; not
    where scores there see what the law that was left out is known to do, 1,450 nats.
    """
    search: Any = Elimination((), None, RNG(0), lambda words: None)
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", base))}
    search.asked = SimpleNamespace(first=lambda *about: ({DRAG, HYSTERESIS}, {DRAG}))
    gains = {HYSTERESIS: seen, SPRING: 0.9 * seen, DRAG: 0.0}
    scores = tuple(Table.score(BY_ID[i], gain) for i, gain in gains.items())
    search.drop = lambda chosen, effect: model(FRICTION, 3.9)
    search.simplified = lambda chosen, effect: []
    search.scanned = lambda rest, effects: Scan(scores, 1e-6, None, (), ())
    fitted, in_place = [], []
    search.fit_one = lambda rest, found, score, rival: fitted.append(score.effect.id)
    search.exchange_in_place = lambda chosen, old, new: in_place.append((old.id, new.id))
    search.exchange(model(f"{FRICTION} {HYSTERESIS}", 1.0))
    assert SPRING in fitted and DRAG not in fitted
    assert ((HYSTERESIS, DRAG) in in_place) == (base > 9.0 and seen < 725.0)


@pytest.mark.parametrize(("effect", "tried"), [(SPRING, True), (HYSTERESIS, False)])
def test_what_is_there_or_not_takes_the_place_of_its_family(effect: str, tried: bool) -> None:
    """Beside a large misfit nothing asks for it, and no score tells: a cubic spring beside another
    one was a pendulum.
    """
    search: Any = Elimination(SEARCHED, None, RNG(0), lambda words: None)
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", 400.0))}
    search.asked = SimpleNamespace(first=lambda *about: ((), ("pendulum_sine",)))
    score = Table.score(BY_ID["pendulum_sine"], 0.0)
    search.drop = lambda chosen, effect: model(FRICTION, 40.0)
    search.simplified = lambda chosen, effect: []
    search.scanned = lambda rest, effects: Scan((score,), 1e-6, None, (), ())
    search.fit_one = lambda rest, found, score, rival: None
    in_place = []
    search.exchange_in_place = lambda chosen, old, new: in_place.append((old.id, new.id))
    search.exchange(model(f"{FRICTION} {effect}", 1.0))
    assert ((effect, "pendulum_sine") in in_place) == tried


@pytest.mark.parametrize(("own", "again"), [(1.2, True), (1.0, False), (0.9, False)])
def test_a_law_that_ends_below_the_one_it_refines_begins_again_there(own, again) -> None:
    """A pendulum of 1.4 rad was a cubic spring: with a free share of gravity it had ended in a side
    minimum, below the one whose torque is all gravity's.
    """
    plain, free = "pendulum_sine", "pendulum_with_spring"
    search: Any = Elimination(SEARCHED, None, RNG(0), lambda words: None)
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", 400.0))}
    search.asked = SimpleNamespace(first=lambda *about: ((), ()))
    scores = (Table.score(BY_ID[free], 400.0), Table.score(BY_ID[plain], 300.0))
    search.drop = lambda chosen, effect: model(FRICTION, 3.9)
    search.simplified = lambda chosen, effect: []
    search.scanned = lambda rest, effects: Scan(scores, 1e-6, None, (), ())
    search.fit_one = lambda rest, found, score, rival: None
    search.tried = {
        frozenset((FRICTION, law)): model(f"{FRICTION} {law}", left)
        for law, left in ((plain, 1.0), (free, own))
    }
    in_place = []
    search.exchange_in_place = lambda chosen, old, new: in_place.append((old.id, new.id))
    search.exchange(model(f"{FRICTION} {SPRING}", 1.0))
    assert ((plain, free) in in_place) == again


@pytest.mark.parametrize("white", [True, False])
def test_beside_a_model_that_leaves_nothing_rivals_must_come_near_what_they_replace(white) -> None:
    search: Any = Elimination((), None, RNG(0), lambda words: None)
    chosen = model(f"{FRICTION} {SPRING}", 1.0)
    search.examined_models = {
        frozenset(): SimpleNamespace(candidate=model("", 400.0)),
        frozenset(chosen.ids): SimpleNamespace(candidate=chosen, is_white=white),
    }
    replaced = []
    search.asked = SimpleNamespace(first=lambda *about: replaced.append(about[-1]) or (set(), {1}))
    search.drop = lambda chosen, effect: model(FRICTION, 100.0)
    search.simplified = lambda chosen, effect: []
    search.scanned = lambda rest, effects: Scan((), 1e-6, None, (), ())
    search.exchange(chosen)
    assert replaced == ([FRICTION, SPRING] if white else ["", ""])


def test_a_better_end_of_the_same_set_is_exchanged_once_more(monkeypatch):
    """What its effects contribute was told at the worse end."""
    first, better = (Table({}).candidate((A, B), gain) for gain in (40.0, 90.0))
    settling, eliminated = object.__new__(Elimination), []
    stand_ins = {
        "weigh_remainder": lambda: None,
        "eliminated": lambda examined: eliminated.append(examined.candidate.fit.gain) or examined,
        "near": lambda examined: [examined.candidate],
        "may_go_on": lambda: True,
        "exchange": lambda candidate: None,
        "beside_rival": lambda examined: [],
        "with_one_without_size": lambda examined: [],
        "log_odds": lambda candidate: candidate.fit.gain,
        "best": lambda size: better,
        "examine": lambda candidate: SimpleNamespace(candidate=candidate),
    }
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(settling, name, stand_in, raising=False)
    found = settling.exchanged(SimpleNamespace(candidate=first))
    assert found.candidate is better and eliminated == [40.0, 90.0]


@pytest.mark.parametrize(
    ("base", "misses", "noise", "weighed"),
    [(400.0, True, True, True), (4.0, True, True, False), (400.0, False, True, False),
     (400.0, True, False, False)],
)  # fmt: skip
def test_models_are_weighed_beside_what_remains(monkeypatch, base, misses, noise, weighed) -> None:
    """Where the misfit was large, something is left and a force of time describes it."""
    search: Any = Elimination((BY_ID[DRAG],), None, RNG(0), lambda words: None)
    near, far = model(f"{FRICTION} {SPRING}", 2.0), model(FRICTION, 3.0)
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", base))}
    search.tried = {frozenset(c.ids): c for c in (far, near)}
    monkeypatch.setattr(ranked, "residual_repetition", lambda fit: 1.0)
    monkeypatch.setattr(ranked, "leaves_something", lambda fit: misses)
    gains = {near.fit.reduced_chi2: 0.0, far.fit.reduced_chi2: 20.0}
    force = SimpleNamespace(
        fit=near.fit,
        leaves_noise=noise,
        log_evidence_gain=lambda fit, alone: gains[fit.reduced_chi2],
    )
    asked: list[Any] = []
    monkeypatch.setattr(ranked, "discrepancy", lambda fit: asked.append(fit) or force)
    search.weigh_remainder()
    search.weigh_remainder()
    led = search.log_odds(far) - search.log_odds(near)
    assert led == pytest.approx(search.cost + 20.0 * weighed)
    assert asked == [near.fit] * (base > 9.0 and misses)


@pytest.mark.parametrize(
    ("odds", "white", "extended"),
    [(492.0, True, True), (492.0, False, False), (488.0, True, False)],
)
def test_a_law_may_have_taken_the_place_of_two(odds: float, white: bool, extended: bool) -> None:
    """The likeliest rival of a model that leaves nothing is extended where it comes near."""
    chosen, rival = model(f"{FRICTION} {HYSTERESIS}", 1.0), model(f"{FRICTION} {DRAG}", 1.1)
    more, part = model(f"{FRICTION} {DRAG} {SPRING}", 1.0), model(FRICTION, 1.2)
    known = {chosen.ids: 500.0, rival.ids: odds, part.ids: odds - 1.0, more.ids: 600.0}
    search: Any = Elimination((), None, RNG(0), lambda words: None)
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", 400.0))}
    search.log_odds = lambda candidate: known[candidate.ids]
    search.ranked = lambda models: sorted(models, key=search.log_odds, reverse=True)
    search.tried = {frozenset(c.ids): c for c in (chosen, rival, part, more)}
    search.may_go_on = lambda: True
    search.examine = lambda candidate: SimpleNamespace(candidate=candidate)
    asked: list[Candidate] = []
    search.extended = lambda examined: asked.append(examined.candidate) or [more]
    found = search.beside_rival(SimpleNamespace(candidate=chosen, is_white=white))
    assert (found, asked) == (([more], [rival]) if extended else ([], []))


def test_laws_of_a_family_take_the_place_of_one_that_ends_at_its_range(monkeypatch) -> None:
    """However well scores see it: its shape says that the law is another one."""
    monkeypatch.setattr(elimination, "is_at_an_end", lambda fit, effect: effect.id == HYSTERESIS)
    search: Any = Elimination(
        (BY_ID[FRICTION], BY_ID[HYSTERESIS]), None, RNG(0), lambda words: None
    )
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", 400.0))}
    search.asked = SimpleNamespace(first=lambda *about: (set(), set()))
    scores = (Table.score(BY_ID[HYSTERESIS], 1e6), Table.score(BY_ID[FRICTION], 0.0))
    search.drop = lambda chosen, effect: model(SPRING, 3.9)
    search.simplified = lambda chosen, effect: []
    search.scanned = lambda rest, effects: Scan(scores, 1e-6, None, (), ())
    in_place = []
    search.fit_one = lambda *about: None
    search.exchange_in_place = lambda chosen, old, new: in_place.append((old.id, new.id))
    search.exchange(model(f"{HYSTERESIS} {SPRING}", 1.0))
    alike = BY_ID[FRICTION].family == BY_ID[HYSTERESIS].family
    assert alike is ((HYSTERESIS, FRICTION) in in_place)


@pytest.mark.parametrize(("at", "ends"), [(0.5, False), (0.2501, True), (4.9999, True)])
def test_a_range_ends_where_ascents_stop(at: float, ends: bool) -> None:
    power = BY_ID["power_damping"]
    names = [f"power_damping.{p.name}" for p in power.parameters]
    shape = [p.is_shape for p in power.parameters].index(True)
    parameters = [SimpleNamespace(name=n, lower=0.25, upper=5.0) for n in names]
    priors = SimpleNamespace(lower=[-np.inf] * len(names), upper=[np.inf] * len(names))
    layout = SimpleNamespace(parameters=parameters)
    density = SimpleNamespace(oscillator=SimpleNamespace(layout=layout), priors=priors)
    mode = np.full(len(names), 1.0)
    mode[shape] = at
    fit: Any = SimpleNamespace(density=density, mode=mode)
    assert elimination.is_at_an_end(fit, power) is ends


@pytest.mark.parametrize("whole", [True, False])
def test_what_is_not_looked_for_is_compared_with_what_else_an_obstacle_does(whole: bool) -> None:
    """A loss in the instant of impact was called a mass of the obstacle, with certainty; a search
    among other effects than the catalogue's asks for none of it.
    """
    effects = SEARCHED if whole else (BY_ID["contact_hardening"],)
    search: Any = Elimination(effects, None, RNG(0), lambda words: None)
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", 4.0))}
    in_place = []
    search.exchange_in_place = lambda chosen, old, new: in_place.append((old.id, new.id))
    for ids in ("obstacle_mass", FRICTION, UNTRIED[0]):  # alone, so that nothing else is exchanged
        search.exchange(model(ids, 1.0))
    told = [("obstacle_mass", other) for other in UNTRIED] + [(UNTRIED[0], UNTRIED[1])]
    assert sorted(in_place) == (sorted(told) if whole else [])


@pytest.mark.parametrize("whole", [True, False])
def test_a_large_misfit_is_asked_of_the_whole_catalogue(monkeypatch, whole: bool) -> None:
    """There even a mode of the obstacle is told from the others."""
    effects = SEARCHED if whole else (BY_ID["contact_hardening"],)
    search: Any = Elimination(effects, None, RNG(0), lambda words: None)
    search.examined_models = {frozenset(): SimpleNamespace(candidate=model("", 400.0))}
    monkeypatch.setattr(models, "Asked", lambda fit, effects, scales: {e.id for e in effects})
    asked = {e.id for e in SEARCHED} | set(UNTRIED) if whole else {"contact_hardening"}
    assert search.asked == asked
