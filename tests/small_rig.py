"""A small impact rig, recorded by the independent generator: three releases, two obstacles, 2 s."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np

from bayesimpact.data.campaign import Campaign, Measurement
from bayesimpact.data.quantity import Quantity
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.parameters import Layout
from bayesimpact.trial.rig import recordings as generator
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.motion import RigMotion
from bayesimpact.trial.rig.recordings import Effects, Release, Rig, make_campaign, motion

RIG = Rig(
    mass=0.503,
    c1=0.148,
    k1=808.556,
    c2=2.085,
    g=1.1e-3,
    k2={"1": 5350.156, "2": 2959.249},
)
RELEASES = (
    Release("a", "1", -6.5e-3, 1e-3),
    Release("b", "1", -4.5e-3),
    Release("c", "2", -5.5e-3, -2e-3),
)
OFFSETS = {"a": 1e-5, "b": -2e-5, "c": 0.0}
NOISE = 5e-6
PLAIN = Rig(mass=0.503, c1=0.148, k1=808.556)  # without a stop
PLAIN_RELEASES = (Release("a", "", -6.5e-3, 1e-3), Release("b", "", 4.5e-3))


_MOTIONS: dict[str, RigMotion] = {}


def _once(rig: Rig, release: Release, effects: Effects, **how: Any) -> RigMotion:
    """The motion of a release; a campaign with another seed has the same under its noise."""
    key = repr((rig, release, effects, how))
    if key not in _MOTIONS:
        _MOTIONS[key] = motion(rig, release, effects, **how)
        for array in (getattr(_MOTIONS[key], n) for n in ("displacement", "velocity")):
            array.flags.writeable = False
    return _MOTIONS[key]


def record(
    seed: int = 1,
    effects: Effects | None = None,
    *,
    rig: Rig = RIG,
    releases: Sequence[Release] = RELEASES,
    chain: MeasuringChain | None = None,
    rate: float = 1000.0,
    duration: float = 2.0,
    measurement: Measurement | None = None,
    quantity: Quantity = "displacement",
) -> Campaign:
    """Record a campaign; white noise of 5 um and rest readings by default."""
    with patch.object(generator, "motion", _once):
        return make_campaign(
            "small rig",
            rig,
            releases,
            effects,
            chain or MeasuringChain(noise=NOISE, offsets=OFFSETS),
            rate=rate,
            duration=duration,
            rng=np.random.default_rng(seed),
            measurement=measurement,
            quantity=quantity,
        )


def with_slow(campaign: Campaign, seed: int, size: float, correlation: float = 0.95) -> Campaign:
    """The recordings with AR(1) noise of `size` times their white noise on top."""
    rng, slow = np.random.default_rng(seed + 1000), Noise(correlation)
    more = [
        slow.coloured(rng, r.samples.size, r.interval, size * NOISE) for r in campaign.recordings
    ]
    pairs = zip(campaign.recordings, more, strict=True)
    recordings = tuple(replace(r, samples=r.samples + noise) for r, noise in pairs)
    return replace(campaign, recordings=recordings)


def motion_of(number: int, rate: float = 1000.0, duration: float = 2.0) -> RigMotion:
    """The true motion of one release of `RIG`."""
    return motion(RIG, RELEASES[number], rate=rate, duration=duration)


def true_values(
    rig: Rig = RIG, releases: Sequence[Release] = RELEASES, offsets: dict[str, float] = OFFSETS
) -> dict[str, float]:
    """Parameter name -> what was recorded."""
    values = {"c1": rig.c1, "k1": rig.k1, "sigma": NOISE}
    if rig.k2:
        values |= {"c2": rig.c2, "g": rig.g}
        values |= {f"k2[{case}]": k2 for case, k2 in rig.k2.items()}
    for release in releases:
        values |= {f"y0[{release.name}]": release.y0, f"v0[{release.name}]": release.v0}
        values[f"offset[{release.name}]"] = offsets.get(release.name, 0.0)
    return values


def vector(layout: Layout, values: dict[str, float]) -> np.ndarray:
    """Parameter vector (d,) from values by name."""
    return np.array([values[name] for name in layout.names])
