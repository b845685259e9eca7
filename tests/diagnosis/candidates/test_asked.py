"""The equation of motion is asked about any model's rest and gap."""

from __future__ import annotations

import numpy as np
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.candidates.asked import ASKED, Asked
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import base_candidate, fit_from
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED
from bayesimpact.response.measured_motion import smoothed


def test_about_a_better_model_a_quadratic_spring_hides_nothing_else() -> None:
    """The base model's rest is off by what the spring rectifies, each recording's by its own."""
    planted = {"spring_quadratic": {"stiffness": -4e4}, "quadratic_drag": {"coefficient": 0.5}}
    campaign = small_rig.record(
        5, planted, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=6.0
    )
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    asked, base = Asked(fit, SEARCHED, scales), base_candidate(fit)
    spring = asked.about(base, flight=False).best(1)[0]
    assert [e.id for e in spring.effects] == ["spring_quadratic"]
    better = fit_from(fit, spring.effects, spring.values, scales)
    again = asked.about(better, flight=False)
    assert asked.about(better, flight=False) is again
    two = again.best(2)[1]
    assert {e.id for e in two.effects} == set(planted)
    wrong = asked.about(base, flight=False)
    assert two.log_odds > max(s.log_odds for s in wrong.best(5))
    first, seen = asked.first(better, better)
    assert "quadratic_drag" in first and len(first) == ASKED and first < seen


def test_what_acts_in_flight_is_judged_there() -> None:
    fit = identify(
        small_rig.record(1, {"contact_no_tension": {}}, duration=4.0),
        rng=np.random.default_rng(0), search=False,
    ).fit  # fmt: skip
    asked = Asked(fit, SEARCHED, campaign_scales(fit))
    base = base_candidate(fit)
    flight = asked.about(base, flight=True).gains(())
    ahead = asked.ahead(base, base).gains()
    stops = {i: g for i, g in ahead.items() if i not in flight}
    expected = [sorted(g, key=lambda i: -g[i])[:ASKED] for g in (flight, stops)]
    assert asked.first(base, base) == ({*expected[0], *expected[1]}, {*flight, *ahead})
    assert "contact_no_tension" in expected[1]
    assert asked.ahead(base, base) is asked.ahead(base, base)


def test_in_the_place_of_an_effect_only_what_comes_near_is_asked_for() -> None:
    planted = {"obstacle_mass": {"mass": 0.05}, "quadratic_drag": {"coefficient": 1.5}}
    fit = identify(
        small_rig.record(1, planted, duration=4.0), rng=np.random.default_rng(0), search=False
    ).fit
    scales = campaign_scales(fit)
    others = {"base_motion", "adhesion"}  # they imitate it as well, and places are few
    asked = Asked(fit, [e for e in SEARCHED if e.id not in others], scales)
    whole = fit_from(fit, [BY_ID[i] for i in planted], {}, scales)
    assert whole.fit.reduced_chi2 < 1.2
    drag, mass = (
        fit_from(fit, [BY_ID[i]], {}, scales) for i in ("quadratic_drag", "obstacle_mass")
    )
    every, near = (asked.first(drag, whole, own)[0] for own in ("", "obstacle_mass"))
    assert {"obstacle_mass", "contact_no_tension"} <= every
    assert near == {"obstacle_mass"}  # judged by periods ahead alone: nothing of it in flight
    near, seen = asked.first(mass, whole, "quadratic_drag")
    assert {"second_mode", "contact_hardening", "spring_cubic"} <= seen
    assert {"quadratic_drag", "power_damping"} <= near and "second_mode" not in near


def test_in_the_place_of_what_no_problem_sees_all_are_asked_for() -> None:
    planted = {"quadratic_drag": {"coefficient": 1.5}}
    fit = identify(
        small_rig.record(1, planted, duration=4.0), rng=np.random.default_rng(0), search=False
    ).fit
    asked, base = Asked(fit, SEARCHED, campaign_scales(fit)), base_candidate(fit)
    assert asked.first(base, base, "harmonic_forcing") == asked.first(base, base)


def test_where_no_period_is_told_all_stretches_say_what_the_stop_does() -> None:
    short = small_rig.record(1, {"contact_no_tension": {}}).truncated(0.1)
    fit = identify(short, rng=np.random.default_rng(0), search=False).fit
    asked, base = Asked(fit, SEARCHED, campaign_scales(fit)), base_candidate(fit)
    assert not asked.ahead(base, base).terms
    _, seen = asked.first(base, base)
    assert {"contact_hardening", "contact_damping_speed", "hunt_crossley"} <= seen


def test_a_period_longer_than_the_recording_is_smoothed_over_what_there_is() -> None:
    """A fit that failed may have any period, and noise that asks for long polynomials."""
    samples = 1e-3 * np.random.default_rng(0).standard_normal(40)
    y, v = smoothed(samples, 1e-3, 10.0, 1.0)
    assert y.shape == v.shape == (40,) and np.isfinite(v).all()
