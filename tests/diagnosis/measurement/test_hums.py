"""Recordings less their hums, and the search that begins with what those ask for."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.hum import Hum
from bayesimpact.data.input import Input
from bayesimpact.diagnosis.budget import Budget
from bayesimpact.diagnosis.measurement.hums import (
    _shared,
    fit_without_hums,
    recordings_without_hums,
)
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection import search
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify

HUM = {"amplitude": 4e-5, "frequency": 17.0, "phase": 1.0}
CUBIC = {"stiffness": 1e6}


def decays(**effects: Any) -> Campaign:
    return small_rig.record(
        3, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0, rate=500.0
    )


def fitted(campaign: Campaign) -> Fit:
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


@pytest.fixture(scope="module")
def humming() -> Fit:
    return fitted(decays(sensor_hum=HUM, spring_cubic=CUBIC))


def test_recordings_are_quiet_without_their_hums() -> None:
    loud, still = (decays(**e).recordings for e in ({"sensor_hum": HUM}, {}))
    for own, known in zip(recordings_without_hums(loud), still, strict=True):
        assert np.std(own.samples - known.samples) < 0.05 * HUM["amplitude"]
    assert all(a is b for a, b in zip(recordings_without_hums(still), still, strict=True))


def test_a_driven_motion_may_be_a_line_itself() -> None:
    first, *others = decays(sensor_hum=HUM).recordings
    driven = replace(first, input=Input(np.zeros(first.samples.size)))
    found = recordings_without_hums((driven, *others))
    assert found[0] is driven and found[1] is not others[0]


def test_a_hum_is_taken_out_only_where_that_leaves_less(
    humming: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = fit_without_hums(humming)
    assert found is not None and found.reduced_chi2 < humming.reduced_chi2
    assert fit_without_hums(fitted(decays(spring_cubic=CUBIC))) is None
    monkeypatch.setattr(
        "bayesimpact.diagnosis.measurement.hums.refitted", lambda fit, campaign: fit
    )
    assert fit_without_hums(humming) is None


@pytest.mark.parametrize(
    ("left", "seconds", "kept"), [(1.0, 150.0, True), (100.0, 150.0, False), (100.0, 80.0, True)]
)
def test_a_search_begins_with_what_quiet_recordings_ask_for(
    humming: Fit, left: float, seconds: float, kept: bool
) -> None:
    """Unless that leaves a large misfit, and there is time to ask for something else; the model is
    then fitted to the recordings as they are.
    """
    quieter = fit_without_hums(humming)
    assert quieter is not None
    law = BY_ID["spring_cubic"]
    values = {"spring_cubic.stiffness": CUBIC["stiffness"]}
    quieter = fit_from(quieter, (law,), values, campaign_scales(quieter)).fit
    fit = replace(quieter, sums=quieter.sums * left / quieter.reduced_chi2)
    examined = SimpleNamespace(candidate=SimpleNamespace(fit=fit))
    readings = iter((0.0, 40.0, 40.0))  # asking takes 40 s
    begun = SimpleNamespace(
        progress=lambda words: None,
        examine=lambda c: examined,
        asked_for=lambda s: [s],
        is_large=True,
        look=1.0,
        budget=Budget(lambda: next(readings, 40.0), 0.0, seconds),
    )
    found = search._beside_hums(humming, lambda: begun)
    assert (found is not None) == kept
    if found is not None:
        own = humming.density.oscillator.campaign
        assert found.density.oscillator.campaign is own and found.density.oscillator.effects


def test_hums_of_different_frequencies_are_shared_by_none() -> None:
    one, other = Hum(50.0, 1.0, 0.0, 9.0, 1.0), Hum(150.0, 1.0, 0.0, 9.0, 1.0)
    near = Hum(50.1, 1.0, 0.0, 9.0, 1.0)
    assert _shared((one, other), 4.0) is None and _shared((), 4.0) is None
    assert _shared((one, near), 4.0) in (one, near) and _shared((one, near), 40.0) is None
