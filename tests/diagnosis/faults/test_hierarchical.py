"""Recordings that differ: by their errors, by physics that goes with amplitude, by one's fault."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.stats import multivariate_normal

from bayesimpact.diagnosis.faults.alone import Alone
from bayesimpact.diagnosis.faults.hierarchical import (
    FLAT,
    NOTHING,
    SCATTERS,
    TRENDS,
    Differences,
    Widths,
    standardised,
)
from bayesimpact.diagnosis.faults.together import weigh_all

ERROR = 1e-3  # of every logarithm
NINE = (3, 3, 3)  # recordings of three stops


def recordings(
    layout: Sequence[int],
    rng: np.random.Generator,
    *,
    slope: float = 0.0,
    bend: float = 0.0,
    scatter: float = 0.0,
    fault: float = 0.0,
) -> tuple[list[Alone], list[str]]:
    """Recordings whose parameters differ by so many errors; the first one's k1 by a `fault`."""
    slopes, bends = slope * rng.normal(size=5), bend * rng.normal(size=5)
    alone, cases = [], []
    for case, count in enumerate(layout):
        for i, x in enumerate(np.linspace(-1.0, 1.0, count)):
            log = slopes * x + bends * x**2 + np.hypot(1.0, scatter) * rng.normal(size=5)
            log[1] += fault if case == i == 0 else 0.0
            amplitude = float(np.exp(0.3 * x + 0.03 * rng.normal()))
            name = f"case{case}_{i}"
            alone.append(Alone(name, ERROR * log, ERROR**2 * np.eye(5), 1.0, amplitude))
            cases.append(str(case))
    return alone, cases


@pytest.mark.parametrize(("trend", "scatter"), [(0, 0), (2, 0), (1, 3), (3, 5)])
def test_evidence_against_the_dense_covariance(trend: int, scatter: int) -> None:
    """Generalised least squares with priors is a normal density of everything at once."""
    rng = np.random.default_rng(1)
    alone, cases = recordings((2, 2), rng, slope=5.0)
    spread = Differences(alone, cases, exact=False)
    direction = np.zeros((4, 5))
    direction[2] = (-1.0, -2.0, -1.0, 0.0, -2.0)
    at = Widths(np.full((1, 5), trend), np.full((1, 5), scatter))
    found = spread._values([(direction, 0.05)], 0.1, at)[0]

    x = standardised([a.amplitude for a in alone])
    shared = np.array([np.eye(5)[:, :4]] * 4).reshape(20, 4)
    stops = np.kron(np.array([[1, 0], [1, 0], [0, 1], [0, 1]]), np.eye(5)[:, 4:])
    width = max(TRENDS[trend], NOTHING) * ERROR
    covariance = (ERROR**2 + (SCATTERS[scatter] * ERROR) ** 2) * np.eye(20)
    for power in (x, x**2):
        covariance += width**2 * np.kron(np.outer(power, power), np.eye(5))
    covariance += (0.1 * 0.05) ** 2 * np.outer(direction, direction)
    flat = np.hstack([shared, stops])  # all but flat: what is orthogonal to it has a density
    beside = null_space(flat.T)
    log = beside.T @ np.concatenate([a.log for a in alone])
    density = multivariate_normal(np.zeros(log.size), beside.T @ covariance @ beside)
    expected = density.logpdf(log) + 0.5 * (20 * np.log(2 * np.pi))
    expected += 0.5 * flat.shape[1] * np.log(FLAT / (2 * np.pi))
    expected -= 0.5 * np.linalg.slogdet(flat.T @ flat)[1]
    assert found == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(
    "physics",
    [{"slope": 30.0}, {"slope": 30.0, "bend": 5.0}, {"scatter": 10.0}, {"slope": 30, "scatter": 3}],
)
def test_physics_of_the_amplitude_is_no_fault_of_a_recording(physics: dict[str, float]) -> None:
    """None in 420 such draws of 6 to 10 recordings, so one in 4 would mean more than 1 %."""
    rng = np.random.default_rng(2)
    for layout in ((3,), NINE):
        for _ in range(2):
            alone, cases = recordings(layout, rng, **physics)
            none, ranked, needed = weigh_all(alone, cases, True, len(cases) // 3)
            count = len(cases) * (6 + len(layout) - 1)
            assert ranked[0].log_evidence - none.log_evidence - np.log(count) < needed


def test_a_fault_stands_out_of_a_trend() -> None:
    """k1 of one of nine recordings 100 errors off, all others along their amplitudes by 30."""
    rng = np.random.default_rng(3)
    named = 0
    for _ in range(8):
        alone, cases = recordings(NINE, rng, slope=30.0, fault=100.0)
        none, ranked, needed = weigh_all(alone, cases, True, 3)
        best = ranked[0]
        odds = best.log_evidence - none.log_evidence - np.log(9 * 8)
        right = best.hypothesis.recording == 0 and best.hypothesis.what == "k1"
        named += right and odds > needed
    assert named >= 4  # 0.8 of 40 draws; three or fewer of eight happen once in 100 times


def test_a_scale_of_amplitudes_that_do_not_differ() -> None:
    assert not standardised([2.0, 2.0, 2.001]).any()
    x = standardised([1.0, 2.0, 4.0])
    np.testing.assert_allclose((x.mean(), x.std(), x[1]), (0.0, 1.0, 0.0), atol=1e-12)
