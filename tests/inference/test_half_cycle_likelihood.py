"""The likelihood of half cycles: parts of the whole, cut where the mass passes rest."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import small_rig
from scipy import stats

from bayesimpact.data.campaign import Smoothing
from bayesimpact.data.gaps import without
from bayesimpact.inference import half_cycle_likelihood as half_cycles
from bayesimpact.inference.half_cycle_likelihood import half_cycle_blocks, log_likelihood
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import build_oscillator

SAVGOL = Smoothing("savgol", window=11, polyorder=2)
NOISES = {
    "white": Noise(),
    "ar1": Noise(correlation=0.7),
    "smoothed": Noise(smoothing=SAVGOL),
    "growing": Noise(correlation=0.3, growth=(500.0, 20.0)),
}


def build(noise: Noise, *, gaps: bool = False) -> tuple[Likelihood, np.ndarray]:
    """A likelihood, and draws (4, d) near the true parameters."""
    campaign = small_rig.record(duration=0.6)
    if gaps:
        holed = [without(r, [(0, 130), (200, 240)]) for r in campaign.recordings]
        campaign = replace(campaign, recordings=tuple(holed))
    oscillator = build_oscillator(campaign, smoothing=noise.smoothing)
    centre = small_rig.vector(oscillator.layout, small_rig.true_values())
    rng = np.random.default_rng(0)
    return Likelihood(oscillator, noise), centre * (
        1 + 1e-4 * rng.standard_normal((4, centre.size))
    )


@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize("noise", NOISES)
def test_parts_add_up_to_the_recordings(
    noise: str, gaps: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    likelihood, theta = build(NOISES[noise], gaps=gaps)
    blocks = half_cycle_blocks(likelihood, theta[0])
    found = log_likelihood(likelihood, theta, blocks)
    ends = np.cumsum([0, *(b.first.size for b in blocks)])
    whole = np.add.reduceat(found, ends[:-1], axis=1)
    np.testing.assert_allclose(whole, likelihood.per_recording(theta), rtol=1e-9)
    monkeypatch.setattr(half_cycles, "_CHUNK_SAMPLES", 1)
    np.testing.assert_allclose(log_likelihood(likelihood, theta, blocks), found, rtol=1e-12)
    monkeypatch.setattr(half_cycles, "MOST_BLOCKS", 10)  # of three recordings
    fewer = half_cycle_blocks(likelihood, theta[0])
    assert all(b.first.size <= 3 for b in fewer)
    total = log_likelihood(likelihood, theta, fewer).sum(axis=1)
    np.testing.assert_allclose(total, likelihood(theta), rtol=1e-9)


def test_a_part_is_the_density_of_its_samples_between_two_passages_through_rest() -> None:
    likelihood, theta = build(NOISES["white"])
    (blocks, *_), o = half_cycle_blocks(likelihood, theta[0]), likelihood.oscillator
    values = log_likelihood(likelihood, theta, half_cycle_blocks(likelihood, theta[0]))[1]
    sigma = theta[1, o.layout.index("sigma")]
    each = stats.norm(o.predict(theta[1])[0], sigma).logpdf(o.campaign.recordings[0].samples)
    displacement = o.displacements(theta[0])[0]
    edges = [*blocks.first, displacement.size]
    assert 10 < len(edges) < 16  # 0.6 s of 8 to 12 Hz
    for k, (a, b) in enumerate(pairwise(edges)):
        assert values[k] == pytest.approx(each[a:b].sum(), rel=1e-10)
        assert np.ptp(np.sign(displacement[a:b])) == 0


def test_no_motion_no_density() -> None:
    likelihood, theta = build(NOISES["white"])
    blocks = half_cycle_blocks(likelihood, theta[0])
    theta[1, likelihood.oscillator.layout.index("sigma")] = -1.0
    found = log_likelihood(likelihood, theta, blocks)
    assert (found[1] == -np.inf).all() and np.isfinite(found[[0, 2, 3]]).all()
