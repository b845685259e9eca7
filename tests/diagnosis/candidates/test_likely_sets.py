"""Sets of effects that the equation of motion asks for along the measured motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from driven_twin import driven_motion
from effect_rigs import BY_ID

from bayesimpact.data.campaign import SECOND_STOP, Campaign
from bayesimpact.data.gaps import without
from bayesimpact.data.input import Input
from bayesimpact.data.quantity import Quantity
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.candidates.asked import Asked
from bayesimpact.diagnosis.candidates.equation_error import (
    Path,
    measured_paths,
    terms_of,
    without_rest,
)
from bayesimpact.diagnosis.candidates.likely_sets import EffectSet, LikelySets
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.refits.size import force_along
from bayesimpact.diagnosis.score_test.directions import shape_points
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import EFFECTS, SEARCHED
from bayesimpact.model.parameters import SLOTS
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Effects

FREE = {
    "spring_cubic": {"stiffness": 4e6},
    "quadratic_drag": {"coefficient": 3.0},
    "coulomb_friction": {"force": 0.02},
}
STOPPED = {
    "opposite_stop": {"gap": 3e-3, "stiffness": 600.0},
    "contact_damping_indentation": {"coefficient": 4000.0},
}


def fitted(campaign: Campaign) -> Fit:
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def decays(seed: int, effects: Effects) -> Campaign:
    return small_rig.record(
        seed, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=6.0
    )


def sets_of(fit: Fit) -> list[EffectSet]:
    return LikelySets(fit, SEARCHED, campaign_scales(fit)).best(5)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_three_strong_effects_are_asked_for(seed: int) -> None:
    fit = fitted(decays(seed, FREE))
    assert fit.reduced_chi2 > 1000
    found = sets_of(fit)
    (three,) = (s for s in found if len(s.effects) == 3)
    assert {e.id for e in three.effects} == set(FREE)
    for effect, numbers in FREE.items():
        for name, value in numbers.items():
            assert three.values[f"{effect}.{name}"] == pytest.approx(value, rel=0.05)
    assert three.values["k1"] == pytest.approx(small_rig.PLAIN.k1, rel=1e-3)
    assert [s.log_odds for s in found] == sorted(s.log_odds for s in found)
    candidate = fit_from(fit, three.effects, three.values, campaign_scales(fit))
    assert candidate.fit.converged and candidate.fit.reduced_chi2 < 1.1


# bias of their sizes: noise that is integrated and inertia's own
@pytest.mark.parametrize(("quantity", "rel"), [("velocity", 0.1), ("acceleration", 0.3)])
def test_velocities_and_accelerations_are_integrated(quantity: Quantity, rel: float) -> None:
    chain = MeasuringChain(noise={"velocity": 1e-3, "acceleration": 0.03}[quantity])
    campaign = small_rig.record(
        1, FREE, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=6.0,
        quantity=quantity, chain=chain,
    )  # fmt: skip
    fit = fitted(campaign)
    assert fit.reduced_chi2 > 100
    three = sets_of(fit)[2]
    assert {e.id for e in three.effects} == set(FREE)
    for effect, numbers in FREE.items():
        for name, value in numbers.items():
            assert three.values[f"{effect}.{name}"] == pytest.approx(value, rel=rel)
    candidate = fit_from(fit, three.effects, three.values, campaign_scales(fit))
    assert candidate.fit.converged and candidate.fit.reduced_chi2 < 1.1
    # no stop: whose side of the rest the mass is on, a derivative does not say
    stopped = fitted(small_rig.record(1, quantity=quantity, chain=chain))
    assert sets_of(stopped) == []


def test_a_velocity_with_samples_set_aside_is_integrated_over_them() -> None:
    """At an end, and over several periods: what stands in for them goes on as the motion does."""
    campaign = small_rig.record(
        2, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0,
        quantity="velocity", chain=MeasuringChain(noise=1e-4),
    )  # fmt: skip
    fit = fitted(campaign)
    true = fit.displacements[0]
    for gap in ((0, 60), (1500, 2100), (3900, 4000)):
        one = without(campaign.recordings[0], [gap])
        again = fitted(replace(campaign, recordings=(one, *campaign.recordings[1:])))
        path = measured_paths(again)[0]
        used = one.used if one.used is not None else np.ones(true.size, dtype=bool)
        assert np.abs(path.y - true)[used].max() < 0.15 * np.abs(true).max()


def test_with_a_stop() -> None:
    fit = fitted(small_rig.record(1, STOPPED, duration=4.0))
    assert fit.reduced_chi2 > 9
    scales = campaign_scales(fit)
    found = LikelySets(fit, SEARCHED, scales, flight=True).best(1)[0]
    assert [e.id for e in found.effects] == ["opposite_stop"]
    assert found.values["opposite_stop.gap"] == pytest.approx(3e-3, rel=0.01)  # off the coarse grid
    stop = fit_from(fit, found.effects, found.values, scales)
    beside, _ = Asked(fit, SEARCHED, scales).first(stop, stop)
    assert "contact_damping_indentation" in beside
    effects = [BY_ID[i] for i in STOPPED]
    assert fit_from(fit, effects, found.values, scales).fit.reduced_chi2 < 1.2


def test_driven_with_an_unknown_gain() -> None:
    n, interval = 3000, 2e-3
    rng = np.random.default_rng(3)
    force = 2.0 * np.convolve(rng.standard_normal(n), np.ones(5) / 5, "same")
    values = {"mass": 0.5, "c1": 0.6, "k1": 800.0, "y0": 0.0, "v0": 0.0}
    motion, _ = driven_motion(values, force, interval, lambda y, v, touching: 2e7 * y**3)
    samples = motion + 5e-6 * rng.standard_normal(n)
    recording = Recording("one", "", samples, interval, input=Input(force / 2.5, free=True))
    fit = fitted(Campaign("rig", 0.5, (recording,), stop=False))
    assert fit.reduced_chi2 > 9
    first = sets_of(fit)[0]
    assert [e.id for e in first.effects] == ["spring_cubic"]
    assert first.values["spring_cubic.stiffness"] == pytest.approx(2e7, rel=0.02)
    assert first.values["input_gain"] == pytest.approx(2.5, rel=0.01)


def test_nothing_is_asked_for_where_nothing_is_missing() -> None:
    assert sets_of(fitted(decays(1, {}))) == []


def test_velocities_ask_for_nothing_where_nothing_is_missing() -> None:
    velocity = small_rig.record(
        1, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, quantity="velocity",
        chain=MeasuringChain(noise=1e-3),
    )  # fmt: skip
    assert sets_of(fitted(velocity)) == []


def test_beside_what_a_campaign_declares() -> None:
    """Of a two-sided stop: its size is an unknown, and it is none of the effects of a set."""
    second = {"gap": 2.5e-3, "stiffness": 4000.0}
    campaign = small_rig.record(3, {"opposite_stop": second, "spring_cubic": {"stiffness": 2e7}})
    fit = fitted(replace(campaign, declared=(SECOND_STOP,)))
    assert fit.reduced_chi2 > 9
    problem = LikelySets(fit, SEARCHED, campaign_scales(fit))
    first = problem.best(1)[0]
    assert [e.id for e in first.effects] == ["spring_cubic"]
    assert first.values["opposite_stop.stiffness"] == pytest.approx(4000.0, rel=0.1)
    found = fit_from(fit, first.effects, first.values, campaign_scales(fit))
    assert found.fit.reduced_chi2 < 1.2


@pytest.mark.parametrize(
    "effect_id", ["spring_cubic", "quadratic_drag", "opposite_stop", "contact_hardening"]
)
def test_columns_are_the_law_along_the_path(effect_id: str) -> None:
    """By the plain Python law, sample for sample."""
    fit = fitted(small_rig.record(1))
    scales, effect = campaign_scales(fit), BY_ID[effect_id]
    paths = measured_paths(fit)
    term = terms_of(fit, [effect], scales, paths)[0]
    slots = fit.density.oscillator.layout.slots(fit.mode)
    shapes = [term.shapes[f"{effect_id}.{p.name}"] for p in effect.parameters if p.is_shape]
    assert effect.law is not None
    for path, q, columns in zip(paths, slots, term.columns, strict=True):
        force = force_along(effect.law, path.y, path.v, path.t, [1.0, *shapes], q)
        expected = without_rest(path, path.rows.integrals(force)[:, None])
        np.testing.assert_allclose(columns, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


LOOPS = {
    "hysteresis_bouc_wen": {"stiffness": 40.0, "decay": 300.0},
    "presliding_friction": {"force": 0.02, "displacement": 2.5e-4},
    "spring_piecewise": {"stiffness": 200.0, "gap": 3e-3, "damping": 1.0},
}


@pytest.mark.parametrize("effect_id", LOOPS)
def test_a_memory_and_a_clearance_are_asked_for_at_a_shape_nearby(effect_id: str) -> None:
    """States follow the measured motion; of the grid the nearest point is taken."""
    planted = {effect_id: LOOPS[effect_id]}
    if effect_id == "spring_piecewise":  # of rigs with a stop only
        fit = fitted(small_rig.record(3, planted, duration=4.0))
    else:
        fit = fitted(decays(3, planted))
    effects = [e for e in EFFECTS if e in SEARCHED or e.id in LOOPS]
    assert fit.reduced_chi2 > 9
    sets = LikelySets(fit, effects, campaign_scales(fit), flight=effect_id == "spring_piecewise")
    first = sets.best(5)[0]
    assert [e.id for e in first.effects] == [effect_id]
    for name, value in LOOPS[effect_id].items():
        assert first.values[f"{effect_id}.{name}"] == pytest.approx(value, rel=0.3)


def test_a_law_in_the_place_of_the_spring_and_the_dashpot_is_asked_for() -> None:
    """It shares the spring's size and has none of its own."""
    law = {"exponent": 1.5, "damping": 2.0}
    fit = fitted(small_rig.record(3, {"hunt_crossley": law}, duration=4.0))
    assert fit.reduced_chi2 > 9
    first = LikelySets(fit, SEARCHED, campaign_scales(fit)).best(1)[0]
    assert [e.id for e in first.effects] == ["hunt_crossley"]
    found = fit_from(fit, first.effects, first.values, campaign_scales(fit)).fit
    assert found.reduced_chi2 < 1.2
    assert found.value("hunt_crossley.exponent") == pytest.approx(1.5, rel=0.05)


def test_a_shape_has_its_price() -> None:
    """A power of the speed may be two: quadratic drag has one unknown less."""
    fit = fitted(decays(2, {"quadratic_drag": {"coefficient": 3.0}}))
    sets = LikelySets(fit, SEARCHED, campaign_scales(fit))
    assert [e.id for e in sets.best(1)[0].effects] == ["quadratic_drag"]
    for effect_id, unknowns in (("quadratic_drag", 1), ("power_damping", 2)):
        own = [[i] for i, term in enumerate(sets.terms) if term.effect.id == effect_id]
        one = max(own, key=sets.log_odds)
        price = -0.5 * sets.rows * sets.solve(one)[1] - sets.log_odds(one)
        assert price == pytest.approx(0.5 * unknowns * np.log(sets.rows) + sets.cost)


def test_grids_are_finer_here() -> None:
    scales = campaign_scales(fitted(small_rig.record(1)))
    law = BY_ID["opposite_stop"]
    coarse, fine = ([*map(dict.values, shape_points(law, scales, k))] for k in (1, 3))
    own = law.parameter("gap").grid
    assert own is not None
    np.testing.assert_array_equal(np.ravel([*map(list, coarse)]), own(scales))
    axis = np.ravel([*map(list, fine)])
    np.testing.assert_allclose(axis[::3], own(scales))
    np.testing.assert_allclose(np.diff(axis)[:3], np.diff(own(scales))[0] / 3)


def test_errors_of_stretches_are_white() -> None:
    """Of noise alone, whatever part of it is set aside: variance one, neighbours uncorrelated."""
    campaign = small_rig.record(1, duration=12.0)
    used = np.ones(campaign.recordings[0].samples.size, dtype=bool)
    used[3000:3010] = False
    recordings = (replace(campaign.recordings[0], used=used), *campaign.recordings[1:])
    fit = fitted(replace(campaign, recordings=recordings))
    paths = measured_paths(fit)
    assert not paths[0].rows.kept.all()
    rng, level = np.random.default_rng(0), fit.density.likelihood.noise.level
    white = np.concatenate([whitened_noise(path, level, rng) for path in paths for _ in range(20)])
    assert white.var() == pytest.approx(1.0, abs=5 * np.sqrt(2 / white.size))
    assert abs(np.mean(white[1:] * white[:-1])) < 5 / np.sqrt(white.size)


def whitened_noise(path: Path, level: float, rng: np.random.Generator) -> np.ndarray:
    noise = level * rng.standard_normal(path.y.size)
    windows = np.lib.stride_tricks.sliding_window_view(noise, path.operator.size)
    errors = windows[:: path.rows.hop] @ path.operator
    return path.whiten(np.where(path.rows.kept, errors, 0.0)[:, None])[path.rows.kept, 0]


def test_velocities_by_local_quartics() -> None:
    fit = fitted(small_rig.record(1))
    slots = fit.density.oscillator.layout.slots(fit.mode)
    for path, y, q in zip(measured_paths(fit), fit.displacements, slots, strict=True):
        assert np.abs(path.y - y).max() < 4 * small_rig.NOISE
        speed = np.gradient(y, path.t)
        inner = slice(20, -20)
        off = np.abs(path.v - speed)[inner]
        assert np.median(off) < 5e-3 * np.abs(speed).max()
        assert np.array_equal(path.d > 0, path.y > q[SLOTS.index("g")])


def test_stretches_in_which_friction_holds_the_mass_tell_nothing() -> None:
    """It comes to rest beside the spring's own rest, which asks for a drift of the probe."""
    planted = {"coulomb_friction": {"force": 0.06}, "quadratic_drag": {"coefficient": 1.0}}
    fit = fitted(decays(4, planted))
    moves = measured_paths(fit)[0].rows.kept
    assert moves[0] and not moves[-1] and 0.2 < moves.mean() < 0.6
    one, two = sets_of(fit)
    assert {e.id for e in one.effects} == {"coulomb_friction"}
    refined = {e.prefer or e.id for e in two.effects}
    assert refined == set(planted)


def test_in_flight_no_law_of_the_stop_disturbs_what_is_asked_for() -> None:
    """A stop that does not pull; over all stretches its impacts bias everything."""
    effects: Effects = {
        "contact_no_tension": {}, "quadratic_drag": {"coefficient": 3.0},
        "spring_quadratic": {"stiffness": 2e4},
    }  # fmt: skip
    fit = fitted(small_rig.record(2, effects, duration=4.0))
    assert fit.reduced_chi2 > 9
    scales = campaign_scales(fit)
    flight = LikelySets(fit, SEARCHED, scales, flight=True)
    assert all("contact" not in term.effect.id for term in flight.terms)
    deepest = [float(np.max(p.d)) for p in flight.paths]
    assert min(deepest) > 0
    for path in flight.paths:
        kept = np.flatnonzero(path.rows.kept) * path.rows.hop
        touched = np.concatenate([path.d[k : k + path.rows.phi.size] for k in kept])
        assert touched.max() < 0
    found = flight.best(5)[1]
    assert {e.id for e in found.effects} == {"quadratic_drag", "spring_quadratic"}
    assert found.values["spring_quadratic.stiffness"] == pytest.approx(2e4, rel=0.05)


def test_without_a_stretch_in_flight_nothing_is_asked_for() -> None:
    fit = fitted(small_rig.record(1, STOPPED, duration=4.0))
    at = fit.mode.copy()
    at[fit.names.index("g")] = -1.0
    flight = LikelySets(replace(fit, mode=at), SEARCHED, campaign_scales(fit), flight=True)
    assert flight.best(5) == [] and flight.gains(["spring_cubic"]) == {}
