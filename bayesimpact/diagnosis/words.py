"""The diagnosis in words that a lab person understands."""

from __future__ import annotations

from collections.abc import Mapping

from bayesimpact.diagnosis.locate import Location
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

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
    drifts: bool = False,
) -> str:
    """One paragraph; `remains` says what is left beside the named effects.

    `drifts`: the likelier unknown force changes with time.
    """
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
            f"rms.{' It is a stiffness or damping that changes with time.' if drifts else ''}{cost}"
        )
    titles = " and ".join(e.title for e in effects)
    if verdict == "ambiguous":
        others = ", ".join(alternatives)
        return (
            f"Something is missing {place}; the likeliest is {titles}, but the recordings cannot "
            f"tell it from {others}.{cost}"
        )
    return f"The base model leaves out {titles}, {place}. {' '.join(statements)}{cost}{remains}"
