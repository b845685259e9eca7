"""The likelihood of periods ahead."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import small_rig

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.gaps import without
from bayesimpact.inference.initial.multiple_shooting import MultipleShooting, multiple_shooting
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

TRUE = small_rig.true_values()


def likelihood_of(campaign: Campaign, correlation: float = 0.0) -> Likelihood:
    return Likelihood(build_oscillator(campaign), Noise(correlation, level=small_rig.NOISE))


def ahead_of(likelihood: Likelihood, theta: np.ndarray) -> MultipleShooting:
    found = multiple_shooting(likelihood, theta)
    assert found is not None
    return found


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_what_is_left_of_true_parameters_is_noise(correlation: float) -> None:
    """Of many seeds: the sums of squares are chi-squared of the sizes, starts taken out."""
    sums, sizes = 0.0, 0.0
    for seed in range(8):
        campaign = small_rig.record(seed)
        if correlation:
            campaign = replace(campaign, recordings=_coloured(campaign, seed, correlation))
        whole = likelihood_of(campaign, correlation)
        theta = small_rig.vector(whole.oscillator.layout, TRUE)
        ahead = ahead_of(whole, theta)
        assert (ahead.sizes < whole.sizes - 10).all()
        sums += ahead.misfit(theta).sum() / small_rig.NOISE**2
        sizes += ahead.sizes.sum()
    assert sums == pytest.approx(sizes, abs=5 * np.sqrt(2 * sizes))


def _coloured(campaign: Campaign, seed: int, correlation: float) -> tuple:  # type: ignore[type-arg]
    true = likelihood_of(campaign).oscillator
    seen = true.predict(small_rig.vector(true.layout, TRUE))
    rng, noise = np.random.default_rng(seed), Noise(correlation)
    return tuple(
        replace(r, samples=y + noise.coloured(rng, y.size, r.interval, small_rig.NOISE))
        for r, y in zip(campaign.recordings, seen, strict=True)
    )


def test_starts_are_free() -> None:
    """Starts that are read a little wrong change what is left by what is of second order."""
    whole = likelihood_of(small_rig.record(1))
    theta = small_rig.vector(whole.oscillator.layout, TRUE)
    ahead = ahead_of(whole, theta)
    before = ahead.residuals(theta[None])
    o, changes = whole.oscillator, []
    for size in (1e-5, 1e-4):
        moved = tuple(
            replace(s, restarts=s.restarts + np.array([0.0, size, -30 * size]))
            for s in ahead.starts
        )
        left = replace(ahead, starts=moved).residuals(theta[None])
        changes.append(max(float(np.abs(a - b).max()) for a, b in zip(left, before, strict=True)))
        motion = o.predict_restarted(0, theta[None], moved[0].restarts)
        motion = motion - o.predict_restarted(0, theta[None], ahead.starts[0].restarts)
        assert np.abs(motion).max() > 0.9 * size  # it does change the motion
    assert changes[0] < 0.02 * 1e-5
    assert changes[1] / changes[0] == pytest.approx(100.0, rel=0.3)


def test_derivatives_are_those_of_the_residuals() -> None:
    whole = likelihood_of(small_rig.record(2))
    theta = small_rig.vector(whole.oscillator.layout, TRUE)
    ahead = ahead_of(whole, theta)
    steps = np.maximum(1e-6 * np.abs(theta), 1e-9)
    for r, part in enumerate(ahead.linearise(theta, steps)):
        for k, i in enumerate(part.columns):
            moved = np.repeat(theta[None], 2, axis=0)
            moved[:, i] += np.array([1.0, -1.0]) * 3 * steps[i]
            up, down = ahead.residuals(moved)[r]
            np.testing.assert_allclose(
                part.jacobian[:, k],
                (down - up) / (6 * steps[i]),
                rtol=2e-3,
                atol=1e-4 * np.abs(part.jacobian[:, k]).max() + 1e-9,
            )


def test_it_stays_in_step_where_the_whole_motion_does_not() -> None:
    """A tenth of stiffness: the misfit of the whole motion is no parabola, that of periods ahead
    is, and its least squares find the truth in one step.
    """
    whole = likelihood_of(small_rig.record(3, duration=4.0))
    layout = whole.oscillator.layout
    true = small_rig.vector(layout, TRUE)
    wrong = true.copy()
    wrong[layout.index("k1")] *= 1.1
    found = []
    for likelihood in (ahead_of(whole, wrong), whole):
        parts = likelihood.linearise(wrong, np.maximum(1e-6 * np.abs(wrong), 1e-9))
        k = layout.index("k1")
        slope = np.concatenate([p.jacobian[:, list(p.columns).index(k)] for p in parts])
        left = np.concatenate([p.residual for p in parts])
        found.append((slope @ left) / (slope @ slope))
    change = true[layout.index("k1")] - wrong[layout.index("k1")]
    assert found[0] == pytest.approx(change, rel=0.15)
    assert abs(found[1] - change) > 0.5 * abs(change)


@pytest.mark.parametrize(
    "quantity, noise, most", [("velocity", 3e-4, 1.0), ("acceleration", 2e-2, 2.0)]
)
def test_another_quantity_begins_anew_where_its_integral_says(
    quantity: Any, noise: float, most: float
) -> None:
    """About the truth noise is left, about a wrong stiffness much more. An acceleration jumps at
    the impact, by more than noise in the sample that a start's small error moves across it.
    """
    sums, sizes = np.zeros(2), 0.0
    for seed in range(4):
        chain = MeasuringChain(noise=noise, offsets={})
        campaign = small_rig.record(seed, chain=chain, quantity=quantity)
        whole = Likelihood(build_oscillator(campaign), Noise(level=noise))
        names = whole.oscillator.layout.names
        theta = np.array([{**TRUE, "sigma": noise}.get(n, 0.0) for n in names])
        theta[[i for i, n in enumerate(names) if n.startswith("offset")]] = 0.0
        wrong = theta.copy()
        wrong[names.index("k2[1]")] *= 1.1
        sums += [ahead_of(whole, at).misfit(at).sum() / noise**2 for at in (theta, wrong)]
        sizes += ahead_of(whole, theta).sizes.sum()
    error = 6 * np.sqrt(2 * sizes)
    assert sizes - error < sums[0] < most * sizes + error
    assert sums[1] > 2 * sums[0]


def test_there_is_none_without_periods() -> None:
    short = small_rig.record(1).truncated(0.1)
    whole = likelihood_of(short)
    assert multiple_shooting(whole, small_rig.vector(whole.oscillator.layout, TRUE)) is None


def test_no_period_begins_where_samples_are_set_aside() -> None:
    campaign = small_rig.record(1)
    first = without(campaign.recordings[0], [(700, 1100)])
    whole = likelihood_of(replace(campaign, recordings=(first, *campaign.recordings[1:])))
    theta = small_rig.vector(whole.oscillator.layout, TRUE)
    ahead, full = ahead_of(whole, theta), ahead_of(likelihood_of(campaign), theta)
    at = ahead.starts[0].restarts[:, 0]
    assert 0 < at.size < full.starts[0].restarts.shape[0]
    assert not np.any((at >= 700) & (at < 1100))
    assert ahead.sizes[0] == whole.sizes[0] - 2 * at.size
