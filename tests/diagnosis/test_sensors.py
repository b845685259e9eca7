"""A concealed effect is named from velocities alone and from accelerations alone."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.measurement.smoothing import whole_campaign
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

pytestmark = pytest.mark.long

NOISE = {"velocity": 2e-4, "acceleration": 2e-2}
TRUE = 400.0
EFFECTS = tuple(
    BY_ID[i]
    for i in (
        "contact_damping_indentation", "contact_damping_speed", "hunt_crossley", "adhesion",
        "contact_hardening", "contact_relaxation", "gap_per_recording", "quadratic_drag",
        "spring_cubic", "sensor_drift",
    )
)  # fmt: skip


@pytest.mark.parametrize("quantity", NOISE)
def test_a_concealed_effect_is_named(quantity):
    campaign = small_rig.record(
        3,
        {"contact_damping_indentation": {"coefficient": TRUE}},
        chain=MeasuringChain(noise=NOISE[quantity]),
        quantity=quantity,
    )
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=EFFECTS, search=False)
    assert found.verdict == "named"
    assert [e.id for e in found.effects] == ["contact_damping_indentation"]
    i = found.after.names.index("contact_damping_indentation.coefficient")
    assert abs(found.after.mode[i] - TRUE) < 4 * found.after.sd[i] < 0.1 * TRUE
    # the place is one of the motion, whatever the probe reads
    low, high = found.location.displacement
    assert small_rig.RIG.g < low < high < 6e-3
    assert found.location.regime == "contact" and abs(found.location.velocity[1]) < 0.5
    assert found.scales.largest_reading > 10 * found.scales.amplitude
    assert whole_campaign(found.identification).displacement[1] < 6e-3
