"""Expected ln odds against those of data drawn from the models, densities by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bayesimpact.design.odds import PredictedRecording, expected_odds

Array = np.ndarray
N, SHARED, OWN = 30, 3, 2


def prediction(rng: np.random.Generator, scale: float, base: Array) -> PredictedRecording:
    """A linear model: a few shared parameters, and broad start values of the recording's own."""
    shared = scale * rng.standard_normal((N, SHARED))
    own = 40.0 * (base + 0.01 * rng.standard_normal((N, OWN)))
    return PredictedRecording(rng.standard_normal(N), np.hstack([shared, own]), SHARED)


def models(seed: int) -> tuple[PredictedRecording, PredictedRecording]:
    rng = np.random.default_rng(seed)
    base = rng.standard_normal((N, OWN))
    return prediction(rng, 0.4, base), prediction(rng, 0.8, base)


def log_odds(data: Array, right: PredictedRecording, other: PredictedRecording) -> Array:
    """ln odds of data (S, n) by the densities themselves."""
    one, two = (
        multivariate_normal(m.mean, np.eye(N) + m.factor @ m.factor.T).logpdf(data)
        for m in (right, other)
    )
    return np.asarray(one - two)


def drawn(model: PredictedRecording, draws: Array, rng: np.random.Generator) -> Array:
    """Recordings (S, n) that start as intended, parameters from `draws`."""
    noise = rng.standard_normal((draws.shape[0], N))
    return np.asarray(model.mean + draws @ model.common.T + noise)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_mean_is_that_of_simulated_recordings(seed: int) -> None:
    right, other = models(seed)
    rng = np.random.default_rng(seed + 100)
    draws = rng.standard_normal((20_000, SHARED))
    obtained = log_odds(drawn(right, draws, rng), right, other)
    expected = expected_odds(right, other, draws[:1]).mean
    assert abs(obtained.mean() - expected) < 4 * obtained.std() / np.sqrt(obtained.size)


def test_each_draw_has_its_own_mean_and_standard_deviation() -> None:
    right, other = models(4)
    rng = np.random.default_rng(104)
    draws = rng.standard_normal((5, SHARED))
    odds = expected_odds(right, other, draws)
    for draw, mean, sd in zip(draws, odds.means, odds.sds, strict=True):
        data = drawn(right, np.tile(draw, (20_000, 1)), rng)
        obtained = log_odds(data, right, other)
        assert abs(obtained.mean() - mean) < 4 * sd / np.sqrt(obtained.size)
        assert abs(obtained.std() / sd - 1) < 4 / np.sqrt(obtained.size)  # two over a normal's


def test_noise_alone_spreads_the_odds_of_models_that_agree() -> None:
    rng = np.random.default_rng(7)
    right, other = (
        PredictedRecording(np.zeros(N), 5 * rng.standard_normal((N, 4)), 0) for _ in range(2)
    )
    odds = expected_odds(right, other, np.empty((1, 0)))
    obtained = log_odds(rng.standard_normal((20_000, N)), right, other)
    assert abs(obtained.std() / odds.sds[0] - 1) < 4 / np.sqrt(obtained.size)
    assert abs(obtained.mean() - odds.mean) < 4 * odds.sds[0] / np.sqrt(obtained.size)


def test_what_parameters_imitate_tells_nothing_apart() -> None:
    """A difference along a column of nearly unknown size tells nothing; across it counts."""
    rng = np.random.default_rng(5)
    axes = np.linalg.qr(rng.standard_normal((N, 2)))[0]
    factor = 1e4 * axes[:, :1]
    right = PredictedRecording(np.zeros(N), factor, 0)
    draws = np.empty((1, 0))
    along = expected_odds(right, PredictedRecording(6.0 * axes[:, 0], factor, 0), draws)
    across = expected_odds(right, PredictedRecording(6.0 * axes[:, 1], factor, 0), draws)
    assert along.mean == pytest.approx(0.0, abs=1e-6)
    assert across.mean == pytest.approx(18.0) and across.sds[0] == pytest.approx(6.0)


def test_a_model_gains_nothing_over_itself() -> None:
    right, _ = models(6)
    odds = expected_odds(right, right, np.random.default_rng(0).standard_normal((4, SHARED)))
    assert odds.mean == pytest.approx(0.0, abs=1e-9)
    assert odds.means == pytest.approx(np.zeros(4), abs=1e-9)
