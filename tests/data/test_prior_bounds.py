"""Priors at the door: each kind is measured by its own quantiles, no plausible one is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from small_rig import record, true_values

from bayesimpact.data.prior_bounds import (
    FINEST,
    TAIL,
    _reach,
    check_prior,
    parameter_ranges,
)
from bayesimpact.data.schema import _TAGGED
from bayesimpact.errors import InputError

TABLES = {
    "uniform": ({"lower": 2.0, "upper": 5.0}, stats.uniform(2.0, 3.0)),
    "normal": ({"mean": 3.0, "sd": 2.0}, stats.norm(3.0, 2.0)),
    "halfnormal": ({"scale": 2.0}, stats.halfnorm(scale=2.0)),
    "cauchy": ({"median": 3.0, "scale": 2.0}, stats.cauchy(3.0, 2.0)),
    "halfcauchy": ({"scale": 2.0}, stats.halfcauchy(scale=2.0)),
    "lognormal": ({"median": 3.0, "sigma": 0.5}, stats.lognorm(0.5, scale=3.0)),
    "loguniform": ({"lower": 2.0, "upper": 5.0}, stats.loguniform(2.0, 5.0)),
}
RIG = record(seed=3, duration=1.0)
RANGES = parameter_ranges(RIG.mass, RIG.recordings)


def test_every_kind_of_the_schema_is_known() -> None:
    assert set(_TAGGED["distribution"]) <= set(TABLES)


@pytest.mark.parametrize("kind", TABLES)
def test_the_tails_outside_hold_their_probability(kind: str) -> None:
    table, density = TABLES[kind]
    low, high = _reach({"distribution": kind, **table})
    outside = density.cdf(low) + density.sf(high)
    ends = kind in ("uniform", "loguniform")
    assert outside == pytest.approx(0.0 if ends else TAIL, rel=0.05, abs=1e-12)


def test_the_truth_of_a_rig_lies_well_inside() -> None:
    for name, value in true_values().items():
        low, high = RANGES[name.split("[")[0]]
        assert low == 0.0 or 0 < low < 1e-2 * value or low < -10 * abs(value), name
        assert high > 10 * abs(value), name


def test_ranges_follow_the_units_of_the_recordings() -> None:
    """Ten times the motion, a clock ten times slower: lengths and stiffness follow."""
    slower = [replace(r, samples=10 * r.samples, interval=10 * r.interval) for r in RIG.recordings]
    ranges = parameter_ranges(RIG.mass, slower)
    factors = {"k1": 1e-2, "c1": 0.1, "k2": 1e-2, "c2": 0.1, "v0": 1.0, "gain": 1.0}
    for name, ends in RANGES.items():
        expected = np.array(ends) * factors.get(name, 10.0)
        np.testing.assert_allclose(ranges[name], expected, rtol=1e-9)


@pytest.mark.parametrize("width", [0.9, 1.1])
def test_the_least_width(width: float) -> None:
    prior = {"distribution": "normal", "mean": -800.0, "sd": width * FINEST * 800.0}
    if width > 1.0:
        check_prior("here", "an_effect.size", prior, RANGES)
        return
    with pytest.raises(InputError, match=r"here, key sd: found a width of 7\.2e-10"):
        check_prior("here", "an_effect.size", prior, RANGES)
