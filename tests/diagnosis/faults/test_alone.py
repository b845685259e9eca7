"""One recording by itself: fitted, or told to show nothing."""

from __future__ import annotations

from dataclasses import replace

import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.faults.alone import SharedModel, inverted, own_fit
from bayesimpact.inference.noise import Noise


def test_a_recording_that_misses_the_obstacle_shows_nothing_of_contacts():
    """Upside down it never touches: there is no speed of impact to scale an effect by."""
    campaign = small_rig.record(1)
    model = SharedModel(Noise(level=small_rig.NOISE), (BY_ID["contact_damping_speed"],))
    first = campaign.recordings[0]
    assert own_fit(campaign, first, model) is not None
    away = replace(first, samples=-abs(first.samples))
    assert own_fit(campaign, away, model) is None
    own_fit(campaign, inverted(first), model)  # whatever it finds, it ends
