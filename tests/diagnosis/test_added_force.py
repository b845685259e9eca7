"""The force that effects of a model add, less what base parameters do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from effect_rigs import with_effect as at_mode

from bayesimpact.data.campaign import SECOND_STOP
from bayesimpact.data.input import Input
from bayesimpact.diagnosis import location
from bayesimpact.diagnosis.added_force import added_force
from bayesimpact.diagnosis.location import in_contact, locate
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_force, trajectory_points
from bayesimpact.inference.identify import identify


def with_effect(small, effect: str, **values: float):
    fit = at_mode(small, effect, **values)
    return replace(fit, covariance=1e-12 * np.eye(fit.mode.size))


def rms(forces) -> float:
    return float(np.sqrt(np.mean(np.concatenate(forces) ** 2)))


def naive_rest(fit, points, forces):
    """By one least-squares problem: k1, c1, c2, g, k2 of every case, a constant per recording."""
    recordings = fit.density.oscillator.campaign.recordings
    cases = list(fit.density.oscillator.campaign.cases)
    blocks = []
    for r, (y, v) in enumerate(points):
        d = y - fit.value("g")
        inside = d > 0
        own = [np.where(inside, d, 0.0) * (recordings[r].case == case) for case in cases]
        gap = np.where(inside, fit.value(f"k2[{recordings[r].case}]"), 0.0)
        constants = [np.full(y.size, float(i == r)) for i in range(len(points))]
        blocks.append(np.column_stack([y, v, inside * v, gap, *own, *constants]))
    columns, force = np.concatenate(blocks), np.concatenate(forces)
    columns = columns / np.linalg.norm(columns, axis=0)
    return force - columns @ np.linalg.lstsq(columns, force, rcond=None)[0]


def test_the_rest_is_what_no_base_parameter_does(small):
    fit = with_effect(small, "spring_cubic", stiffness=1e6)
    found = added_force(small.fit, fit)
    whole = [1e6 * y**3 for y, _ in found.points]
    expected = naive_rest(fit, found.points, whole)
    np.testing.assert_allclose(np.concatenate(found.forces), expected, atol=3e-4 * rms(whole))
    assert rms(found.forces) < 0.6 * rms(whole)  # k1 does most of it


@pytest.fixture(scope="module")
def between():
    """The small rig between two stops, both declared."""
    second = {"opposite_stop": {"stiffness": 4000.0, "gap": 1.5e-3}}
    campaign = replace(small_rig.record(3, second, duration=1.0), declared=(SECOND_STOP,))
    return identify(campaign, rng=np.random.default_rng(0), search=False)


def test_a_declared_stop_is_none_that_is_added(between):
    found = added_force(between.fit, with_effect(between, "spring_cubic", stiffness=0.0))
    assert rms(found.forces) < 1e-9 * between.fit.value("k1") * 6e-3


def test_the_second_of_two_stops_is_a_contact_too(between):
    """As what is missing tells it; a law of the catalogue acts at the first one."""
    points = trajectory_points(between.fit)
    gap, other = between.fit.value("g"), between.fit.value("opposite_stop.gap")
    both, first = (in_contact(between.fit, points, either=either) for either in (True, False))
    for (y, _), here, one in zip(points, both, first, strict=True):
        np.testing.assert_array_equal(here, (y >= gap) | (y < -other))
        np.testing.assert_array_equal(one, y >= gap)
        assert 0 < one.sum() < here.sum() < y.size


def test_what_is_no_force_of_a_given_path_is_told_by_the_motion(small):
    """A gap that grows: the obstacle lacks k2 times all steps so far, and is met later."""
    step = 2e-6
    fit = with_effect(small, "gap_wear", step=step)
    found = added_force(small.fit, fit)
    expected = []
    for r, (y, v) in enumerate(found.points):
        case = small.fit.density.oscillator.campaign.recordings[r].case
        k2, c2, g = (small.fit.value(name) for name in (f"k2[{case}]", "c2", "g"))
        met = np.concatenate([[0], np.cumsum((y[1:] > g) & (y[:-1] <= g))])
        late = np.maximum(met - 1, 0) * step  # in the i-th contact, and on the way out of it
        inside = y > g + late
        base, worn = k2 * (y - g) + c2 * v, k2 * (y - g - late) + c2 * v
        expected.append(np.where(y > g, np.where(inside, worn, 0.0) - base, 0.0))
    rest = naive_rest(small.fit, found.points, expected)
    off = np.abs(np.concatenate(found.forces) - rest)
    assert np.quantile(off, 0.99) < 1e-4 * rms(expected)  # but for a sample or two at the gap
    assert rms(found.forces) > 0.1 * rms(expected)


def test_what_another_body_or_the_probe_does_is_no_force_that_is_added(small):
    assert added_force(small.fit, small.fit) is None
    assert added_force(small.fit, with_effect(small, "sensor_drift", rate=1e-6)) is None
    mode = {"frequency": 90.0, "damping": 0.05, "gain": 0.1}
    assert added_force(small.fit, with_effect(small, "second_mode", **mode)) is None


def test_a_measured_force_is_none_that_is_added():
    rng = np.random.default_rng(3)
    force = Input(0.5 * np.convolve(rng.standard_normal(1500), np.ones(20) / 20, mode="same"))
    campaign = small_rig.record(4, duration=1.5)
    (recording, *_) = campaign.recordings
    driven = replace(recording, samples=recording.samples[:1500], input=force)
    campaign = replace(campaign, recordings=(driven,))
    found = identify(campaign, rng=np.random.default_rng(0), search=False)
    cubic = with_effect(found, "spring_cubic", stiffness=1e6)
    added = added_force(found.fit, cubic)
    whole = [1e6 * y**3 for y, _ in added.points]
    expected = naive_rest(found.fit, added.points, whole)
    np.testing.assert_allclose(np.concatenate(added.forces), expected, atol=1e-3 * rms(whole))


def test_about_a_large_misfit_a_place_is_where_the_better_model_adds_a_force(small, monkeypatch):
    """A force linearised there is arbitrary: here one at the other end of the motion."""
    scales = campaign_scales(small.fit)
    force = missing_force(small.fit, scales, rng=np.random.default_rng(0), knots=40)
    object.__setattr__(force, "mean", np.where(np.arange(80) < 5, 2.0, 0.0))
    fit = with_effect(small, "contact_hardening", stiffness=1e8)
    found = locate(small.fit, fit, force, ())
    assert found.regime == "free" and found.force_rms > 0.0 and not found.beyond_base
    monkeypatch.setattr(location, "is_large", lambda fit: True)
    found = locate(small.fit, fit, force, ())
    assert found.regime == "contact" and found.force_sd == 0.0 and found.beyond_base
    assert found.displacement[1] > small_rig.RIG.g
    own = locate(small.fit, fit, force, (BY_ID["contact_hardening"],))
    assert found.force_rms < own.force_rms  # k2 and c2 do a part
    worn = with_effect(small, "gap_wear", step=1e-6)  # no force of a path that is given
    assert locate(small.fit, worn, force, ()).regime == "contact"
    unseen = with_effect(small, "second_mode", frequency=90.0, damping=0.05, gain=0.1)
    assert locate(small.fit, unseen, force, ()).force_rms is None
