"""Forces of no effect that the equation of motion asks for, and the search beside them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.candidates import asked as asked_module
from bayesimpact.diagnosis.candidates.asked import Asked, known_effects
from bayesimpact.diagnosis.candidates.likely_sets import EffectSet, LikelySets
from bayesimpact.diagnosis.candidates.likely_terms import sets_with_a_term
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.location import locate
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate, base_candidate, fit_from
from bayesimpact.diagnosis.selection import unlisted
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.formula.grammar import ONE, Term
from bayesimpact.formula.law import effect_of, is_formula, kind_id, starts_of, term_of
from bayesimpact.formula.library import LINEAR, V, library
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED
from bayesimpact.trial.rig.recordings import Effects

DETENT = {"stiffness": 40.0, "place": -2.5e-3, "width": 7e-4}
CUBIC = {"stiffness": 1e6}
HUM = {"amplitude": 4e-5, "frequency": 17.0, "phase": 1.0}


def decays(effects: Effects) -> Campaign:
    return small_rig.record(
        3, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0, rate=500.0
    )


def fitted(effects: Effects) -> Fit:
    return identify(decays(effects), rng=np.random.default_rng(0), search=False).fit


def asked_for(fit: Fit) -> list[EffectSet]:
    return sets_with_a_term(LikelySets(fit, SEARCHED, campaign_scales(fit)), 5)


@pytest.fixture(scope="module")
def detent() -> tuple[Fit, list[EffectSet]]:
    fit = fitted({"detent": DETENT, "spring_cubic": CUBIC})
    return fit, asked_for(fit)


def test_a_force_of_no_effect_is_asked_for_beside_what_it_acts_with(detent: Any) -> None:
    """At its place, and so near its numbers that a fit from there leaves nothing."""
    fit, found = detent
    assert fit.reduced_chi2 > 100 and found
    both = next(s for s in found if [e.id for e in s.effects][:-1] == ["spring_cubic"])
    law = both.effects[-1]
    assert is_formula(law) and law.price > 0.0
    term = term_of(law, both.values)
    assert (term.region, term.side, term.position, term.speed) == ("bump", -1, LINEAR, ONE)
    assert term.place == pytest.approx(-DETENT["place"], rel=0.05)
    assert term.width == pytest.approx(DETENT["width"], rel=0.2)
    assert abs(both.values[f"{law.id}.size"]) == pytest.approx(DETENT["stiffness"], rel=0.2)
    candidate = fit_from(fit, both.effects, both.values, campaign_scales(fit))
    assert candidate.fit.reduced_chi2 < 1.1


@pytest.mark.parametrize(
    "effects", [{}, {"spring_cubic": CUBIC, "quadratic_drag": {"coefficient": 3.0}}]
)
def test_no_term_is_asked_for_where_the_catalogue_explains_as_much(effects: Effects) -> None:
    assert asked_for(fitted(effects)) == []


def test_a_set_with_a_term_leaves_far_less_than_every_set(detent: Any) -> None:
    fit, found = detent
    problem = LikelySets(fit, SEARCHED, campaign_scales(fit))
    least = min(problem.solve(problem.refined(c))[1] for level in problem.levels(5) for c in level)
    left = [problem.rows * np.exp(-2 * s.log_odds / problem.rows) for s in found]  # with the price
    whole = problem.rows * np.exp(problem.solve(())[1])
    assert all(np.log(whole * one / problem.rows**2) < least for one in left)
    assert sets_with_a_term(problem, 5, excess=1e9) == []


def test_what_a_model_has_and_no_grid_holds_is_known_to_the_equation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A hum at its frequency and phases, a formula at its place; only their sizes are free."""
    monkeypatch.setattr(
        asked_module, "recordings_without_hums", tuple
    )  # a hum that no spectrum shows
    fit = fitted({"sensor_hum": HUM, "spring_cubic": CUBIC})
    scales, hum, cubic = campaign_scales(fit), BY_ID["sensor_hum"], BY_ID["spring_cubic"]
    phases = {f"sensor_hum.phase[{r.name}]": HUM["phase"] for r in _recordings(fit)}
    start = {"spring_cubic.stiffness": 1e6, "sensor_hum.amplitude": 4e-5}
    start |= {"sensor_hum.frequency": HUM["frequency"], **phases}
    both = fit_from(fit, (cubic, hum), start, scales)
    assert both.fit.reduced_chi2 < 1.1
    ((effect, shapes),) = known_effects(both)
    assert effect is hum and set(shapes) == {"sensor_hum.frequency", *phases}
    asked = Asked(fit, SEARCHED, scales)
    without, beside = (asked.about(c, flight=False) for c in (base_candidate(fit), both))
    assert [t.effect.id for t in beside.known] == ["sensor_hum"] and not without.known
    unknown, told = (p.solve(p.shaped(["spring_cubic"]))[1] for p in (without, beside))
    assert told < unknown - np.log(3.0)
    first = beside.best(1)[0]
    assert [e.id for e in first.effects] == ["sensor_hum", "spring_cubic"]
    assert first.values["sensor_hum.amplitude"] == pytest.approx(HUM["amplitude"], rel=0.1)
    assert first.values["sensor_hum.frequency"] == pytest.approx(HUM["frequency"], rel=1e-3)


def _recordings(fit: Fit) -> Any:
    return fit.density.oscillator.campaign.recordings


def test_terms_come_back_from_their_effects(detent: Any) -> None:
    scales = campaign_scales(detent[0])
    terms = library(replace(scales, impacts=3, indentation=1e-3, gap=2e-3), -6e-3, 6e-3)
    assert len(terms) > 300
    for term in terms:
        effect = effect_of(term, 1.0, 1e-2, 1.0, signed=True)
        assert term_of(effect, starts_of(term)) == term
        assert kind_id(effect.id) == kind_id(
            effect_of(_moved(term), 1.0, 1e-2, 1.0, signed=True).id
        )
    assert kind_id("contact_second_stage_at_1") == "contact_second_stage_at_1"


def _moved(term: Any) -> Any:
    return replace(term, **{name: 1.3 * value for name, value in term.shapes.items()})


@pytest.mark.parametrize(("times", "leads"), [(0.9, True), (1.1, False)])
def test_an_effect_joins_a_formula_only_where_it_leaves_far_less(
    times: float, leads: bool, monkeypatch: Any
) -> None:
    """What a formula leaves may be what tells it from the force that it stands for."""
    monkeypatch.setattr(unlisted.Remaining, "leads_on", lambda self, examined, larger: True)
    left = 1.0 + times * (5.0 - 1.0) / EXCESS  # of the misfit beyond the noise
    law = effect_of(Term("bump", ONE, V, -1, 2e-3, 5e-4), 1.0, 1e-2, 1.0, signed=True)

    def model(*effects: Any, chi2: float) -> Candidate:
        return Candidate(effects, SimpleNamespace(reduced_chi2=chi2), 0.0)  # type: ignore[arg-type]

    search = unlisted.Unlisted((), None, np.random.default_rng(0), print)  # type: ignore[arg-type]
    cubic, drag = BY_ID["spring_cubic"], BY_ID["quadratic_drag"]
    examined = SimpleNamespace(candidate=model(cubic, law, chi2=5.0))
    assert search.leads_on(examined, model(cubic, law, drag, chi2=left)) is leads  # type: ignore[arg-type]
    plain = SimpleNamespace(candidate=model(cubic, chi2=5.0))
    assert search.leads_on(plain, model(cubic, drag, chi2=4.9))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def whole() -> tuple[Diagnosis, list[str]]:
    effects = {"detent": DETENT, "spring_cubic": CUBIC, "sensor_hum": HUM}
    said: list[str] = []
    names = (
        "spring_cubic", "sensor_hum", "spring_quadratic", "quadratic_drag", "coulomb_friction",
        "sensor_drift", "harmonic_forcing", "structural_damping",
    )  # fmt: skip
    found = diagnose(
        decays(effects),
        rng=np.random.default_rng(0),
        effects=tuple(BY_ID[name] for name in names),
        search=False,
        progress=said.append,
    )
    return found, said


@pytest.mark.long
def test_a_large_force_of_no_effect_is_named_with_all_that_acts_beside_it(whole: Any) -> None:
    found, said = whole
    assert found.before.reduced_chi2 > 100 and found.after.reduced_chi2 < 1.1
    assert found.verdict == "named"
    named = {e.id for e in found.effects if not is_formula(e)}
    assert named == {"spring_cubic", "sensor_hum"}
    (law,) = (e for e in found.effects if is_formula(e))
    values = dict(zip(found.after.names, found.after.mode, strict=True))
    assert values[f"{law.id}.place"] == pytest.approx(-DETENT["place"], rel=0.02)
    assert found.selection.probability(law.id) > 0.99  # at whatever shape it was met
    assert sum("fitting" in one for one in said) < 60
    assert any("force A exp(" in one for one in said)
    assert not any("formula_" in one for one in said)  # an id that no one reads


def test_what_the_probe_does_is_no_place_where_something_moves_the_mass(whole: Any) -> None:
    found, _ = whole
    hum = next(e for e in found.effects if e.id == "sensor_hum")
    others = tuple(e for e in found.effects if e is not hum)
    selection = found.selection
    place = locate(found.before, found.after, selection.unknown, (hum, *others))
    assert place.regime == "free" and place.displacement[0] < DETENT["place"]
    assert locate(found.before, found.after, selection.unknown, (hum,)).regime == "measurement"
