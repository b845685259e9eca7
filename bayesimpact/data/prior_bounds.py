"""Priors of campaign.toml that cannot be meant: against what the recordings show, or too narrow.

The ranges reach far beyond what the recordings show, as far as the default priors do or further: a
prior outside them is a slip (a unit, an exponent) and no knowledge. A wide prior is never refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from bayesimpact.data.period import crossing_period
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError

FASTER, SLOWER = 10.0, 1e3
"""How far a natural frequency may lie from the recordings': a stop that is always in contact makes
them faster, so the suspension alone may be much slower."""
FARTHER = 100.0
"""How far a position may lie outside, in peak-to-peak motions."""
STIFFER = 1e6
"""How much stiffer than the suspension an obstacle may be."""
FINEST = 1e-12
"""Narrowest prior, relative to its centre: 4500 double-precision numbers (2.2e-16 apart) fit in."""
TAIL = 1e-6
"""Probability of a prior's tails that says nothing of where its author expects the parameter."""

_GAUSS = 4.9  # standard deviations that leave TAIL outside
_CAUCHY = 2.0 / (math.pi * TAIL)  # scales that do
_FROM_ZERO = {"halfnormal": _GAUSS, "halfcauchy": _CAUCHY}
Range = tuple[float, float]


def prior_names(stop: bool, recordings: Sequence[Recording]) -> list[str]:
    """Names a prior may carry: of one parameter, or of all that differ only in the brackets."""
    names = ["c1", "k1"]
    if any(r.input is not None and r.input.free for r in recordings):
        names.append("input_gain")
    if stop:
        names += ["c2", "g", "k2"]
        names += [f"k2[{case}]" for case in dict.fromkeys(r.case for r in recordings)]
    freed = [f"gain[{r.name}]" for r in recordings if r.free_gain]
    names += ["gain", *freed] if freed else []
    passed = [f"high_pass_state[{r.name}]" for r in recordings if r.high_pass]
    names += ["high_pass_state", *passed] if passed else []
    for family in ("y0", "v0", "offset", "sigma"):
        names += [family, *(f"{family}[{r.name}]" for r in recordings)]
    return names


def parameter_ranges(mass: float, recordings: Sequence[Recording]) -> dict[str, Range]:
    """Lowest and highest believable value, SI, by the parameter's name without its brackets."""
    periods = [crossing_period(r.samples, r.interval) or 0.5 * r.duration for r in recordings]
    omegas = 2.0 * np.pi / np.array(periods)
    slow, fast = float(omegas.min()) / SLOWER, float(omegas.max()) * FASTER
    reach = FARTHER * max(r.motion(rate) for r, rate in zip(recordings, omegas, strict=True))
    beyond = FARTHER * max(float(np.ptp(r.samples)) for r in recordings)
    readings = [edge for r in recordings for edge in (r.samples.min(), r.samples.max())]
    return {
        "k1": (mass * slow**2, mass * fast**2),
        "c1": (0.0, 2.0 * mass * fast),
        "k2": (mass * slow**2, mass * fast**2 * STIFFER),
        "c2": (0.0, 2.0 * mass * fast * math.sqrt(STIFFER)),
        "g": (-reach, reach),
        "y0": (-reach, reach),
        "v0": (-reach * fast, reach * fast),
        "offset": (float(min(readings)) - beyond, float(max(readings)) + beyond),
        "high_pass_state": (-beyond, beyond),
        "sigma": (FINEST * beyond, beyond),
        "gain": (1.0 / FARTHER, FARTHER),
    }


def check_prior(where: str, name: str, prior: dict[str, Any], ranges: dict[str, Range]) -> None:
    """Refuse a prior that leaves no room for numbers to differ, or none to `parameter_ranges`.

    Raises
    ------
    InputError : `where` names the prior's table
    """
    narrow, width, least = _width(prior)
    if width < least:
        accepted = f"{least:.3g} or more ({FINEST:g} of where it lies): numbers closer are the same"
        raise InputError(f"{where}, key {narrow}", f"a width of {width:.3g}", accepted)
    low, high = _reach(prior)
    lowest, highest = ranges.get(name.split("[")[0], (-math.inf, math.inf))
    if high < lowest or low > highest:
        key: str = next(k for k in ("mean", "median", "scale", "upper") if k in prior)
        key = "lower" if low > highest and "lower" in prior else key
        found = f"{prior[key]:g}, which expects {name} from {low:.3g} to {high:.3g} SI"
        accepted = f"a prior that reaches into {lowest:.3g} to {highest:.3g} SI: see the recordings"
        raise InputError(f"{where}, key {key}", found, accepted)


def _width(prior: dict[str, Any]) -> tuple[str, float, float]:
    """The key that makes a prior narrow, its width and the least that it may be."""
    kind = prior["distribution"]
    if kind in ("uniform", "loguniform"):
        lower, upper = prior["lower"], prior["upper"]
        return "upper", upper - lower, FINEST * max(abs(lower), abs(upper))
    if kind == "lognormal":
        return "sigma", prior["sigma"], FINEST
    if kind in _FROM_ZERO:
        return "scale", prior["scale"], 0.0
    centre, width = ("mean", "sd") if kind == "normal" else ("median", "scale")
    return width, prior[width], FINEST * abs(prior[centre])


def _reach(prior: dict[str, Any]) -> Range:
    """Where a prior expects its parameter, but for `TAIL`."""
    kind = prior["distribution"]
    if kind in ("uniform", "loguniform"):
        return prior["lower"], prior["upper"]
    if kind == "lognormal":
        factor = math.exp(_GAUSS * prior["sigma"])
        return prior["median"] / factor, prior["median"] * factor
    if kind in _FROM_ZERO:
        return 0.0, _FROM_ZERO[kind] * prior["scale"]
    if kind == "normal":
        return prior["mean"] - _GAUSS * prior["sd"], prior["mean"] + _GAUSS * prior["sd"]
    far = _CAUCHY * prior["scale"]
    return prior["median"] - far, prior["median"] + far
