"""Default priors: the table of the module, campaign.toml's own, and the scales of effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID, TestRig

from bayesimpact.data.campaign import Measurement
from bayesimpact.inference.defaults import default_priors, effect_prior
from bayesimpact.inference.initial.estimates import Estimates, estimate
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.prior import (
    Cauchy,
    HalfCauchy,
    HalfNormal,
    LogNormal,
    LogUniform,
    Normal,
    Prior,
    Uniform,
)
from bayesimpact.model.oscillator import build_oscillator

NOISE = Noise(level=4e-6)
SCALES = TestRig().scales()


@pytest.fixture(scope="module")
def campaign():
    return small_rig.record(31, duration=1.0)


@pytest.fixture(scope="module")
def guess(campaign) -> Estimates:
    return estimate(campaign)


def named(campaign, guess, effects=(), **settings) -> dict[str, Prior]:
    oscillator = build_oscillator(campaign, effects, **settings)
    priors = default_priors(oscillator, guess, NOISE, SCALES)
    return dict(zip(oscillator.layout.names, priors.parameters, strict=True))


def test_the_table(campaign, guess):
    priors = named(campaign, guess)
    mass, k1, k2 = campaign.mass, guess.k1, max(guess.k2.values())
    reach = 20 * max(np.ptp(r.samples) for r in campaign.recordings)
    critical = 2 * np.sqrt(k2 * mass)
    speed = reach * np.sqrt(k2 / mass)
    expected = {
        "c1": (0.0, 2 * np.sqrt(k1 * mass)),
        "k1": (0.0, 100 * k1),
        "c2": (0.0, 20 * critical),
        "k2[1]": (0.0, 1000 * k2),
        "k2[2]": (0.0, 1000 * k2),
        "g": (-reach, reach),
        "y0[a]": (-reach, reach),
        "offset[c]": (-reach, reach),
        "v0[b]": (-speed, speed),
    }
    for name, (low, high) in expected.items():
        prior = priors[name]
        assert isinstance(prior, Uniform)
        np.testing.assert_allclose((prior.lower, prior.upper), (low, high), rtol=1e-12)
    sigma = priors["sigma"]
    assert isinstance(sigma, LogUniform)
    np.testing.assert_allclose((sigma.lower, sigma.upper), (4e-10, 4e-2))


@pytest.mark.parametrize(("interval", "most"), [(1e-3, None), (1e-2, 1.0), (0.1, 0.0)])
def test_k1_is_none_of_a_motion_that_the_sampling_cannot_show(campaign, guess, interval, most):
    """Up to a natural frequency of half the sampling rate; 4 times the estimate at least."""
    slow = replace(
        campaign, recordings=tuple(replace(r, interval=interval) for r in campaign.recordings)
    )
    limit = campaign.mass * (np.pi / interval) ** 2
    prior = named(slow, guess)["k1"]
    expected = {None: 100 * guess.k1, 1.0: limit, 0.0: 4 * guess.k1}[most]
    assert prior.upper == pytest.approx(expected, rel=1e-12)


def test_the_truth_is_inside(campaign, guess):
    for name, value in small_rig.true_values().items():
        low, high = named(campaign, guess)[name].ppf([1e-4, 1 - 1e-4])
        assert low < value < high, name


def test_a_stated_noise_level_and_one_per_recording(campaign, guess):
    stated = replace(campaign, measurement=Measurement(noise=7e-6))
    assert named(stated, guess)["sigma"] == LogNormal(7e-6, 0.1)
    each = named(campaign, guess, sigma_per_recording=True)
    assert isinstance(each["sigma[b]"], LogUniform)


def test_without_a_stop(guess):
    campaign = small_rig.record(
        31, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=1.0
    )
    priors = named(campaign, estimate(campaign))
    assert "k2[1]" not in priors and isinstance(priors["v0[a]"], Uniform)


def test_priors_of_the_campaign_win_the_full_name_first(campaign, guess):
    own = {
        "k1": {"distribution": "normal", "mean": 800.0, "sd": 10.0},
        "k2": {"distribution": "lognormal", "median": 4000.0, "sigma": 0.5},
        "k2[2]": {"distribution": "uniform", "lower": 1000.0, "upper": 9000.0},
        "y0": {"distribution": "normal", "mean": 0.0, "sd": 0.01},
        "coulomb_friction.force": {"distribution": "halfnormal", "scale": 2e-3},
    }
    effects = (BY_ID["coulomb_friction"],)
    priors = named(replace(campaign, priors=own), guess, effects)
    assert priors["k1"] == Normal(800.0, 10.0)
    assert priors["k2[1]"] == LogNormal(4000.0, 0.5)
    assert priors["k2[2]"] == Uniform(1000.0, 9000.0)
    assert priors["y0[a]"] == priors["y0[c]"] == Normal(0.0, 0.01)
    assert priors["coulomb_friction.force"] == HalfNormal(2e-3)
    assert isinstance(priors["c1"], Uniform)


def prior_of(effect_id: str, parameter: str) -> Prior:
    effect = BY_ID[effect_id]
    return effect_prior(effect.parameter(parameter), SCALES)


def test_priors_of_effects():
    friction = BY_ID["coulomb_friction"].parameter("force").scale(SCALES)
    assert prior_of("coulomb_friction", "force") == HalfCauchy(friction)
    cubic = BY_ID["spring_cubic"].parameters[0]
    assert prior_of("spring_cubic", cubic.name) == Cauchy(0.0, cubic.scale(SCALES))
    exponent = BY_ID["contact_power_law"].parameter("exponent")
    assert prior_of("contact_power_law", "exponent") == Cauchy(1.0, exponent.scale(SCALES))
    time = BY_ID["contact_relaxation"].parameter("time")
    assert prior_of("contact_relaxation", "time") == LogNormal(time.scale(SCALES), 1.5)
    low, high = prior_of("presliding_friction", "displacement").support
    assert 0 < low < 0.01 * SCALES.amplitude and high == 0.14 * SCALES.amplitude
    phase = prior_of("harmonic_forcing", "phase")
    assert isinstance(phase, Uniform) and phase.lower < 0 and phase.upper > 2 * np.pi


def test_a_split_parameter_is_expected_about_the_shared_value():
    damping = prior_of("contact_damping_per_case", "c2")
    assert isinstance(damping, Normal) and damping.mean == SCALES.contact_damping
    gap = prior_of("gap_per_recording", "g")
    assert isinstance(gap, Normal) and gap.mean == SCALES.gap


@pytest.mark.parametrize("effect_id", BY_ID)
def test_every_effect_has_usable_priors_and_its_null_is_admissible(campaign, guess, effect_id):
    effect = BY_ID[effect_id]
    priors = named(campaign, guess, (effect,))
    for name, prior in priors.items():
        if "." in name:
            parameter = effect.parameter(name.split(".")[1].split("[")[0])
            low, high = prior.support
            assert low >= parameter.lower or low == -np.inf
            if parameter.null is not None:
                assert np.isfinite(prior.log_density(parameter.null))
                assert low <= parameter.null <= high
