"""The noise of a measured input: how large, how it whitens, and what parameters are without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven_rigs import DrivenRig, driven_rig

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.diagnosis.input_noise import input_noise, with_input_noise
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.noise import Noise
from bayesimpact.inference.noise_forces import RandomForces

ERROR = 0.02  # of the input's rms
SEEDS = range(4)


def with_noisy_input(rig: DrivenRig, seed: int, error: float = ERROR) -> Campaign:
    (recording,) = rig.campaign.recordings
    given = recording.input
    assert given is not None
    size = error * float(np.sqrt(np.mean(given.samples**2)))
    noisy = given.samples + size * np.random.default_rng(seed).standard_normal(given.samples.size)
    noisy_input = Input(noisy, given.kind, given.free)
    return replace(rig.campaign, recordings=(replace(recording, input=noisy_input),))


def identified(campaign: Campaign) -> Identification:
    return identify(campaign, rng=np.random.default_rng(0), search=False)


def deviations(fit: Fit, rig: DrivenRig) -> list[float]:
    """Of the stiffness and the damping, in standard deviations."""
    names = ("k1", "c1")
    return [(fit.value(n) - rig.truth[n]) / fit.sd[fit.names.index(n)] for n in names]


def test_the_noise_of_a_sweep_is_told_and_widens_the_intervals() -> None:
    """Without it the truth lies far outside; with it within, over eight values of four rigs."""
    plain, wide = [], []
    for seed in SEEDS:
        rig = driven_rig(8 * seed + 4, "displacement", kind="sweep")  # without a stop
        before = identified(with_noisy_input(rig, seed))
        after = with_input_noise(before)
        assert after.noise.forces is not None
        assert after.noise.forces.share == pytest.approx(ERROR, rel=0.25)
        plain += deviations(before.fit, rig)
        wide += deviations(after.fit, rig)
    assert np.mean(np.square(plain)) > 10.0
    assert np.mean(np.square(wide)) < 1.0 + 3 * np.sqrt(2 / len(wide))


def test_a_clean_input_has_none() -> None:
    rig = driven_rig(4, "displacement", kind="sweep")
    assert input_noise(identified(rig.campaign).fit) is None


def hardening(y: float, v: float, touching: bool) -> float:
    return 3e6 * y**3


def test_a_missing_law_is_no_noise_of_a_clean_input() -> None:
    """What a law leaves asks for a large random force; the input's own floor holds none."""
    rig = driven_rig(4, "displacement", hardening, kind="sweep")
    found = identified(rig.campaign)
    assert found.fit.reduced_chi2 > 1.05
    assert input_noise(found.fit) is None


def test_an_input_that_fills_the_band_tells_nothing() -> None:
    rig = driven_rig(6, "displacement", kind="noise")
    (recording,) = rig.campaign.recordings
    white = Input(np.random.default_rng(0).standard_normal(recording.samples.size))
    campaign = replace(rig.campaign, recordings=(replace(recording, input=white),))
    fit = identified(campaign).fit
    assert input_noise(fit) is None


@pytest.mark.parametrize("used", [None, np.arange(40) % 7 != 3])
def test_whitening_is_that_of_the_covariance(used: np.ndarray | None) -> None:
    rng = np.random.default_rng(2)
    n, rows = 40, rng.standard_normal((40, 3))
    forces = RandomForces({"a": rows}, {"a": rows}, 0.1)
    kept = rows if used is None else np.where(used[:, None], rows, 0.0)
    covariance = np.eye(n) + kept @ kept.T
    x, y = rng.standard_normal((2, n))
    a, b = (
        forces.whitened("a", s if used is None else np.where(used, s, 0.0), used) for s in (x, y)
    )
    x, y = (s if used is None else np.where(used, s, 0.0) for s in (x, y))
    assert a @ b == pytest.approx(x @ np.linalg.solve(covariance, y), rel=1e-9)
    volume = forces.log_volume("a", n, used)
    assert volume == pytest.approx(-0.5 * np.linalg.slogdet(covariance)[1], rel=1e-9)


def test_draws_have_the_covariance() -> None:
    rows = np.random.default_rng(2).standard_normal((5, 3))
    forces, rng = RandomForces({"a": rows}, {"a": rows}, 0.1), np.random.default_rng(3)
    drawn = np.array([forces.drawn(rng, "a", 5) for _ in range(20_000)])
    assert np.cov(drawn.T) == pytest.approx(rows @ rows.T, abs=6 * np.sqrt(2 * 25 / 20_000))
    assert not forces.drawn(rng, "b", 5).any()


def test_noise_passes_forces_on() -> None:
    rig = driven_rig(4, "displacement", kind="sweep")
    (recording,) = rig.campaign.recordings
    n = recording.samples.size
    rows = {"a": np.sin(np.arange(n) / 9.0)[:, None]}
    forces = RandomForces(rows, rows, 0.1)
    noise = Noise(level=1.0, forces=forces)
    assert not noise.is_white
    assert "measured input (10 % of it)" in noise.kind
    x = np.random.default_rng(0).standard_normal(n)
    np.testing.assert_array_equal(noise.whitened(recording, x), forces.whitened("a", x, None))
    assert noise.volume_of(recording) == forces.log_volume("a", n, None)


def test_draws_whitened_are_independent_beside_coloured_noise() -> None:
    """Of a response as whitened beside AR(1) noise, drawn as read: unit variance once whitened."""
    rig = driven_rig(4, "displacement", kind="sweep")
    (recording,) = rig.campaign.recordings
    rows = 30.0 * np.sin(np.arange(recording.samples.size) / 9.0)[:, None]
    plain = Noise(0.6, level=1.0)
    forces = RandomForces({"a": plain.whitened(recording, rows.T).T}, {"a": rows}, 0.1)
    noise, rng = replace(plain, forces=forces), np.random.default_rng(5)
    drawn = np.array(
        [noise.whitened(recording, noise.drawn(rng, recording, 1.0)) for _ in range(9)]
    )
    assert np.var(drawn) == pytest.approx(1.0, abs=5 * np.sqrt(2 / drawn.size))
    bare = np.array([plain.whitened(recording, noise.drawn(rng, recording, 1.0)) for _ in range(9)])
    assert np.var(bare) > 2.0
