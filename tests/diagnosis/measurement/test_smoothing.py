"""Filters that nobody declared: a lag is an effect, a Savitzky-Golay filter shows in the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Measurement, Smoothing
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.measurement.smoothing import LAG, is_refuted, proved_smoothing
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer
from bayesimpact.report.diagnosis.document import document
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

pytestmark = pytest.mark.usefixtures("catalogue_alone")

CATALOGUE = tuple(
    BY_ID[i] for i in ("smoothing", "coulomb_friction", "contact_hardening", "sensor_cubic")
)


def recorded(seed: int, smoothing: Smoothing, measurement: Measurement | None = None):
    chain = MeasuringChain(noise=small_rig.NOISE, offsets=small_rig.OFFSETS, smoothing=smoothing)
    return small_rig.record(seed, chain=chain, duration=1.5, measurement=measurement)


def run(campaign) -> Diagnosis:
    return diagnose(campaign, rng=np.random.default_rng(0), effects=CATALOGUE, search=False)


def test_a_lag_is_named_with_its_time_constant():
    truth = 1e-3
    diagnosis = run(recorded(5, Smoothing("lag", time_constant=truth)))
    assert diagnosis.verdict == "named"
    assert [e.id for e in diagnosis.effects] == ["smoothing"]
    found = diagnosis.after
    sd = found.sd[found.names.index("smoothing.time_constant")]
    assert abs(found.value("smoothing.time_constant") - truth) < 4 * sd < 0.2 * truth
    assert diagnosis.location.regime == "measurement"


@pytest.mark.parametrize(
    ("lag", "correlation", "refuted"),
    [
        (0.05, 0.0, True),  # white noise has passed no such filter
        (0.05, 0.98, False),  # exp(-1 ms / 50 ms)
        (1e-3, 0.37, False),
        (1e-4, 0.0, False),  # too short to leave a mark
    ],
)
def test_a_lag_needs_its_mark_on_the_noise(small, lag, correlation, refuted):
    scales = campaign_scales(small.fit)
    density = extend(small.fit, (BY_ID["smoothing"],), scales)
    layout = density.oscillator.layout
    theta = transfer(small.fit, layout, (BY_ID["smoothing"],), scales, {})
    theta[layout.index(LAG)] = lag
    likelihood = replace(
        density.likelihood, noise=replace(density.likelihood.noise, correlation=correlation)
    )
    fit = replace(small.fit, density=replace(density, likelihood=likelihood), mode=theta)
    assert is_refuted(fit) is refuted
    assert not is_refuted(small.fit)


@pytest.fixture(scope="module")
def undeclared() -> Diagnosis:
    return run(recorded(6, Smoothing("savgol", window=15, polyorder=2)))


def test_a_filter_is_named_with_window_and_order(undeclared):
    assert undeclared.verdict == "named"
    content = document(undeclared, seed=0, seconds=1.0, versions={})
    (effect,) = content["effects"]
    assert effect["id"] == "smoothing"
    assert effect["parameters"]["smoothing.window"]["median"] == 15
    assert effect["parameters"]["smoothing.order"]["median"] == 2
    truth = small_rig.true_values()
    after = undeclared.after
    for name in ("k2[1]", "k2[2]", "g", "k1"):
        assert abs(after.value(name) - truth[name]) < 4 * after.sd[after.names.index(name)]


def test_a_declared_filter_is_not_looked_for():
    smoothing = Smoothing("savgol", window=15, polyorder=2)
    assert proved_smoothing(recorded(6, smoothing)).smoothing == smoothing
    declared = Measurement(smoothing=smoothing)
    assert proved_smoothing(recorded(6, smoothing, declared)) is None


def test_another_rig_behind_a_filter_is_found_before_any_physics() -> None:
    """What recordings differ by is weighed against the noise behind the filter that they prove."""
    filtering = Smoothing("savgol", window=15, polyorder=2)
    sound = recorded(6, filtering)
    stiffer = replace(small_rig.RIG, k1=1.003 * small_rig.RIG.k1)
    chain = MeasuringChain(noise=small_rig.NOISE, offsets=small_rig.OFFSETS, smoothing=filtering)
    other = small_rig.record(6, chain=chain, rig=stiffer, duration=1.5).recordings[1]
    mixed = replace(sound, recordings=(sound.recordings[0], other, sound.recordings[2]))
    found = run(mixed)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["smoothing"]
    assert found.corrected is not None
    (fault,) = found.corrected.faults
    assert (fault.id, fault.recording) == ("recording_other_rig", "b")
    assert not found.selection.tried[0].ids
