"""p-values of scores under the model, alone and corrected for their number; pairs."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy import stats

from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.score_test.directions import Direction, directions
from bayesimpact.diagnosis.score_test.frequency_scan import periodic_scores
from bayesimpact.diagnosis.score_test.pairs import promising_pairs
from bayesimpact.diagnosis.score_test.projection import Projection
from bayesimpact.diagnosis.score_test.scan import (
    DRAWS,
    Scan,
    _corrected,
    _Test,
    scan,
    score_directions,
)
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.inference.fit import PosteriorDensity
from bayesimpact.inference.identify import identify
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.oscillator import Oscillator


def record(effect_id: str, count: int, one_sided: bool = False, contrast: bool = False):
    names = tuple(f"{effect_id}.{i}" for i in range(count))
    return Direction(BY_ID[effect_id], {}, names, (), one_sided, contrast)


def projection(information: np.ndarray, score: np.ndarray | None = None) -> Projection:
    k = information.shape[0]
    score = np.zeros(k) if score is None else score
    return Projection(score, information, np.zeros((1, k)), np.ones(k))


def random_information(rng: np.random.Generator, k: int, decades: float = 4.0) -> np.ndarray:
    root = rng.standard_normal((k, k + 3)) * 10.0 ** rng.uniform(-decades, decades, (k, 1))
    return root @ root.T


def draws(rng: np.random.Generator, information: np.ndarray, count: int) -> np.ndarray:
    scale = np.sqrt(np.diag(information))
    root = np.linalg.cholesky(information / np.outer(scale, scale))
    return rng.standard_normal((count, scale.size)) @ root.T * scale


@pytest.mark.parametrize(
    ("count", "settings"),
    [(1, {"one_sided": True}), (1, {}), (4, {}), (4, {"contrast": True}), (2, {"contrast": True})],
)
def test_p_values_are_uniform_under_the_model(count, settings):
    rng = np.random.default_rng(count)
    information = random_information(rng, 6, 0.5 if count > 1 else 4.0)
    group = np.arange(1, 1 + count)
    test = _Test(projection(information), group, record("spring_cubic", count, **settings))
    p = test.p_values(draws(rng, information, 4000))
    assert stats.kstest(p, "uniform").pvalue > 1e-4
    assert test.rank == count - bool(settings.get("contrast"))


def test_a_statistic_is_the_dense_quadratic_form():
    rng = np.random.default_rng(0)
    information = random_information(rng, 5)
    score = draws(rng, information, 1)[0]
    group = np.array([0, 2, 3])
    w = _Test(projection(information), group, record("spring_cubic", 3)).whitened(score)
    block = information[np.ix_(group, group)]
    assert w @ w == pytest.approx(score[group] @ np.linalg.solve(block, score[group]))


def test_a_contrast_recovers_differences_only():
    """Sizes that move alike are the model's own parameter, which has absorbed them: S 1 = 0."""
    rng = np.random.default_rng(1)
    root = rng.standard_normal((3, 30))
    root = np.vstack([root, -root.sum(axis=0)])
    information = root @ root.T
    kind = record("spring_cubic", 4, contrast=True)
    test = _Test(projection(information), np.arange(4), kind)
    assert test.rank == 3
    truth = np.array([1.0, -2.0, 0.5, 3.5])
    sizes = test.size_map @ information @ truth
    np.testing.assert_allclose(sizes, truth - truth.mean(), atol=1e-9)


def each_alone(information: np.ndarray, one_sided: bool = False) -> list[_Test]:
    p = projection(information)
    kind = record("coulomb_friction", 1, one_sided)
    return [_Test(p, np.array([i]), kind) for i in range(information.shape[0])]


def test_correction_of_independent_and_of_identical_scores():
    rng = np.random.default_rng(2)
    independent = np.diag(10.0 ** np.arange(-3.0, 4.0))
    identical = np.outer(np.arange(1.0, 8.0), np.arange(1.0, 8.0))
    for p in (0.01, 0.05, 0.3):
        error = 4 * np.sqrt(p / DRAWS)
        found = _corrected(projection(independent), each_alone(independent), p, rng)
        assert found == pytest.approx(1 - (1 - p) ** 7, abs=4 * np.sqrt(7 * p / DRAWS))
        found = _corrected(projection(identical), each_alone(identical), p, rng)
        assert found == pytest.approx(p, abs=error)
    tiny = 1e-7
    found = _corrected(projection(independent), each_alone(independent), tiny, rng)
    assert found == pytest.approx(7e-7)  # below what draws resolve: Bonferroni


def test_corrected_p_values_are_uniform_under_the_model():
    rng = np.random.default_rng(3)
    information = random_information(rng, 9)
    kinds = [record("spring_cubic", 1, i % 2 == 0) for i in range(5)]
    kinds += [record("gap_per_recording", 4, contrast=True)]
    groups = [*np.arange(5)[:, None], np.arange(5, 9)]
    p = projection(information)
    tests = [_Test(p, g, k) for g, k in zip(groups, kinds, strict=True)]
    scores = draws(rng, information, 250)
    smallest = np.min([t.p_values(scores) for t in tests], axis=0)
    found = [_corrected(p, tests, float(s), rng) for s in smallest]
    assert stats.kstest(found, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_false_alarms_on_recordings_with_nothing_missing(small, rho, monkeypatch):
    """New noise on the same motion, refitted and scored again, many times."""
    monkeypatch.setattr("bayesimpact.diagnosis.score_test.scan.DRAWS", 400)
    count = 20
    fit, noise = small.fit, Noise(rho)
    old = fit.density.oscillator
    rng, found = np.random.default_rng(4), []
    base = None
    for _ in range(count):
        recordings = tuple(
            replace(r, samples=m + noise.coloured(rng, m.size, r.interval, small_rig.NOISE))
            for r, m in zip(old.campaign.recordings, fit.predicted, strict=True)
        )
        campaign = replace(old.campaign, recordings=recordings)
        oscillator = Oscillator(campaign, (), old.layout, None)
        again = find_mode(
            PosteriorDensity(Likelihood(oscillator, noise), fit.density.priors), fit.mode
        )
        base = base or directions(again, EFFECTS[::3], campaign_scales(fit))
        found.append(score_directions(again, base, rng=rng).p_value)
    assert stats.kstest(found, "uniform").pvalue > 1e-3
    assert np.sum(np.array(found) < 0.05) <= stats.binom.ppf(1 - 1e-4, count, 0.05)


def test_scan_pays_for_the_frequencies_as_well(small):
    fit, scales = small.fit, campaign_scales(small.fit)
    effects = [BY_ID["coulomb_friction"], BY_ID["sensor_hum"]]
    found = scan(fit, effects, scales, rng=np.random.default_rng(0))
    alone = score_directions(fit, directions(fit, effects, scales), rng=np.random.default_rng(0))
    (hum,) = periodic_scores(fit, effects, scales)
    assert found.p_value == pytest.approx(min(1.0, 2 * min(alone.p_value, hum.p_value)))
    assert [s.effect.id for s in found.scores] == ["coulomb_friction", "sensor_hum"]


def test_a_plain_rig_cannot_tell_a_hum_from_a_force():
    """Where all is linear, steady forcing and a hum of the same frequency read alike: both count.

    Initial conditions absorb how the forced motion began.
    """
    rig, releases = small_rig.PLAIN, small_rig.PLAIN_RELEASES
    campaign = small_rig.record(rig=rig, releases=releases)
    frequency = 2.4 * np.sqrt(rig.k1 / rig.mass) / (2 * np.pi)
    hummed = tuple(
        replace(x, samples=x.samples + 3e-6 * np.sin(2 * np.pi * frequency * x.times))
        for x in campaign.recordings
    )
    campaign = replace(campaign, recordings=hummed)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    effects = [BY_ID["harmonic_forcing"], BY_ID["sensor_hum"]]
    force, hum = periodic_scores(fit, effects, campaign_scales(fit))
    for score in (force, hum):
        found = score.shapes[f"{score.effect.id}.frequency"]
        assert found == pytest.approx(frequency, abs=0.5 / campaign_scales(fit).duration)
    assert hum.gain > 100 and force.gain > 0.8 * hum.gain


def test_an_empty_catalogue_finds_nothing(small):
    scales = campaign_scales(small.fit)
    found = scan(small.fit, [], scales, rng=np.random.default_rng(0))
    assert found.p_value == 1.0 and found.best() == ()


def scan_of(information: np.ndarray, score: np.ndarray, kinds: list[Direction]) -> Scan:
    """A scan of single sizes from its joint law."""
    p = projection(information, score)
    groups = tuple(np.array([i]) for i in range(len(kinds)))
    fit = SimpleNamespace(sd=np.ones(1), mode=np.zeros(1))
    from bayesimpact.diagnosis.score_test.scan import _score

    scores = tuple(_score(fit, p, k, g, _Test(p, g, k)) for k, g in zip(kinds, groups, strict=True))
    return Scan(scores, 0.5, p, groups, tuple(kinds))


def ids(pairs) -> list[frozenset[str]]:
    return [frozenset(s.effect.id for s in pair.scores) for pair in pairs]


def test_the_best_score_of_every_effect():
    kinds = [record(e, 1) for e in ("spring_cubic", "spring_cubic", "gap_wear", "spring_cubic")]
    found = scan_of(np.eye(4), np.array([1.0, -4.0, 2.0, 3.0]), kinds).best()
    assert [(s.effect.id, s.z) for s in found] == [("spring_cubic", -4.0), ("gap_wear", 2.0)]


def test_equal_values_per_case_are_no_contrast():
    """A damping per case whose cases cannot be told apart says nothing, not even noise."""
    kind = replace(record("contact_damping_per_case", 2), contrast=True)
    p = projection(np.ones((2, 2)), np.array([3.0, 3.0]))
    test = _Test(p, np.arange(2), kind)
    assert test.rank == 0
    np.testing.assert_array_equal(test.p_values(np.array([[3.0, 3.0], [9.0, 9.0]])), 1.0)


def test_an_effect_starts_from_its_best_shapes():
    """Other effects and shapes that promise less than half as much are no starting points."""
    kinds = [record(e, 1) for e in ("spring_cubic", "spring_cubic", "gap_wear", "spring_cubic")]
    found = scan_of(np.eye(4), np.array([3.5, -4.0, 5.0, 2.5]), kinds)
    best = next(s for s in found.best() if s.effect.id == "spring_cubic")
    assert [s.z for s in found.starts(best, 1)] == [-4.0]
    assert [s.z for s in found.starts(best, 2)] == [-4.0, 3.5]
    assert [s.z for s in found.starts(best, 4)] == [-4.0, 3.5]


def test_pairs_are_ranked_by_their_joint_gain():
    rng = np.random.default_rng(5)
    names = ("spring_cubic", "spring_quadratic", "stiffness_drift", "sensor_drift")
    kinds = [record(e, 1) for e in names]
    information = random_information(rng, 4)
    score = information @ (np.array([0.0, 9.0, 0.0, 7.0]) / np.sqrt(np.diag(information)))
    found = promising_pairs(scan_of(information, score, kinds), count=6)
    assert ids(found)[0] == {"spring_quadratic", "sensor_drift"}
    for pair in found:
        i, j = (names.index(s.effect.id) for s in pair.scores)
        b, s = score[[i, j]], information[np.ix_([i, j], [i, j])]
        assert pair.gain == pytest.approx(0.5 * b @ np.linalg.solve(s, b))
    assert [p.gain for p in found] == sorted((p.gain for p in found), reverse=True)
    assert len(promising_pairs(scan_of(information, score, kinds), count=1)) == 1


def test_pairs_respect_signs_slots_and_need_each_other():
    friction, drag = record("coulomb_friction", 1, True), record("quadratic_drag", 1, True)
    cubic = record("spring_cubic", 1)
    both = np.array([[1.0, -0.9], [-0.9, 1.0]])
    # sizes 20 and 20: near-opposites that hide each other
    assert ids(promising_pairs(scan_of(both, both @ [20.0, 20.0], [friction, drag]), count=3))
    # a negative friction is no physics, a negative cubic spring is
    wrong = both @ [20.0, -20.0]
    assert not promising_pairs(scan_of(both, wrong, [drag, friction]), count=3)
    assert promising_pairs(scan_of(both, wrong, [drag, cubic]), count=3)
    # one alone explains it
    assert not promising_pairs(scan_of(both, both @ [20.0, 0.0], [friction, drag]), count=3)
    # two effects that claim one slot
    wear = record("gap_wear", 1)
    twin = replace(wear, effect=replace(BY_ID["gap_wear"], id="other"))
    assert not promising_pairs(scan_of(both, both @ [20.0, 20.0], [wear, twin]), count=3)


def test_scores_are_records():
    found = scan_of(np.eye(1), np.array([2.0]), [record("spring_cubic", 1)]).scores[0]
    assert isinstance(found, Score) and found.p_value == pytest.approx(2 * stats.norm.sf(2.0))


ONE = replace(small_rig.RIG, k2={"1": small_rig.RIG.k2["1"]})
NOT_TOUCHED = (replace(small_rig.RELEASES[0], y0=-0.8e-3, v0=0.0),)


@pytest.mark.parametrize(
    "settings",
    [
        {"rig": ONE, "releases": small_rig.RELEASES[:1]},
        {"rig": ONE, "releases": NOT_TOUCHED},
        {"rig": small_rig.PLAIN, "releases": small_rig.PLAIN_RELEASES},
    ],
    ids=["one recording", "stop never touched", "no stop"],
)
def test_the_whole_catalogue_on_campaigns_that_cannot_show_all_of_it(settings):
    campaign = small_rig.record(7, duration=1.0, **settings)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    found = scan(fit, EFFECTS, scales, rng=np.random.default_rng(0))
    assert 1e-3 < found.p_value <= 1.0
    assert all(np.isfinite([s.z, s.p_value, s.gain]).all() for s in found.scores)
    scored = {s.effect.id for s in found.scores}
    assert "coulomb_friction" in scored
    assert not scored & {"contact_damping_per_case", "gap_per_recording"}
    stop = fit.density.oscillator.campaign.stop
    assert stop or not any(BY_ID[i].needs_stop for i in scored)
