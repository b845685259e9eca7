"""What a law or a force would make run away says nothing, and ends no search."""

from __future__ import annotations

import numpy as np
import pytest
from driven_twin import driven_motion
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.residual_force import gaussian_process
from bayesimpact.diagnosis.residual_force.gaussian_process import basis_responses, motion_range
from bayesimpact.diagnosis.residual_force.learned import learned_force
from bayesimpact.diagnosis.score_test.directions import directions
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.inference.identify import identify


def test_a_pendulum_that_would_spin_is_no_direction() -> None:
    """A wheel on a spring, held aside by a torque that no weight on it could resist."""
    n, interval = 300, 0.05
    torque = 60.0 + 15.0 * np.sin(4.4 * interval * np.arange(n))
    values = {"mass": 1.0, "c1": 0.4, "k1": 20.0, "y0": 3.0, "v0": 0.0}
    motion, _ = driven_motion(values, torque, interval, lambda y, v, touching: 0.0, False)
    samples = motion + 0.02 * np.random.default_rng(0).standard_normal(n)
    recording = Recording("a", "", samples, interval, quantity="angle", input=Input(torque))
    campaign = Campaign("wheel", 1.0, (recording,), stop=False)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    assert not directions(fit, [BY_ID["pendulum_sine"]], scales)
    both = [BY_ID["pendulum_sine"], BY_ID["spring_cubic"]]
    found = scan(fit, both, scales, rng=np.random.default_rng(0))
    assert {s.effect.id for s in found.scores} == {"spring_cubic"}
    assert np.isfinite(found.p_value)


def test_a_force_too_large_to_bear_is_seen_by_a_smaller_one(
    small, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A response far below the noise is looked for with a large step, which a motion may not
    survive; that of the first step is kept, and one that survives none is none.
    """
    fit, scales = small.fit, campaign_scales(small.fit)
    effect = learned_force(*motion_range(fit), 1.0, 1.0, 10)
    expected = basis_responses(fit, effect, 10, scales)
    simulated, steps = gaussian_process._change, list[float]()

    def fragile(oscillator, laws, q, step, r, n, knots):
        found = simulated(oscillator, laws, q, step, r, n, knots)
        if r == 0:
            steps.append(float(step[3]))
            found[3] = np.nan if step[3] > steps[0] else found[3]
            found[4] = np.nan
        return found

    monkeypatch.setattr(gaussian_process, "_change", fragile)
    found = basis_responses(fit, effect, 10, scales)
    assert steps[1] > steps[0]
    assert all(np.isfinite(part).all() for part in found)
    size = np.linalg.norm(expected[0][:, 3])
    assert np.linalg.norm(found[0][:, 3] - expected[0][:, 3]) < 0.01 * size
    assert not found[0][:, 4].any()
    np.testing.assert_array_equal(found[1], expected[1])
