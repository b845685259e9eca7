"""How large an effect is, in a unit that a lab person can hold against something."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.residual_force.gaussian_process import trajectory_points
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Law, Numbers, Scales, Size
from bayesimpact.model.parameters import SLOTS, instance_name, unit_for
from bayesimpact.model.units import two_digits

Array = NDArray[np.float64]
_GAP = SLOTS.index("g")
IN_CONTACT = ("contact", "entry", "exit")
POINTS = 2000  # of all recordings, at which a force is looked at
_SHARE = re.compile(r"\{share\} of ([^).]+)")  # in an effect's statement


def size_in_words(effect: Effect, before: Fit, after: Fit, scales: Scales) -> tuple[str, float]:
    """Size of an effect as text, and relative to what it should be held against."""
    value, unit, share = size(effect, before, after, scales)
    return two_digits(value, unit_for(after.density.oscillator.campaign, effect, unit)), share


def size(effect: Effect, before: Fit, after: Fit, scales: Scales) -> Size:
    """Size, its unit for displacements, and share.

    As the effect itself defines it; else the peak of its force along the motion, over the peak
    elastic force of spring or obstacle; else the largest change of the readings, over the
    amplitude: its own, or where it has none that of the fit.
    """
    if effect.size is not None:
        own = [float(v) for n, v in _values(after).items() if n.startswith(f"{effect.id}.")]
        return effect.size(own, scales)
    if effect.law is not None:
        peak = peak_force(effect, after)
        yardstick = scales.contact_force if effect.regime in IN_CONTACT else scales.force
        return peak, "N", peak / yardstick
    if effect.observe is not None:
        change = largest_change(effect, after)
        return change, "m", change / scales.largest_reading
    derived = not after.density.oscillator.reads_displacements
    both = [f.displacements if derived else f.predicted for f in (after, before)]
    change = max(float(np.abs(a - b).max()) for a, b in zip(*both, strict=True))
    return change, "m", change / scales.amplitude


def _values(fit: Fit) -> Mapping[str, float]:
    return dict(zip(fit.names, fit.mode, strict=True))


def yardstick(effect: Effect) -> str:
    """What the share of an effect's size refers to, in the words of its own sentence."""
    told = _SHARE.search(effect.statement)
    if told or effect.size is not None:
        return told[1] if told else ""
    if effect.law is None:
        return "the amplitude"
    contact = effect.regime in IN_CONTACT
    return f"the peak elastic force of the {'obstacle' if contact else 'suspension'}"


def effect_numbers(effect: Effect, fit: Fit, r: int) -> list[float]:
    """The effect's parameters in its own order, as recording r has them."""
    known, recording = _values(fit), fit.density.oscillator.campaign.recordings[r]
    keys = {"campaign": None, "case": recording.case, "recording": recording.name}
    return [
        x.fixed if x.fixed is not None else known[instance_name(effect, x, keys[x.scope])]
        for x in effect.parameters
    ]


def largest_change(effect: Effect, fit: Fit) -> float:
    """How far an effect of the measuring chain changes any reading, in the reading's unit."""
    assert effect.observe is not None
    largest = 0.0
    for r, y in enumerate(fit.readings):
        t = (
            np.arange(y.size, dtype=np.float64)
            * fit.density.oscillator.campaign.recordings[r].interval
        )
        p = np.array([effect_numbers(effect, fit, r)])
        largest = max(largest, float(np.abs(effect.observe(y[None], t, p) - y).max()))
    return largest


def peak_force(effect: Effect, fit: Fit) -> float:
    """Largest force of an effect's law along the fitted motion, N."""
    assert effect.law is not None
    slots = fit.density.oscillator.layout.slots(fit.mode)
    largest = 0.0
    for r, (y, v) in enumerate(trajectory_points(fit)):
        times = np.asarray(fit.density.oscillator.campaign.recordings[r].times)
        few = slice(0, y.size, max(1, y.size * len(slots) // POINTS))
        numbers = effect_numbers(effect, fit, r), slots[r]
        force = force_along(effect.law, y[few], v[few], times[few], *numbers)
        largest = max(largest, float(np.abs(force).max()))
    return largest


def force_along(law: Law, y: Array, v: Array, t: Array, p: Numbers, q: Array) -> Array:
    """Force of a law without memory at displacements, velocities and times (n,), N."""
    found = np.zeros(y.size)
    for i in range(y.size):
        d = y[i] - q[_GAP]
        if law.where == "everywhere" or d > 0:
            place = y[i], v[i], d, t[i]
            z = branch(law, *place, float(d > 0), p, q)
            found[i] = law.force(*place, z, float(d > 0), p, q)
    return found


def branch(
    law: Law, y: float, v: float, d: float, t: float, touching: float, p: Numbers, q: Array
) -> float:
    """The state of a law whose force jumps: direction of the motion, side of its surface, or of a
    law that has both the direction where the surface is above zero.
    """
    direction = float(np.sign(v)) if law.jump_at_turn else 0.0
    if law.jump_at_surface and law.surface is not None:
        side = float(np.sign(law.surface(y, v, d, t, 0.0, touching, p, q)))
        return (direction if side > 0.0 else 0.0) if law.jump_at_turn else side
    return direction
