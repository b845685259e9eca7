"""Identification from velocities and accelerations alone, and from several quantities together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig

from bayesimpact.inference.identify import identify
from bayesimpact.inference.noise.estimate import estimate_noise

NOISE = {"displacement": 5e-6, "velocity": 2e-4, "acceleration": 2e-2}


def recorded(quantity, seed):
    noise = NOISE[quantity]
    offsets = {"a": 3 * noise, "b": -2 * noise, "c": 0.0}
    chain = small_rig.MeasuringChain(noise=noise, offsets=offsets)
    return small_rig.record(seed, quantity=quantity, chain=chain), offsets


def errors(fit, offsets):
    true = small_rig.true_values(offsets=offsets)
    known = [
        (fit.value(n) - t) / fit.sd[fit.names.index(n)] for n, t in true.items() if "sig" not in n
    ]
    return np.array(known)


@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_all_parameters_are_found(quantity):
    z = []
    for seed in (1, 2, 3):
        campaign, offsets = recorded(quantity, seed)
        found = identify(campaign, rng=np.random.default_rng(0), search=seed == 1)
        assert found.fit.converged and found.agree
        assert found.fit.reduced_chi2 == pytest.approx(1.0, abs=0.1)
        assert found.noise.level == pytest.approx(NOISE[quantity], rel=0.05)
        z.append(errors(found.fit, offsets))
    z = np.concatenate(z)
    # 48 numbers, correlated within a campaign: 90 % lie within 1.645, and none is far out
    assert np.abs(z).max() < 4.0 and np.mean(np.abs(z) < 1.645) > 0.75


def test_accelerations_beside_a_jump_are_set_aside_and_said():
    campaign, _ = recorded("acceleration", 1)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    kept = fit.density.oscillator.campaign
    aside = [np.flatnonzero(~r.used) for r in kept.recordings if r.used is not None]
    assert len(aside) == 3 and f"{sum(x.size for x in aside)} accelerations" in kept.notes[-1]
    truth = small_rig.motion_of(0)
    events = np.sort(np.concatenate([truth.onsets, truth.ends]))
    np.testing.assert_array_equal(aside[0], np.rint(events * 1000.0).astype(int))
    again, _ = recorded("velocity", 1)
    assert all(
        r.used is None
        for r in identify(
            again, rng=np.random.default_rng(0), search=False
        ).fit.density.oscillator.campaign.recordings
    )


def test_several_quantities_in_one_campaign():
    parts = {q: recorded(q, 5) for q in NOISE}
    order = ("displacement", "velocity", "acceleration")
    pairs = list(zip(order, range(3), strict=True))
    campaign = replace(
        parts["displacement"][0],
        recordings=tuple(parts[q][0].recordings[i] for q, i in pairs),
    )
    names = "abc"
    offsets = {names[i]: parts[q][1][names[i]] for q, i in pairs}
    assert campaign.mixed
    noise = estimate_noise(campaign)
    assert noise.scales == pytest.approx((1.0, 40.0, 4000.0), rel=0.15)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    assert fit.converged and fit.reduced_chi2 == pytest.approx(1.0, abs=0.1)
    assert np.abs(errors(fit, offsets)).max() < 4.0
    units = {p.name: p.unit for p in fit.density.oscillator.layout.parameters}
    assert [units[f"offset[{n}]"] for n in names] == ["m", "m/s", "m/s2"]
    white = fit.density.likelihood.residuals(fit.mode[None])
    for part in white:  # all in the unit of the first: the likelihood weighs them alike
        assert np.std(part[part != 0.0]) == pytest.approx(NOISE["displacement"], rel=0.1)
