"""Effects that nearly do the same are all fitted before one of them is named."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, Rig, make_campaign


@pytest.mark.parametrize(
    ("amplitude", "seed"), [(0.25, 1), pytest.param(0.28, 2, marks=pytest.mark.long)]
)
def test_a_sine_is_told_from_its_cubic(amplitude: float, seed: int) -> None:
    """Beside a large misfit, where the equation of motion asks for spring_cubic first.

    The quintic part of the sine, 0.4 % of its cubic one, speaks for the sine by some six nats.
    """
    releases = [Release(f"swing{i}", "", -amplitude * f) for i, f in enumerate((1, 0.85, 0.7))]
    campaign = make_campaign(
        "pendulum", Rig(0.024, 7e-4, 0.96), releases, {"pendulum_sine": {}},
        MeasuringChain(noise=5e-4),
        rate=100.0, duration=30.0, rng=np.random.default_rng(seed), quantity="angle",
    )  # fmt: skip
    names = ("pendulum_sine", "pendulum_with_spring", "spring_cubic", "spring_quintic",
             "spring_quadratic", "coulomb_friction", "quadratic_drag", "sensor_cubic")  # fmt: skip
    effects = tuple(BY_ID[name] for name in names)
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)
    assert found.before.reduced_chi2 > 9
    assert found.verdict == "named" and [e.id for e in found.effects] == ["pendulum_sine"]
    assert ("spring_cubic",) in [m.ids for m in found.selection.tried]
