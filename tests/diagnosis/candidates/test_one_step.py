"""One measure of sets that different problems ask for: what a step over periods ahead leaves."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig

from bayesimpact.diagnosis.candidates.one_step import after_steps
from bayesimpact.diagnosis.candidates.term_sets import EffectSet
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import EFFECTS

BY_ID = {e.id: e for e in EFFECTS}
PHYSICS = {"coulomb_friction": {"force": 0.05}, "contact_hardening": {"stiffness": 4e9}}
VALUES = {f"{name}.{p}": v for name, own in PHYSICS.items() for p, v in own.items()}


@pytest.fixture(scope="module")
def base() -> Fit:
    return identify(small_rig.record(5, PHYSICS), rng=np.random.default_rng(0), search=False).fit


def criterion(base: Fit, *names: str, by: float = 1.0) -> float:
    """Of a set with the true sizes of its effects, or these times a factor."""
    values = {n: by * v for n, v in VALUES.items() if n.split(".")[0] in names}
    chosen = EffectSet(tuple(BY_ID[n] for n in names), values, 0.0)
    return after_steps(base, chosen, campaign_scales(base)).cost


def test_the_truth_leaves_least(base: Fit) -> None:
    """Also from sizes a third too small; less than either effect alone or others do."""
    truth = criterion(base, *PHYSICS, by=0.67)
    others = [("coulomb_friction",), ("contact_hardening",), ("spring_cubic", "quadratic_drag")]
    assert all(criterion(base, *names) > truth + 500.0 for names in others)


def test_parameters_are_paid_for(base: Fit) -> None:
    """Half the logarithm of the number of samples, where a parameter does nothing."""
    plain = criterion(base, *PHYSICS)
    values = VALUES | {"opposite_stop.gap": 1.0, "opposite_stop.stiffness": 1e3}
    more = EffectSet(tuple(BY_ID[n] for n in (*PHYSICS, "opposite_stop")), values, 0.0)
    found = after_steps(base, more, campaign_scales(base)).cost - plain
    count = sum(r.samples.size for r in base.density.oscillator.campaign.recordings)
    number = len(BY_ID["opposite_stop"].parameters)
    assert found == pytest.approx(0.5 * number * np.log(count), abs=0.5)


def test_a_motion_that_runs_away_is_none(base: Fit) -> None:
    chosen = EffectSet((BY_ID["spring_cubic"],), {"spring_cubic.stiffness": -1e12}, 0.0)
    assert after_steps(base, chosen, campaign_scales(base)).cost == np.inf


def test_further_steps_lead_to_the_values(base: Fit) -> None:
    """From half the true sizes, and no farther where a step has led astray."""
    scales = campaign_scales(base)
    values = {name: 0.5 * value for name, value in VALUES.items()}
    chosen = EffectSet(tuple(BY_ID[n] for n in PHYSICS), values, 0.0)
    first, last = (after_steps(base, chosen, scales, steps) for steps in (1, 4))
    assert first.chosen is chosen and last.cost <= first.cost
    for name, value in VALUES.items():
        assert last.chosen.values[name] == pytest.approx(value, rel=0.05)
    far = EffectSet((BY_ID["spring_cubic"],), {"spring_cubic.stiffness": -1e12}, 0.0)
    assert after_steps(base, far, scales, 3).left == np.inf
