"""The posterior-predictive check of the backbone: calibrated under the truth, alert otherwise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from rigs import PAPER, paper_motion
from scipy.stats import kstest

from bayesimpact.errors import InputError
from bayesimpact.response.backbone import Backbone, backbone
from bayesimpact.response.check import CURVES, check_backbone, compare

INTERVAL, N, NOISE = 4e-3, 450, 2e-5


def recorded(seed: int, **changed: float) -> NDArray[np.float64]:
    noise = NOISE * np.random.default_rng(seed).standard_normal(N)
    return paper_motion(N, INTERVAL, **changed) + noise


def extracted(samples: NDArray[np.float64]) -> Backbone:
    return backbone(samples, INTERVAL, noise=NOISE, damping="local")


@pytest.fixture(scope="module")
def pool() -> list[Backbone]:
    """Backbones of recordings that differ by their noise only."""
    return [extracted(recorded(seed)) for seed in range(360)]


@pytest.mark.long
def test_calibrated_under_the_truth(pool: list[Backbone]) -> None:
    """Every recording in turn against 60 others: p uniform, 90 % of the points in the band."""
    rng = np.random.default_rng(1)
    checks = []
    for own in range(0, 360, 2):
        others = rng.choice(np.delete(np.arange(360), own), 60, replace=False)
        checks.append(compare(pool[own], [pool[i] for i in others]))
    # 60 draws make steps of 1/61; the pool is shared, so the p-values are not quite independent.
    assert kstest([c.p_value for c in checks], "uniform").statistic < 0.12
    for name in CURVES:
        assert kstest([c.bands[name].p_value for c in checks], "uniform").statistic < 0.13
    assert np.mean([c.inside for c in checks]) == pytest.approx(0.9, abs=0.015)


@pytest.mark.long
def test_through_the_front_door(pool: list[Backbone]) -> None:
    draws = np.array([recorded(1000 + i) for i in range(40)])
    check = check_backbone(recorded(0), draws, INTERVAL, noise=NOISE)
    assert check.draws == 40
    assert set(check.bands) == set(CURVES)
    band = check.bands["upper frequency"]
    assert band.recorded == pytest.approx(pool[0].upper.frequency[: band.at.size], rel=1e-12)
    assert np.all(band.low <= band.median) & np.all(band.median <= band.high)
    assert np.all(np.diff(band.at) == 1)
    assert 0.02 < check.p_value <= 1
    assert check.inside > 0.7


@pytest.mark.long
@pytest.mark.parametrize(
    ("changed", "curve"),
    [
        ({"k2": 1.1 * PAPER["k2"]}, "upper frequency"),
        ({"k1": 1.03 * PAPER["k1"]}, "lower frequency"),
        ({"g": 1.15 * PAPER["g"]}, "upper amplitude"),
        ({"c2": 1.2 * PAPER["c2"]}, "lower amplitude"),
    ],
)
def test_a_wrong_parameter_shows(
    pool: list[Backbone], changed: dict[str, float], curve: str
) -> None:
    check = compare(extracted(recorded(7, **changed)), pool[:100])
    assert check.p_value < 0.05
    assert check.bands[curve].p_value < 0.02
    assert check.bands[curve].inside < 0.7


@pytest.mark.long
def test_the_extractors_bias_cancels(pool: list[Backbone]) -> None:
    """A rest position 0.1 mm off bends every curve alike: the check does not mind."""
    draws = np.array([recorded(2000 + i) for i in range(30)])
    biased = check_backbone(recorded(3), draws, INTERVAL, rest=1e-4, noise=NOISE)
    lower = biased.bands["lower frequency"]
    free = np.sqrt(PAPER["k1"] / PAPER["mass"]) / (2 * np.pi)
    assert abs(lower.recorded[-1] / free - 1) > 0.01
    assert biased.inside > 0.75
    assert biased.p_value > 0.03


@pytest.mark.long
def test_draws_that_end_early_are_left_out(pool: list[Backbone]) -> None:
    short = extracted(recorded(5)[:100])
    check = compare(pool[0], [*pool[1:60], short])
    assert check.draws == 59
    assert check.bands["upper frequency"].at.size > 8


def test_without_a_half_cycle_there_is_no_verdict() -> None:
    flat = NOISE * np.random.default_rng(0).standard_normal((20, 200))
    check = check_backbone(flat[0], flat[1:], INTERVAL, noise=NOISE)
    assert np.isnan(check.p_value)
    assert np.isnan(check.inside)
    assert check.bands["upper frequency"].at.size == 0


@pytest.mark.parametrize("shape", [(5, N), (30, N - 1), (N,)])
def test_bad_shapes_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="draws"):
        check_backbone(np.zeros(N), np.zeros(shape), INTERVAL)
