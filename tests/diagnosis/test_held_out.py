"""Held-out scores against the marginal likelihood of the linearised problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy.special import gammaln

from bayesimpact.data.campaign import Smoothing
from bayesimpact.diagnosis.held_out import HeldOut, _cut, held_out_cases, held_out_recordings
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import refit
from bayesimpact.diagnosis.score_test.directions import directions
from bayesimpact.diagnosis.score_test.scan import score_directions
from bayesimpact.inference.identify import identify


def exact_log_evidence(jacobian: np.ndarray, residual: np.ndarray) -> float:
    """Linear model, flat coefficients, density 1 / sigma of the level; without priors' heights."""
    n, d = jacobian.shape
    scale = np.linalg.norm(jacobian, axis=0)
    left = residual - jacobian @ np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    _, log_det = np.linalg.slogdet((jacobian / scale).T @ (jacobian / scale))
    freedom = 0.5 * (n - d)
    return float(
        -freedom * np.log(2 * np.pi)
        - 0.5 * log_det
        - np.log(scale).sum()
        + gammaln(freedom)
        - freedom * np.log(0.5 * left @ left)
        - np.log(2)
    )


def test_a_held_out_recording_is_predicted_as_the_linear_theory_says():
    campaign = small_rig.record(
        2, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=1.5
    )
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    found = held_out_recordings(fit, fit)
    assert found.labels == ("a", "b") and found.gain == 0.0 and found.wins == 0
    blocks = []
    for lin in fit.linearisation:
        block = np.zeros((lin.residual.size, fit.mode.size - 1))
        block[:, lin.columns] = lin.jacobian
        blocks.append((block, lin.residual))
    for held, score in enumerate(found.before):
        known = [(j[:150], r[:150]) if i == held else (j, r) for i, (j, r) in enumerate(blocks)]
        everything, part = (
            exact_log_evidence(np.vstack([j for j, _ in b]), np.concatenate([r for _, r in b]))
            for b in (blocks, known)
        )
        assert score == pytest.approx(everything - part, abs=0.1)


def bases(small):
    """The small rig's fit, and that of the same rig with friction, ignored."""
    campaign = small_rig.record(6, {"coulomb_friction": {"force": 6e-4}})
    return small.fit, identify(campaign, rng=np.random.default_rng(0), search=False).fit


def added(base, effect_id: str):
    scales = campaign_scales(base)
    found = directions(base, [BY_ID[effect_id]], scales)
    score = score_directions(base, found, rng=np.random.default_rng(0)).best()[0]
    return refit(base, [score], scales).fit


def test_the_missing_physics_predicts_what_it_has_not_seen(small):
    control, base = bases(small)
    better = added(base, "coulomb_friction")
    found = held_out_recordings(base, better)
    assert found.labels == ("a", "b", "c")
    assert found.wins == 3 and found.improved and found.gain > 20
    obstacles = held_out_cases(base, better)
    assert obstacles.labels == ("1", "2") and obstacles.gain > 0
    nothing = held_out_recordings(control, added(control, "sensor_cubic"))
    assert not nothing.improved and abs(nothing.gain) < 6


def test_gain_error_and_verdict():
    before = np.array([10.0, 20.0, 30.0, 40.0])

    def judged(*gains: float) -> bool:
        return HeldOut(tuple("abcd"), before, before + np.array(gains)).improved

    found = HeldOut(tuple("abcd"), before, before + np.array([3.0, 5.0, 4.0, 4.0]))
    assert found.gain == 16.0 and found.wins == 4 and found.improved
    assert found.standard_error == pytest.approx(np.std([3, 5, 4, 4], ddof=1) * 2)
    assert not judged(1.0, 1.0, 1.0, 0.5)  # small
    assert not judged(30.0, 0.1, 0.1, 0.1)  # one only
    assert not judged(9.0, 9.0, 9.0, -0.1)  # a loss
    nine = HeldOut(tuple("abcdefghi"), np.zeros(9), np.array([5.0] * 8 + [-0.1]))
    assert nine.improved  # eight of nine
    assert not HeldOut(nine.labels, np.zeros(9), np.array([5.0] * 7 + [-0.1] * 2)).improved
    one = HeldOut(("a",), np.zeros(1), np.array([9.0]))
    assert one.improved and np.isnan(one.standard_error)


def test_the_first_part_is_long_enough_for_the_filter():
    campaign = small_rig.record(1, duration=0.15)
    kept = [r.samples.size for r in _cut(campaign, [1], None).recordings]
    assert kept == [150, 20, 150]
    wide = Smoothing("savgol", window=31, polyorder=2)
    kept = [r.samples.size for r in _cut(campaign, [0, 2], wide).recordings]
    assert kept == [50, 150, 50]
    long = replace(campaign.recordings[0], samples=np.zeros(5000))
    cut = _cut(replace(campaign, recordings=(long,)), [0], wide)
    assert cut.recordings[0].samples.size == 500
