"""Noise that grows with the motion, told by what a model leaves of few samples a period."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bayesimpact as bi
from bayesimpact.diagnosis.measurement.growing_noise import growing_noise
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify

STEP, NOISE, RATE = 0.1, 2.3e-3, 3.05  # s, m, 1/s: 20 samples a period


def fitted(folder: Path, seed: int, *, jitter: float = 0.0, cubic: float = 0.0) -> Fit:
    """The base model of a decay of 0.25 m whose time stamps jitter, or whose rate falls with its
    amplitude.
    """
    rng = np.random.default_rng(seed)
    stamp = STEP * np.arange(300)
    t = stamp + jitter * rng.standard_normal(stamp.size)
    amplitude = 0.25 * np.exp(-0.08 * t)
    phase = RATE * (t - cubic * (0.25**2 - amplitude**2) / 0.16)
    y = amplitude * np.cos(phase) + NOISE * rng.standard_normal(t.size)
    table = np.column_stack([stamp, y])
    np.savetxt(folder / "a.csv", table, delimiter=",", header="time_s,displacement_m", comments="")
    text = 'name = "a"\nmass_kg = 1.0\nstop = false\n[[recording]]\nfile = "a.csv"\n'
    (folder / "campaign.toml").write_text(text)
    return identify(bi.load(folder), rng=np.random.default_rng(0)).fit


@pytest.mark.parametrize("seed", [0, 1])
def test_stamps_that_jitter_are_told_and_how_much(tmp_path: Path, seed: int) -> None:
    """Unseen, quadratic drag beside them was named with a second mode excited by the release."""
    noise = growing_noise(fitted(tmp_path, seed, jitter=0.019))
    assert noise is not None
    size, rate = noise.growth
    assert size == 0.0 and rate * noise.level == pytest.approx(0.019, rel=0.3)
    assert noise.level == pytest.approx(NOISE, rel=0.25)


@pytest.mark.parametrize("seed", range(4))
def test_noise_that_is_alike_everywhere_does_not_grow(tmp_path: Path, seed: int) -> None:
    assert growing_noise(fitted(tmp_path, seed)) is None


@pytest.mark.parametrize("cubic", [0.2, 0.6, 2.0])
def test_what_a_spring_leaves_is_no_noise(tmp_path: Path, cubic: float) -> None:
    assert growing_noise(fitted(tmp_path, 2, cubic=cubic)) is None
