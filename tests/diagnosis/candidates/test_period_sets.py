"""Sets of effects that periods ahead ask for."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.candidates import period_sets
from bayesimpact.diagnosis.candidates.asked import Asked
from bayesimpact.diagnosis.candidates.period_sets import PeriodSets
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend
from bayesimpact.diagnosis.refits.refit import base_candidate, fit_from
from bayesimpact.diagnosis.score_test.directions import shape_points
from bayesimpact.diagnosis.selection.search import select_model
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.initial.multiple_shooting import multiple_shooting
from bayesimpact.model.effects import SEARCHED
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

MASS = {"obstacle_mass": {"mass": 0.01}, "quadratic_drag": {"coefficient": 1.5}}


def fitted(campaign: Campaign) -> Fit:
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


@pytest.fixture(scope="module")
def heavy() -> Fit:
    """A base fit to recordings of an obstacle with a mass, and drag."""
    return fitted(small_rig.record(1, MASS, duration=4.0))


def test_effects_with_states_of_their_own_are_asked_for(heavy: Fit) -> None:
    assert heavy.reduced_chi2 > 50
    scales = campaign_scales(heavy)
    found = PeriodSets(heavy, SEARCHED, scales).best(3)
    assert {e.id for e in found[1].effects} == set(MASS)
    odds = [s.log_odds for s in found]
    assert odds == sorted(odds) and odds[0] > 100
    reached = fit_from(heavy, found[1].effects, found[1].values, scales)
    assert reached.fit.reduced_chi2 < 1.2
    for effect, numbers in MASS.items():
        for key, value in numbers.items():
            assert reached.fit.value(f"{effect}.{key}") == pytest.approx(value, rel=0.05)


def test_a_set_is_one_whichever_way_the_search_came_by(heavy: Fit) -> None:
    problem = PeriodSets(heavy, [BY_ID[i] for i in MASS], campaign_scales(heavy))
    chosen = problem.shaped(list(MASS))
    assert len(chosen) == 2 and problem.shaped(list(MASS)[::-1]) == chosen
    assert problem.refined(chosen[::-1]) == chosen


def test_a_set_leaves_what_its_least_squares_say(heavy: Fit) -> None:
    """Against simulations of periods ahead at the sizes and shapes of the set."""
    scales = campaign_scales(heavy)
    problem = PeriodSets(heavy, [BY_ID["contact_relaxation"]], scales)
    term = problem.terms[0]
    assert term.shapes in shape_points(term.effect, scales)
    found = problem.set_of((0,), 0.0)
    assert found.values["contact_relaxation.time"] == term.shapes["contact_relaxation.time"]
    ahead = multiple_shooting(heavy.density.likelihood, heavy.mode)
    assert ahead is not None
    o = extend(heavy, found.effects, scales).oscillator
    theta = np.array([found.values[name] for name in o.layout.names])
    left = replace(ahead, oscillator=o).misfit(theta).sum() / ahead.noise.level**2
    said = problem.rows * np.exp(problem.solve((0,))[1])
    none = problem.rows * np.exp(problem.solve(())[1])
    assert said < 0.95 * none and left == pytest.approx(said, rel=0.1)


@pytest.mark.parametrize("angle", [False, True])
def test_every_force_at_the_stop_has_a_term_whatever_its_unit(heavy: Fit, angle: bool) -> None:
    """A size of 1 N/m3 changes nothing that could be seen; a plausible one does."""
    scales = replace(campaign_scales(heavy), angle=angle)
    seen = {t.effect.id for t in PeriodSets(heavy, SEARCHED, scales).terms}
    every = [e for e in SEARCHED if e.needs_stop and e.admissible(scales)]
    assert len(every) > 10
    missing = {e.id for e in every} - seen
    assert missing <= {"opposite_stop"}  # no recording comes as far on the other side


def test_what_replaces_a_base_parameter_moves_with_it(heavy: Fit) -> None:
    """Only the differences of the gaps are told apart from the change of the common one."""
    problem = PeriodSets(heavy, [BY_ID["gap_per_recording"]], campaign_scales(heavy))
    values = problem.set_of((0,), 0.0).values
    gaps = [values[f"gap_per_recording.g[{r}]"] for r in "abc"]
    assert "g" not in values
    alone = problem.set_of((), 0.0).values["g"]
    assert np.mean(gaps) == pytest.approx(alone, abs=0.3 * abs(alone - heavy.value("g")) + 2e-5)


def test_about_a_model_its_own_effects_stay(heavy: Fit) -> None:
    scales = campaign_scales(heavy)
    drag = fit_from(heavy, [BY_ID["quadratic_drag"]], {}, scales)
    problem = PeriodSets(drag.fit, SEARCHED, scales)
    assert "quadratic_drag" not in {t.effect.id for t in problem.terms}
    assert "quadratic_drag.coefficient" in problem.names
    (one, *_) = problem.best(2)
    assert {e.id for e in one.effects} == set(MASS)
    assert max(problem.gains(), key=lambda i: problem.gains()[i]) == "obstacle_mass"


@pytest.mark.parametrize("quantity, noise", [("velocity", 3e-4), ("acceleration", 2e-2)])
def test_other_quantities_ask_for_the_same(quantity: Any, noise: float) -> None:
    chain = MeasuringChain(noise=noise, offsets={})
    fit = fitted(small_rig.record(1, MASS, duration=4.0, chain=chain, quantity=quantity))
    assert fit.reduced_chi2 > 10
    scales = campaign_scales(fit)
    found = PeriodSets(fit, SEARCHED, scales).best(3)
    assert {e.id for e in found[1].effects} == set(MASS)
    reached = fit_from(fit, found[1].effects, found[1].values, scales)
    assert reached.fit.reduced_chi2 < 1.2


def test_recordings_of_two_quantities_weigh_by_their_own_noise() -> None:
    chains = {
        "displacement": MeasuringChain(noise=5e-6, offsets={}),
        "velocity": MeasuringChain(noise=6e-4, offsets={}),
    }
    kinds: Any = list(chains)
    a, b = (small_rig.record(1, MASS, chain=chains[q], quantity=q) for q in kinds)
    fit = fitted(replace(a, recordings=(*a.recordings[:2], b.recordings[2])))
    likelihood = fit.density.likelihood
    assert likelihood.scales[2] == pytest.approx(120.0, rel=0.3)
    ahead = multiple_shooting(likelihood, fit.mode)
    assert ahead is not None
    problem = PeriodSets(fit, [BY_ID["quadratic_drag"]], campaign_scales(fit))
    whole = ahead.misfit(fit.mode).sum() / likelihood.noise.level**2
    assert problem.whole == pytest.approx(whole, rel=1e-9)


def test_there_are_no_sets_without_periods(heavy: Fit, monkeypatch: Any) -> None:
    monkeypatch.setattr(period_sets, "multiple_shooting", lambda likelihood, theta: None)
    problem = PeriodSets(heavy, SEARCHED, campaign_scales(heavy))
    assert problem.best(3) == [] and problem.gains() == {}


@pytest.mark.long
def test_a_search_begins_with_them(heavy: Fit) -> None:
    """The obstacle's mass, which no force along the measured motion shows, is in the second fit."""
    said = list[str]()
    others = ("contact_relaxation", "contact_hardening", "coulomb_friction", "spring_cubic")
    found = select_model(
        heavy,
        [BY_ID[i] for i in (*others, *MASS)],
        campaign_scales(heavy),
        rng=np.random.default_rng(0),
        progress=said.append,
    )
    assert set(found.chosen.candidate.ids) == set(MASS)
    fits = [str(line) for line in said if str(line).startswith("fitting")]
    assert any("obstacle_mass" in line for line in fits[:2])


def test_a_hum_of_the_readings_is_no_speed() -> None:
    """Problems are asked of the motion; what they ask for is fitted to the recordings."""
    hum = {"amplitude": 1e-4, "frequency": 151.0, "phase": 0.7}
    fit = fitted(small_rig.record(1, {**MASS, "sensor_hum": hum}, duration=4.0))
    base = base_candidate(fit)
    asked = Asked(fit, SEARCHED, campaign_scales(fit))
    problem = asked.ahead(base, base)
    sets = problem.best(3)
    assert {e.id for e in sets[1].effects} == set(MASS)
    assert problem.fit.density.oscillator.campaign is fit.density.oscillator.campaign
    plain = PeriodSets(fit, SEARCHED, campaign_scales(fit)).best(3)
    assert not plain or {e.id for e in plain[min(1, len(plain) - 1)].effects} != set(MASS)
    for effects, kept in ((("sensor_hum",), True), (("quadratic_drag",), False)):
        model: Any = SimpleNamespace(fit=fit, effects=tuple(BY_ID[i] for i in effects))
        assert (asked.of_the_motion(model) is None) is kept
