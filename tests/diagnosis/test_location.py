"""Places: made-up forces and gains put where the location has to find them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID, with_effect

from bayesimpact.diagnosis.location import (
    INSIDE,
    TIME_BINS,
    _shortest,
    gain_by_time,
    locate,
    regime_seen,
)
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_force, trajectory_points

KNOTS = 40
GAP = small_rig.RIG.g


@pytest.fixture(scope="module")
def force(small):
    """A missing force whose coefficients the tests set."""
    return missing_force(
        small.fit, campaign_scales(small.fit), rng=np.random.default_rng(0), knots=KNOTS
    )


def made(force, conservative=None, dissipative=None):
    """a(y) and b(y) by their values at the knots."""
    places = force.low + force.spacing * np.arange(-1, KNOTS - 1)
    nothing = np.zeros(KNOTS)
    a = nothing if conservative is None else np.vectorize(conservative)(places)
    b = nothing if dissipative is None else np.vectorize(dissipative)(places)
    mean = np.concatenate([a, b])
    free = replace(force.projection, score=mean)  # every coefficient measured by itself
    return replace(force, mean=mean, covariance=np.eye(2 * KNOTS), projection=free)


def improved(fit, recording: int, first: float, last: float):
    """The fit with smaller residuals in a part of one recording."""
    parts = list(fit.linearisation)
    residual = parts[recording].residual.copy()
    n = residual.size
    residual[int(first * n) : int(last * n)] *= 0.5
    parts[recording] = replace(parts[recording], residual=residual)
    return replace(fit, linearisation=tuple(parts))


def brute_force_shortest(x: np.ndarray, w: np.ndarray) -> float:
    order = np.argsort(x)
    x, w = x[order], w[order] / w.sum()
    lengths = [
        x[j] - x[i]
        for i in range(x.size)
        for j in range(i, x.size)
        if w[i : j + 1].sum() >= INSIDE - 1e-12
    ]
    return min(lengths)


@pytest.mark.parametrize("seed", range(5))
def test_the_range_is_the_shortest_that_holds_its_share(seed):
    rng = np.random.default_rng(seed)
    x, w = rng.standard_normal(60), rng.exponential(size=60) ** 2
    low, high = _shortest(x, w)
    assert w[(x >= low) & (x <= high)].sum() >= (INSIDE - 1e-9) * w.sum()
    gaps = np.diff(np.sort(x))  # one sample more than needed, at most
    assert high - low <= brute_force_shortest(x, w) + gaps.max()


def test_a_force_is_known_as_well_as_where_it_acts(small, force):
    step = made(force, lambda y: 0.03 * (y > GAP + 4e-4))
    found = locate(small.fit, small.fit, step, ())
    y, v = (np.concatenate(c) for c in zip(*trajectory_points(small.fit), strict=True))
    low, high = found.displacement
    slow, fast = found.velocity
    held = (y >= max(low, GAP)) & (y <= high) & (v >= slow) & (v <= fast)
    expected = np.sqrt(np.mean(step.deviation(y, v, y)[held] ** 2))
    assert found.force_sd == pytest.approx(expected, rel=1e-9)


def test_a_force_in_contact(small, force):
    found = locate(small.fit, small.fit, made(force, lambda y: 0.03 * (y > GAP + 4e-4)), ())
    assert found.regime == "contact" and found.contact_share > 0.95 and found.agrees
    assert found.share > 0.7
    low, high = found.displacement
    assert GAP < low < GAP + 6e-4
    deepest = max(p[0].max() for p in trajectory_points(small.fit))
    assert 0.85 * deepest < high <= deepest
    assert 0.02 < found.force_rms < 0.035


def test_a_force_of_the_suspension_at_one_place(small, force):
    detent = made(force, lambda y: 0.02 * np.exp(-0.5 * ((y + 3e-3) / 3e-4) ** 2))
    found = locate(small.fit, small.fit, detent, ())
    assert found.regime == "free" and found.contact_share < 0.01
    low, high = found.displacement
    assert -4e-3 < low < -3.3e-3 and -2.7e-3 < high < -2e-3
    assert found.velocity[0] < -0.1 and found.velocity[1] > 0.1  # passed in both directions
    assert 0.005 < found.force_rms < 0.02


def test_a_damping_shows_at_speed(small, force):
    found = locate(small.fit, small.fit, made(force, None, lambda y: 0.1), ())
    assert found.regime == "free" and found.share > 0.6
    assert min(-found.velocity[0], found.velocity[1]) > 0.15
    points = trajectory_points(small.fit)
    total = sum(np.sum((0.1 * v) ** 2) for _, v in points)
    beyond = sum(np.sum((0.1 * v[y >= GAP]) ** 2) for y, v in points)
    assert found.contact_share == pytest.approx(beyond / total, abs=0.01)


def test_a_force_everywhere(small, force):
    found = locate(small.fit, small.fit, made(force, lambda y: 0.02 if y > GAP else 0.012), ())
    assert found.regime == "everywhere" and 0.25 < found.contact_share < 0.75
    assert regime_seen(0.9) == "contact" and regime_seen(0.1) == "free"


def test_the_named_effects_regime_counts_and_disagreement_shows(small, force):
    contact = made(force, lambda y: 0.03 * (y > GAP + 4e-4))
    found = locate(small.fit, small.fit, contact, (BY_ID["contact_damping_per_case"],))
    assert found.regime == "contact" and found.agrees
    found = locate(small.fit, small.fit, contact, (BY_ID["coulomb_friction"],))
    assert found.regime == "free" and not found.agrees
    found = locate(small.fit, small.fit, contact, (BY_ID["contact_no_tension"],))
    assert found.regime == "exit" and found.agrees and found.displacement[0] >= GAP


def test_recordings_obstacles_and_times_come_from_the_gain(small, force):
    better = improved(small.fit, 2, 0.25, 0.5)
    found = locate(small.fit, better, made(force, lambda y: 0.01), ())
    assert found.recordings == ("c",) and found.cases == ("2",)
    longest = 1.999
    assert found.time[0] == pytest.approx(0.25 * longest, abs=longest / TIME_BINS)
    assert found.time[1] == pytest.approx(0.5 * longest, abs=longest / TIME_BINS)
    both = replace(
        better,
        linearisation=(
            improved(small.fit, 0, 0.0, 0.4).linearisation[0],
            *better.linearisation[1:],
        ),
    )
    found = locate(small.fit, both, made(force, lambda y: 0.01), ())
    assert found.recordings == ("a", "c") and found.cases == ("1", "2")


def test_gain_adds_up_to_the_difference_of_the_likelihoods(small):
    better = improved(small.fit, 1, 0.1, 0.9)
    gain = gain_by_time(small.fit, better)
    assert gain.shape == (3, TIME_BINS)
    old, new = small.fit.linearisation[1].residual, better.linearisation[1].residual
    sigma = small.fit.value("sigma")
    assert gain[1].sum() == pytest.approx((old @ old - new @ new) / (2 * sigma**2))
    assert not gain[[0, 2]].any()
    assert gain[1, 0] == 0.0 and gain[1, 12] > 0.0


def test_a_mismatch_of_the_chain_has_no_force(small, force):
    better = improved(small.fit, 0, 0.0, 0.5)
    found = locate(small.fit, better, made(force, lambda y: 0.01), (BY_ID["sensor_cubic"],))
    assert found.regime == "measurement" and found.force_rms == 0.0
    assert found.share == pytest.approx(1.0) and found.agrees  # all bins gain


def test_an_effect_lies_where_its_own_force_acts(small, force):
    """Hardening k3 d^3: nine tenths of its square lie in the deepest quarter of the contact."""
    fit = with_effect(small, "contact_hardening", stiffness=1e8)
    elsewhere = made(force, lambda y: 0.02 * (y < -2e-3))  # what is missing says nothing here
    found = locate(small.fit, fit, elsewhere, (BY_ID["contact_hardening"],))
    deepest = max(p[0].max() for p in trajectory_points(small.fit))
    assert found.regime == "contact" and found.contact_share == 1.0
    assert GAP + 0.4 * (deepest - GAP) < found.displacement[0] < found.displacement[1] <= deepest
    peak = 1e8 * (deepest - GAP) ** 3
    assert 0.2 * peak < found.force_rms < peak
