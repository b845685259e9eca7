"""Directions and scores against full refits and dense algebra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Smoothing
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer
from bayesimpact.diagnosis.score_test.directions import directions, sigma_of
from bayesimpact.diagnosis.score_test.projection import project
from bayesimpact.diagnosis.score_test.scan import score_directions
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.prior import Normal
from bayesimpact.inference.priors import Priors
from bayesimpact.model.measurement import smooth
from bayesimpact.model.oscillator import Oscillator

SAVGOL = Smoothing("savgol", window=15, polyorder=2)
EFFECTS = (
    "coulomb_friction", "quadratic_drag", "spring_quadratic", "contact_damping_speed",
    "contact_power_law", "gap_wear", "sensor_quadratic", "stiffness_drift",
)  # fmt: skip


def refitted(fit: Fit, readings: list[np.ndarray], noise: Noise | None = None) -> Fit:
    """The fit's model fitted to other readings of the same recordings."""
    old = fit.density.oscillator
    recordings = tuple(
        replace(r, samples=x) for r, x in zip(old.campaign.recordings, readings, strict=True)
    )
    noise = noise or fit.density.likelihood.noise
    campaign = replace(old.campaign, recordings=recordings)
    oscillator = Oscillator(campaign, old.effects, old.layout, noise.smoothing)
    density = PosteriorDensity(Likelihood(oscillator, noise), fit.density.priors)
    return find_mode(density, fit.mode, tolerance=1e-5)


def with_effect(fit: Fit, effect_id: str, size: float) -> list[np.ndarray]:
    """What the probe would read, without noise, with an effect of that size added to the fit."""
    scales, effects = campaign_scales(fit), (BY_ID[effect_id],)
    density = extend(fit, effects, scales)
    theta = transfer(fit, density.oscillator.layout, effects, scales, {})
    at = [i for i, n in enumerate(density.oscillator.layout.names) if n.startswith(effect_id)]
    theta[at] += size
    return list(density.oscillator.predict(theta))


def direction_of(fit: Fit, effect_id: str):
    (found,) = directions(fit, [BY_ID[effect_id]], campaign_scales(fit))
    return found


@pytest.fixture(scope="module", params=["white", "ar1", "smoothed"])
def fit(request, small) -> Fit:
    """The small rig's fit under three kinds of noise."""
    noise = {"white": Noise(), "ar1": Noise(0.6), "smoothed": Noise(smoothing=SAVGOL)}[
        request.param
    ]
    rng = np.random.default_rng(0)
    readings = []
    for mean in small.fit.density.oscillator.predict(small.fit.mode):
        raw = mean + noise.coloured(rng, mean.size, 1e-3, small_rig.NOISE)
        readings.append(smooth(raw, noise.smoothing, 1e-3))
    return refitted(small.fit, readings, noise)


@pytest.mark.parametrize("effect_id", EFFECTS)
def test_a_small_effect_scores_as_a_refit_says(fit, effect_id):
    """Plant two standard errors of an effect: score, size and bias are those of brute force.

    With the noise kept, everything changes linearly: the refit's residual norm falls short of the
    ignored effect by z^2 / 2, and its parameters move by the predicted bias.
    """
    direction = direction_of(fit, effect_id)
    before = project(fit, direction.parts)
    sd = 1 / np.sqrt(before.information[0, 0])
    size = 2 * sd
    clean, moved = with_effect(fit, effect_id, 0.0), with_effect(fit, effect_id, size)
    samples = [r.samples for r in fit.density.oscillator.campaign.recordings]
    planted = [x + b - a for x, a, b in zip(samples, clean, moved, strict=True)]
    ignored = refitted(fit, planted)
    sigma = fit.value("sigma")
    # bias: what the refit without the effect did to the parameters
    shift = (ignored.mode - fit.mode)[:-1] / fit.sd[:-1]
    expected = (before.absorbed[:, 0] * size)[:-1] / fit.sd[:-1]
    np.testing.assert_allclose(shift, expected, atol=0.02 + 0.02 * np.abs(expected).max())
    # expected size: recovered by the scores of the biased fit
    after = project(ignored, direction_of(ignored, effect_id).parts)
    scale = ignored.value("sigma") / sigma  # its noise level has swallowed some of the effect
    found = (after.score[0] - before.score[0] / scale) / after.information[0, 0]
    assert found == pytest.approx(size, rel=0.03)
    # score: by how much the residual's energy grew, against z^2 and the cross term with the noise
    growth = (ignored.sums.sum() - fit.sums.sum()) / sigma**2
    assert growth == pytest.approx(4.0 + 4.0 * before.score[0] * sd, rel=0.03, abs=0.03)


def dense(fit: Fit, parts: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    """Score, information and absorbed from one big whitened matrix, priors as further rows."""
    size = fit.mode.size
    rows, right, planted = [], [], []
    for lin, s, part in zip(fit.linearisation, sigma_of(fit), parts, strict=True):
        block = np.zeros((lin.residual.size, size))
        block[:, lin.columns] = lin.jacobian / s
        rows.append(block)
        right.append(lin.residual / s)
        planted.append(part)
    prior = np.maximum(-fit.density.priors.hessian(fit.mode), 0.0)
    prior[fit.density.oscillator.layout.roles("noise")] = 1.0  # no data: any value does
    rows.append(np.diag(np.sqrt(prior)))
    right.append(np.zeros(size))
    planted.append(np.zeros((size, planted[0].shape[1])))
    jacobian, residual, columns = np.vstack(rows), np.concatenate(right), np.vstack(planted)
    scale = np.linalg.norm(jacobian, axis=0)
    q, r = np.linalg.qr(jacobian / scale)
    left = columns - q @ (q.T @ columns)
    absorbed = np.linalg.solve(r, q.T @ columns) / scale[:, None]
    return left.T @ residual, left.T @ left, absorbed


def test_projection_is_the_dense_one(fit):
    found = directions(fit, [BY_ID[e] for e in EFFECTS], campaign_scales(fit))
    parts = tuple(np.concatenate([d.parts[r] for d in found], axis=1) for r in range(3))
    projection = project(fit, parts)
    score, information, absorbed = dense(fit, parts)
    sd = 1 / np.sqrt(np.diag(information))
    np.testing.assert_allclose(projection.score * sd, score * sd, atol=1e-6)
    np.testing.assert_allclose(
        projection.information * np.outer(sd, sd), information * np.outer(sd, sd), atol=1e-6
    )
    moves = absorbed * sd / fit.sd[:, None]
    np.testing.assert_allclose(
        projection.absorbed * sd / fit.sd[:, None], moves, atol=1e-6 * np.abs(moves).max()
    )
    norms = np.sqrt(sum(np.sum(p**2, axis=0) for p in parts))
    np.testing.assert_allclose(projection.kept, 1 / (sd * norms), rtol=1e-6)
    some = projection.subset([4, 1])
    np.testing.assert_array_equal(some.score, projection.score[[4, 1]])
    assert some.information[0, 1] == projection.information[4, 1]


def test_priors_that_matter_are_carried_along(small):
    """A narrow prior on c1 keeps it from absorbing friction: less is hidden, the score is exact."""
    old, names = small.fit, small.fit.names
    narrow = list(old.density.priors.parameters)
    width = old.sd[names.index("c1")]
    narrow[names.index("c1")] = Normal(old.value("c1") + 4 * width, width)
    density = PosteriorDensity(old.density.likelihood, Priors(tuple(narrow)))
    fit = find_mode(density, old.mode, tolerance=1e-6)
    parts = direction_of(fit, "coulomb_friction").parts
    projection = project(fit, parts)
    assert projection.kept[0] > project(old, direction_of(old, "coulomb_friction").parts).kept[0]
    # the gradient of the log posterior by the size, everything else being at its mode
    gradient = sum(
        float(p[:, 0] @ lin.residual) / s
        for p, lin, s in zip(parts, fit.linearisation, sigma_of(fit), strict=True)
    )
    sd = 1 / np.sqrt(projection.information[0, 0])
    assert projection.score[0] * sd == pytest.approx(gradient * sd, abs=0.01)


def test_a_direction_that_the_model_contains_leaves_nothing(small):
    """The derivative by k1 itself: absorbed whole, and no score."""
    fit = small.fit
    k1 = fit.names.index("k1")
    parts = tuple(
        (lin.jacobian / s)[:, [list(lin.columns).index(k1)]]
        for lin, s in zip(fit.linearisation, sigma_of(fit), strict=True)
    )
    projection = project(fit, parts)
    assert projection.kept[0] < 1e-6
    expected = np.eye(fit.mode.size)[k1]
    np.testing.assert_allclose(projection.absorbed[:, 0] * fit.sd[k1] / fit.sd, expected, atol=1e-6)


def test_one_sided_and_two_sided_directions(small):
    fit, scales = small.fit, campaign_scales(small.fit)
    kinds = {d.effect.id: d for d in directions(fit, [BY_ID[e] for e in EFFECTS], scales)}
    assert kinds["coulomb_friction"].one_sided and not kinds["spring_quadratic"].one_sided
    per_case = direction_of(fit, "contact_damping_per_case")
    assert per_case.contrast and not per_case.one_sided and len(per_case.names) == 2
    no_tension = direction_of(fit, "contact_no_tension")
    assert no_tension.names == ("contact_no_tension",) and no_tension.one_sided
    stages = directions(fit, [BY_ID["contact_second_stage"]], scales)
    depths = [d.shapes["contact_second_stage.depth"] for d in stages]
    assert len(depths) > 2 and len(set(depths)) == len(depths)


def test_what_is_in_the_model_or_cannot_be_is_not_scored(small):
    fit, scales = small.fit, campaign_scales(small.fit)
    extended = extend(fit, (BY_ID["coulomb_friction"],), scales)
    start = transfer(fit, extended.oscillator.layout, (BY_ID["coulomb_friction"],), scales, {})
    steps = 0.05 * np.append(fit.sd, 1e-6)
    with_friction = find_mode(extended, start, steps=steps, max_iterations=2)
    ids = {d.effect.id for d in directions(with_friction, BY_ID.values(), scales)}
    assert "coulomb_friction" not in ids and "quadratic_drag" in ids
    assert not ids & {"harmonic_forcing", "sensor_hum"}  # these are scanned over frequencies
    one_case = replace(scales, cases=1, recordings=1)
    ids = {d.effect.id for d in directions(fit, BY_ID.values(), one_case)}
    assert not ids & {"contact_damping_per_case", "gap_per_recording"}
    ids = {d.effect.id for d in directions(fit, BY_ID.values(), replace(scales, impacts=0))}
    assert ids and not any(BY_ID[i].needs_stop for i in ids)


def test_scores_are_made_of_the_projection(small):
    fit, scales = small.fit, campaign_scales(small.fit)
    found = directions(fit, [BY_ID[e] for e in EFFECTS], scales)
    result = score_directions(fit, found, rng=np.random.default_rng(0))
    p = result.projection
    for i, score in enumerate(result.scores):
        sd = 1 / np.sqrt(p.information[i, i])
        assert score.z == pytest.approx(p.score[i] * sd)
        assert score.size[0] == pytest.approx(p.score[i] * sd**2)
        assert score.size_sd[0] == pytest.approx(sd) and score.limit == pytest.approx(5 * sd)
        np.testing.assert_allclose(score.bias, p.absorbed[:, i] * score.size[0] / fit.sd)
        allowed = score.z > 0 or not result.found[i].one_sided
        assert score.gain == pytest.approx(0.5 * score.z**2 * allowed)
