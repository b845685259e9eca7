"""A reading beside a touch: whichever side it is on, an ascent gets there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.inference import mode
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.onset_jumps import beyond_onset
from bayesimpact.inference.refitted import refitted
from bayesimpact.model.exact.simulate import simulate

RIG = {"mass": 0.5, "k1": 800.0, "c1": 0.2, "k2": 5000.0, "c2": 6.0}
START = {"y0": -6e-3, "v0": 0.0}
INTERVAL, COUNT = 1e-3, 700
NOISE = 2e-2  # m/s2; a damper that touches jumps by a hundred times as much
BESIDE = 2e-7  # s


@pytest.fixture(scope="module")
def touched() -> tuple[Fit, int]:
    """A fit to accelerations of which one was read just after the first touch, and which."""
    free = simulate(**RIG, **START, g=1.0, n=COUNT, interval=INTERVAL)
    k = int(np.argmax(free.displacement > 1e-3))
    gap = float(free.displacement[k] - BESIDE * free.velocity[k])
    found = simulate(**RIG, **START, g=gap, n=COUNT, interval=INTERVAL)
    y, v = found.displacement, found.velocity
    contact = RIG["k2"] * (y - gap) + RIG["c2"] * v
    force = -RIG["k1"] * y - RIG["c1"] * v - np.where(y > gap, contact, 0.0)
    noise = NOISE * np.random.default_rng(0).standard_normal(COUNT)
    recording = Recording("a", "1", force / RIG["mass"] + noise, INTERVAL, quantity="acceleration")
    campaign = Campaign("touch", RIG["mass"], (recording,))
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    return refitted(fit, campaign), k  # with the readings that `onsets` sets aside


def _beside(fit: Fit, by: float) -> Fit:
    """The fit with another gap, where an ascent that takes no step ends."""
    start = fit.mode.copy()
    start[fit.names.index("g")] += by
    return mode.find_mode(fit.density, start, max_iterations=0)


def test_a_reading_on_the_wrong_side_of_an_onset_is_set_right(
    touched: tuple[Fit, int], monkeypatch: Any
) -> None:
    fit, k = touched
    assert abs(fit.linearisation[0].residual[k]) < 5 * fit.value("sigma")
    assert beyond_onset(fit) is None
    late = 3 * BESIDE * 0.2  # m; the speed at the contact onset is less
    with monkeypatch.context() as without:
        without.setattr(mode, "MOST_ONSETS", 0)
        wrong = _beside(fit, late)
    assert abs(wrong.linearisation[0].residual[k]) > 5 * wrong.value("sigma")
    beyond = beyond_onset(wrong)
    assert beyond is not None
    assert fit.density(beyond)[0] > wrong.log_posterior + 30.0
    right = _beside(fit, late)
    assert right.log_posterior > float(fit.density(beyond)[0])  # with a noise level of its own


def test_readings_that_do_not_jump_are_left_alone(touched: tuple[Fit, int]) -> None:
    """Where many readings are off, no single instant is."""
    fit, _ = touched
    assert beyond_onset(_beside(fit, 2e-4)) is None
