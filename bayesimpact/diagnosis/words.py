"""The diagnosis in words that a lab person understands."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayesimpact.diagnosis.force import trajectory_points
from bayesimpact.diagnosis.locate import Location
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales
from bayesimpact.model.parameters import instance_name

IN_CONTACT = ("contact", "entry", "exit")
_REGIMES = {
    "free": "in the suspension, wherever the mass moves",
    "contact": "in contact with the obstacle",
    "entry": "where contact begins",
    "exit": "where contact ends",
    "everywhere": "throughout the motion",
    "measurement": "in the measuring chain, not in the mechanics",
}


def statement(effect: Effect, size: str, share: float, shift: Mapping[str, float]) -> str:
    """One sentence on an effect: what it is, how large, what ignoring it did (where known)."""
    text = effect.statement.format(size=size, share=f"{100 * share:.2g} %")
    if not shift:
        return text
    worst = max(shift, key=lambda name: abs(shift[name]))
    return f"{text} Ignoring it moved {worst} by {shift[worst]:+.1f} of its standard deviations."


def sizes(effect: Effect, before: Fit, after: Fit, scales: Scales) -> tuple[str, float]:
    """Size of an effect as text (a force, where it has one) and relative to its yardstick."""
    parameters = after.target.oscillator.layout.parameters
    values = {
        n.split(".", 1)[1]: (float(v), p.unit)
        for n, v, p in zip(after.names, after.mode, parameters, strict=True)
        if n.startswith(effect.id + ".")
    }
    yardstick = scales.contact_force if effect.regime in IN_CONTACT else scales.force
    if effect.law is not None and effect.law.rate is None:
        peak = peak_force(effect, after)
        return f"{peak:.2g} {_force_unit(after)}", peak / yardstick
    if "force" in values:
        return f"{values['force'][0]:.2g} {values['force'][1]}", values["force"][0] / yardstick
    change = np.concatenate([a - b for a, b in zip(after.predicted, before.predicted, strict=True)])
    reach = float(np.max(np.abs(change)))
    text = ", ".join(f"{name} {v:.3g} {unit}" for name, (v, unit) in list(values.items())[:4])
    return text or f"{1e6 * reach:.2g} um of trajectory", reach / scales.amplitude


def peak_force(effect: Effect, fit: Fit, points: int = 2000) -> float:
    """Largest force of an effect's law along the fitted motion, N."""
    assert effect.law is not None
    layout = fit.target.oscillator.layout
    known = dict(zip(fit.names, fit.mode, strict=True))
    largest = 0.0
    for r, ((y, v), recording) in enumerate(
        zip(trajectory_points(fit), fit.target.oscillator.campaign.recordings, strict=True)
    ):
        q = layout.slots(fit.mode)[r]
        keys = {"campaign": None, "case": recording.case, "recording": recording.name}
        p = [
            x.fixed if x.fixed is not None else known[instance_name(effect, x, keys[x.scope])]
            for x in effect.parameters
        ]
        step = max(1, y.size * len(layout.columns) // points)
        for i in range(0, y.size, step):
            d = y[i] - q[3]
            if effect.law.where == "everywhere" or d > 0:
                t, touching = i * recording.interval, float(d > 0)
                force = effect.law.force(y[i], v[i], d, t, 0.0, touching, p, q)
                largest = max(largest, abs(float(force)))
    return largest


def _force_unit(fit: Fit) -> str:
    angle = fit.target.oscillator.campaign.recordings[0].quantity == "angle"
    return "N m" if angle else "N"


def parameter_shifts(before: Fit, after: Fit) -> dict[str, float]:
    """Shifts of shared parameters that the added physics undid, in the base fit's deviations."""
    new = dict(zip(after.names, after.mode, strict=True))
    physical = before.target.oscillator.layout.roles("physical")
    return {
        before.names[i]: float((before.mode[i] - new[before.names[i]]) / before.sd[i])
        for i in physical
        if before.names[i] in new
    }


def summary(
    verdict: str,
    effects: tuple[Effect, ...],
    statements: tuple[str, ...],
    location: Location | None,
    alternatives: tuple[str, ...],
    shifts: Mapping[str, float],
    detectable: str,
    remains: str = "",
    *,
    angle: bool = False,
) -> str:
    """One paragraph; `remains` says what is left beside the named effects."""
    if verdict == "adequate":
        found = "Nothing is missing: the base model describes the recordings down to the noise."
        return f"{found} {detectable}".strip()
    assert location is not None
    place = _REGIMES[location.regime]
    stiffness = [name for name in shifts if name.startswith("k2")] or list(shifts)
    worst = max(stiffness, key=lambda n: abs(shifts[n]), default="")
    cost = (
        f" It had moved {worst} by {abs(shifts[worst]):.1f} of its standard deviations."
        if worst
        else ""
    )
    if verdict == "unknown":
        scale, length, force = (1.0, "rad", "N m") if angle else (1e3, "mm", "N")
        low, high = (scale * x for x in location.displacement)
        return (
            f"Something is missing that the catalogue does not hold. It acts {place}, mostly "
            f"between {low:.2f} and {high:.2f} {length}, with {location.force_rms:.2g} {force} "
            f"rms.{cost}"
        )
    titles = " and ".join(e.title for e in effects)
    if verdict == "ambiguous":
        others = ", ".join(alternatives)
        return (
            f"Something is missing {place}; the likeliest is {titles}, but the recordings cannot "
            f"tell it from {others}.{cost}"
        )
    return f"The base model leaves out {titles}, {place}. {' '.join(statements)}{cost}{remains}"
