"""One recording by itself: fitted, or told to show nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.faults import alone
from bayesimpact.diagnosis.faults.alone import NAMES, SharedModel, fit_alone, inverted, own_fit
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects import EFFECTS


def test_a_recording_that_misses_the_obstacle_shows_nothing_of_contacts():
    """Swings within the gap: there is no speed of impact to scale an effect by."""
    campaign = small_rig.record(1)
    model = SharedModel(Noise(level=small_rig.NOISE), (BY_ID["contact_damping_speed"],))
    first = campaign.recordings[0]
    assert own_fit(campaign, first, model) is not None
    rate = np.sqrt(small_rig.RIG.k1 / small_rig.RIG.mass)
    within = 0.3 * small_rig.RIG.g * np.exp(-0.2 * first.times) * np.cos(rate * first.times)
    noise = small_rig.NOISE * np.random.default_rng(0).standard_normal(within.size)
    away = replace(first, samples=within + noise)
    assert own_fit(campaign, away, model) is None
    own_fit(campaign, inverted(first), model)  # whatever it finds, it ends


def test_what_a_law_of_the_contact_replaces_counts_as_not_measured():
    """Hunt and Crossley's law has no c2: a comparison beside it ended in KeyError."""
    effect = BY_ID["hunt_crossley"]
    numbers = {"exponent": 1.4, "damping": 0.5}
    campaign = small_rig.record(2, {effect.id: numbers})
    model = SharedModel(Noise(level=small_rig.NOISE), (effect,))
    found = fit_alone(campaign, campaign.recordings[0], model)
    assert found is not None
    variance = dict(zip(NAMES, np.diag(found.covariance), strict=True))
    assert variance["k1"] < 1.0 and variance["g"] < 1.0 and variance["c2"] == 1e6


def test_a_law_without_parameters_stays_beside_a_recording_alone() -> None:
    """It is none that only gives every stop a parameter of its own."""
    by_id = {e.id: e for e in EFFECTS}
    assert not alone._is_by_case(by_id["pendulum_sine"])
    assert not alone._is_by_case(by_id["contact_no_tension"])
    assert alone._is_by_case(by_id["contact_damping_per_case"])
