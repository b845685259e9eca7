"""Random rigs under a measured input, recorded by an independent integrator in any quantity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from driven_twin import QUANTITIES, Law, driven_states, no_law

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input, Kind
from bayesimpact.data.recording import Recording

INPUTS = ("sweep", "steps", "noise", "base")
SAMPLES = 1500
NOISE = 3e-3  # of the standard deviation of the readings
_STATES: dict[object, np.ndarray] = {}  # of rigs met before: readings in any quantity share them


@dataclass(frozen=True, eq=False)
class DrivenRig:
    """A campaign of one recording, and how it came about.

    Attributes
    ----------
    truth : parameter name -> value, SI
    displacement : (n,) m, relative to a base
    noise : standard deviation, in the reading's unit
    """

    campaign: Campaign
    truth: dict[str, float]
    displacement: np.ndarray
    noise: float


def driven_rig(
    seed: int, quantity: Any, law: Law = no_law, *, corner: bool = False, kind: str = ""
) -> DrivenRig:
    """A rig drawn by its seed: inputs in turn, four with a stop, four without, ...

    law, corner : a concealed force, as `driven_twin.driven_motion` takes it
    kind : of the input; "" takes it from the seed
    """
    rng = np.random.default_rng(seed)
    kind, stop = kind or INPUTS[seed % len(INPUTS)], seed // len(INPUTS) % 2 == 0
    mass, hertz = rng.uniform(0.2, 2.0), rng.uniform(3.0, 12.0)
    k1 = mass * (2 * np.pi * hertz) ** 2
    dt = 1.0 / hertz / rng.uniform(40.0, 80.0)
    reach = 3e-3
    values = {
        "mass": mass, "k1": k1, "c1": 2 * rng.uniform(0.005, 0.03) * np.sqrt(mass * k1),
        "y0": 0.1 * reach * rng.standard_normal(),
        "v0": 0.1 * reach * 2 * np.pi * hertz * rng.standard_normal(),
    }  # fmt: skip
    if stop:
        values["g"] = rng.uniform(0.15, 0.4) * reach
        values["k2"] = rng.uniform(2.0, 8.0) * k1
        values["c2"] = 2 * rng.uniform(0.02, 0.08) * np.sqrt(mass * values["k2"])
    gain = 1.0 if kind == "base" else rng.uniform(0.5, 2.0)
    given = _input(kind, hertz, dt, reach, values, rng)
    key = seed, law, corner, kind
    if key not in _STATES:
        _STATES[key], _ = driven_states(values, given.force(mass, dt), dt, law, corner)
        _STATES[key].setflags(write=False)
    states = _STATES[key]
    exact = states[QUANTITIES.index(quantity)]
    noise = NOISE * float(np.std(exact))
    offset = 2.0 * noise
    samples = exact + given.carried(dt, QUANTITIES.index(quantity))
    samples = samples + offset + noise * rng.standard_normal(SAMPLES)
    if gain != 1.0:
        given = Input(given.samples / gain, given.kind, free=True)
    recording = Recording("a", "1" if stop else "", samples, dt, quantity=quantity, input=given)
    truth = {k: v for k, v in values.items() if k not in ("mass", "k2")}
    truth = {f"{k}[a]" if k in ("y0", "v0") else k: v for k, v in truth.items()}
    truth |= {"offset[a]": offset} | ({"k2[1]": values["k2"]} if stop else {})
    truth |= {"input_gain": gain} if gain != 1.0 else {}
    campaign = Campaign("rig", mass, (recording,), stop=stop)
    return DrivenRig(campaign, truth, states[0], noise)


def _input(
    kind: str, hertz: float, dt: float, reach: float, values: dict[str, float],
    rng: np.random.Generator,
) -> Input:  # fmt: skip
    """An input under which the mass moves about `reach`, m."""
    times, k1 = np.arange(SAMPLES) * dt, values["k1"]
    end = times[-1]
    if kind == "sweep":
        phase = 2 * np.pi * hertz * (0.4 * times + 0.7 * times**2 / end)
        return Input(0.5 * k1 * reach * np.sin(phase))
    if kind == "steps":
        return Input(0.6 * k1 * reach * (np.floor(times * hertz / 3.3) % 2))
    white = np.convolve(rng.standard_normal(SAMPLES + 20), np.hanning(11), "same")[10:-10]
    if kind == "noise":
        return Input(k1 * reach * white / np.std(white) * 0.8)
    lines = hertz * np.array([0.45, 0.8, 0.93, 1.1, 1.5])
    phases = rng.uniform(0.0, 2 * np.pi, lines.size)
    angle = 2 * np.pi * np.multiply.outer(times, lines) + phases
    base = 0.05 * reach * np.sin(angle).sum(axis=1)
    own: Kind = "base_m"
    return Input(base, own, absolute=True)
