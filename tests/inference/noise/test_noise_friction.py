"""Dry friction is no noise: accelerations jump and velocities bend where the motion turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from driven_rigs import driven_rig

from bayesimpact.inference.noise.estimate import estimate_noise, unfiltered_noise
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

LEVELS = {"velocity": 2e-4, "acceleration": 1e-2}
SEEDS = 6
RIGS = {
    "stop": (small_rig.RIG, small_rig.RELEASES),
    "no stop": (small_rig.PLAIN, small_rig.PLAIN_RELEASES),
}


def _z(name: str, quantity, rate: float, force: float) -> np.ndarray:
    """Errors of the level in their standard errors, over seeds; found white throughout."""
    rig, releases = RIGS[name]
    campaign = small_rig.record(
        effects={"coulomb_friction": {"force": force}} if force else None,
        rig=rig, releases=releases, chain=MeasuringChain(), rate=rate, duration=4.0,
        quantity=quantity,
    )  # fmt: skip
    level, z = LEVELS[quantity], []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        found = unfiltered_noise(
            [
                replace(r, samples=r.samples + level * rng.standard_normal(r.samples.size))
                for r in campaign.recordings
            ]
        )
        assert found.correlation == 0.0 and found.level_error < 0.15
        z.append((found.level / level - 1) / found.level_error)
    return np.array(z)


@pytest.mark.parametrize(
    ("name", "quantity", "rate", "force"),
    [
        ("stop", "acceleration", 200.0, 0.03),  # 5.1 times the truth across turning points
        ("stop", "acceleration", 300.0, 0.1),  # 12
        ("stop", "velocity", 200.0, 0.1),  # 12
        ("stop", "velocity", 1000.0, 0.3),  # 9
        ("no stop", "acceleration", 200.0, 0.03),  # 2.7
        ("no stop", "acceleration", 1000.0, 0.01),  # 1.16, and coloured
        ("no stop", "acceleration", 400.0, 0.0),
        ("stop", "velocity", 400.0, 0.0),
    ],
)
def test_the_level_beside_dry_friction(name, quantity, rate, force):
    z = _z(name, quantity, rate, force)
    assert abs(z.mean()) < 4 / np.sqrt(SEEDS) and np.abs(z).max() < 4.0


@pytest.mark.parametrize(("seed", "share"), [(1, 0.003), (3, 0.01), (7, 0.03)])
def test_the_level_beside_dry_friction_under_an_input(seed, share):
    """`share` of the spring's force; 1.3, 4.8 and 12 times the truth across turning points."""
    rig = driven_rig(seed, "acceleration")
    friction = next(e for e in EFFECTS if e.id == "coulomb_friction")
    oscillator = build_oscillator(rig.campaign, (friction,))
    values = {**rig.truth, "sigma": 1.0, "coulomb_friction.force": share * rig.truth["k1"] * 3e-3}
    (readings,) = oscillator.predict(np.array([values[n] for n in oscillator.layout.names]))
    rng = np.random.default_rng(seed)
    samples = readings + rig.noise * rng.standard_normal(readings.size)
    recording = replace(rig.campaign.recordings[0], samples=samples)
    noise = estimate_noise(replace(rig.campaign, recordings=(recording,)))
    assert noise.level == pytest.approx(rig.noise, rel=0.15)
    assert noise.correlation == 0.0
