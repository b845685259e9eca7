"""The loop repeated on campaigns of the same design."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.loop import diagnose_fit
from bayesimpact.diagnosis.parametric_bootstrap import (
    ParametricBootstrap,
    parametric_bootstrap,
    simulated,
)
from bayesimpact.inference.identify import identify

pytestmark = pytest.mark.usefixtures("catalogue_alone")

FEW = [BY_ID[i] for i in ("coulomb_friction", "quadratic_drag", "sensor_drift")]


def test_a_simulated_campaign_has_the_design_and_the_noise(small):
    campaign = small.fit.density.oscillator.campaign
    again = simulated(small.fit, np.random.default_rng(1))
    assert [r.name for r in again.recordings] == [r.name for r in campaign.recordings]
    left = np.concatenate(
        [r.samples - m for r, m in zip(again.recordings, small.fit.predicted, strict=True)]
    )
    error = small.fit.density.likelihood.noise.level / np.sqrt(2 * left.size)
    assert np.std(left) == pytest.approx(small.fit.density.likelihood.noise.level, abs=5 * error)


def test_the_bootstrap_of_what_stands_out():
    campaign = small_rig.record(
        6,
        {"coulomb_friction": {"force": 6e-4}},
        rig=small_rig.PLAIN,
        releases=small_rig.PLAIN_RELEASES,
        rate=500.0,
    )
    base = identify(campaign, rng=np.random.default_rng(0), search=False)
    found = diagnose_fit(base, rng=np.random.default_rng(0), effects=FEW)
    assert found.verdict == "named"
    said = parametric_bootstrap(found, 2, rng=np.random.default_rng(0), effects=FEW)
    assert said == ParametricBootstrap(2, 0, 2, 2, 0)


def test_of_an_adequate_model_only_controls_are_repeated(small):
    found = diagnose_fit(small, rng=np.random.default_rng(0), effects=FEW)
    assert found.verdict == "adequate"
    said = parametric_bootstrap(found, 1, rng=np.random.default_rng(0), effects=FEW)
    assert (said.controls, said.planted, said.named) == (1, 0, 0)
