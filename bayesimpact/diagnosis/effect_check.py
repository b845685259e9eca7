"""The checks that every effect of the catalogue passes, for effects of one's own.

A small rig (two obstacles, one release each) plays the effect at its null, at its scale, over the
middle of its priors, at other sampling rates, and without any other damping.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.inference.defaults import effect_prior
from bayesimpact.model.effects.effect import Effect, EffectParameter
from bayesimpact.model.oscillator import Oscillator, build_oscillator
from bayesimpact.model.own_effects import USUAL

Array = NDArray[np.float64]
Result = Literal["passed", "failed", "skipped"]

RIG = {"c1": 0.15, "k1": 800.0, "c2": 2.0, "g": 1.1e-3, "sigma": 1e-6}
STIFFNESSES, RELEASES = {"1": 6e3, "2": 4e3}, {"1": -6e-3, "2": -5e-3}
RATE, DURATION = 500.0, 1.5  # Hz, s
NULL = 1e-12  # m, rounding
STEPS = 1e-8  # m: what the simulator's own steps may leave; the catalogue stays below 1e-9
DRAWS = 40
MIDDLE = (0.1, 0.9)  # of the priors
ENERGY = 1e-7  # share of a cycle that rounding and steps may add to it
SMALL, SMOOTH = 1e-3, 0.02  # step of a derivative over the scale; how far two steps may disagree


@dataclass(frozen=True)
class Check:
    """One line of the table: which effect, what was checked, its result, and numbers."""

    effect: str
    name: str
    result: Result
    detail: str


def check_effect(effect: Effect) -> list[Check]:
    """All checks of an effect that `check_effects` of `model.own_effects` has accepted."""
    parts = (
        ("limit at the null value", _null),
        ("finite over the prior", _finite),
        ("sign of the energy", _energy),
        ("convergence of the steps", _steps),
        ("derivatives against differences", _derivatives),
    )
    words = ", ".join(f"{p.name} {p.unit}" for p in effect.parameters) or "no parameters"
    rows = [Check(effect.id, "units and declarations", "passed", words)]
    return rows + [Check(effect.id, name, *part(effect)) for name, part in parts]


Answer = tuple[Result, str]


def _model(effect: Effect | None, rate: float = RATE) -> Oscillator:
    count = round(DURATION * rate)
    recordings = tuple(Recording(f"r{c}", c, np.zeros(count), 1 / rate) for c in RELEASES)
    campaign = Campaign("check", USUAL.mass, recordings)
    return build_oscillator(campaign, () if effect is None else (effect,))


def _theta(oscillator: Oscillator, values: Mapping[str, float], **rig: float) -> Array:
    """Parameter vector of the rig with an effect's parameters, all instances alike."""
    known = {**RIG, **rig, **{f"k2[{case}]": k for case, k in STIFFNESSES.items()}}
    for case, y0 in RELEASES.items():
        known |= {f"y0[r{case}]": y0, f"v0[r{case}]": 0.0, f"offset[r{case}]": 0.0}
    names = oscillator.layout.names
    return np.array([known[n] if n in known else values[n.split("[")[0]] for n in names])


def _values(effect: Effect, choose: Callable[[EffectParameter], float]) -> dict[str, float]:
    """Number of every parameter; those that replace a base parameter stay at its value."""
    found = {}
    for p in effect.parameters:
        value = RIG[p.replaces] if p.replaces else choose(p)
        found[f"{effect.id}.{p.name}"] = min(max(value, p.lower), p.upper)
    return found


def _typical(p: EffectParameter) -> float:
    if p.circular:
        return 0.3
    null, scale = p.null or 0.0, p.scale(USUAL)
    return null - scale if null + scale > p.upper else null + scale


def _played(effect: Effect, values: Mapping[str, float], rate: float = RATE) -> Array:
    """Readings of both recordings, (2, n), m."""
    oscillator = _model(effect, rate)
    return np.stack(oscillator.predict(_theta(oscillator, values)))


def _null(effect: Effect) -> Answer:
    if not effect.has_size:
        return "skipped", "it is on or off"
    without = replace(effect, parameters=(), law=None, binds={}, observe=None)
    base = _model(without if effect.sets else None)  # what it sets holds at the null, too
    still = np.stack(base.predict(_theta(base, {})))
    values = _values(effect, lambda p: p.scale(USUAL) if p.null is None else p.null)
    away = float(np.abs(_played(effect, values) - still).max())
    return _verdict(away < NULL), f"{away:.1e} m away from the base model, at most {NULL:.0e}"


def _finite(effect: Effect) -> Answer:
    rng = np.random.default_rng(0)

    def drawn(p: EffectParameter) -> float:
        return float(effect_prior(p, USUAL).ppf(np.array(rng.uniform(*MIDDLE))))

    oscillator = _model(effect)
    thetas = [_theta(oscillator, _values(effect, drawn)) for _ in range(DRAWS)]
    finite = np.array([np.isfinite(y).all(axis=1) for y in oscillator.predict(np.array(thetas))])
    whole = int(finite.all(axis=0).sum())
    return _verdict(whole == DRAWS), f"{whole} of {DRAWS} motions from the middle of the prior"


def _energy(effect: Effect) -> Answer:
    if effect.energy in ("either", "none") or effect.observe is not None:
        return "skipped", f"energy: {effect.energy}"
    oscillator = _model(effect, 20 * RATE)
    theta = _theta(oscillator, _values(effect, _typical), c1=0.0, c2=0.0)
    turns = [_lower_turns(y) for y in oscillator.predict(theta)]
    if min(t.size for t in turns) < 3:
        return "failed", "no cycles without other damping, or numbers that are not finite"
    energies = [t / t[0] for t in turns]
    most = max(float(np.diff(s).max()) for s in energies)
    least = min(float(np.diff(s).min()) for s in energies)
    said = f"a cycle grows by {most:.1e} of it at most, and shrinks by {-least:.1e}"
    if effect.energy == "conserves":
        return _verdict(max(most, -least) < ENERGY), said
    loses = -least > ENERGY or not effect.has_size
    return _verdict(most < ENERGY and loses), said


def _lower_turns(y: Array) -> Array:
    """Turning points away from the obstacle, by parabolas through three samples, m."""
    i = np.flatnonzero((y[1:-1] < y[:-2]) & (y[1:-1] <= y[2:]) & (y[1:-1] < 0)) + 1
    left, here, right = y[i - 1], y[i], y[i + 1]
    return np.asarray(here - (right - left) ** 2 / (8 * (left - 2 * here + right)))


def _steps(effect: Effect) -> Answer:
    """Steps end on samples: the same motion at three rates shows what they leave."""
    if effect.observe is not None:
        return "skipped", "it does not change the motion"
    values = _values(effect, _typical)
    coarse = _played(effect, values)
    finer = [_played(effect, values, m * RATE)[:, ::m] for m in (3, 9)]
    away = max(float(np.abs(f - coarse).max()) for f in finer)
    said = f"{away:.1e} m between {RATE:g} and {9 * RATE:g} Hz, at most {STEPS:.0e}"
    return _verdict(away < STEPS), said


def _derivatives(effect: Effect) -> Answer:
    """Forward differences, as a fit takes them, against central ones of a smaller step."""
    sizes = [p for p in effect.parameters if p.is_size]
    if not sizes:
        return "skipped", "it is on or off"
    worst = 0.0
    values = _values(effect, _typical)
    for parameter in sizes:
        step, name = SMALL * parameter.scale(USUAL), f"{effect.id}.{parameter.name}"

        def at(shift: float, name: str = name) -> Array:
            return _played(effect, {**values, name: values[name] + shift})

        forward = (at(0.1 * step) - at(0.0)) / (0.1 * step)
        central = (at(step) - at(-step)) / (2 * step)
        worst = max(worst, float(np.abs(forward - central).max() / np.abs(central).max()))
    return _verdict(worst < SMOOTH), f"they differ by {100 * worst:.2g} %, at most {SMOOTH:.0%}"


def _verdict(good: bool) -> Result:
    return "passed" if good else "failed"
