"""The diagnosis in words that a lab person understands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesimpact.diagnosis.faults.compare import base_failed
from bayesimpact.diagnosis.locate import Location
from bayesimpact.diagnosis.remainder import Remainder
from bayesimpact.diagnosis.size import amount, two_digits
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect

SHARED = ("k2", "k1", "c1", "c2", "g")

_REGIMES = {
    "free": "in the suspension, wherever the mass moves",
    "contact": "in contact with the obstacle",
    "entry": "where contact begins",
    "exit": "where contact ends",
    "everywhere": "throughout the motion",
    "measurement": "in the measuring chain, not in the mechanics",
}


def statement(effect: Effect, size: str, share: float) -> str:
    """One sentence on an effect: what it is and how large."""
    return effect.statement.format(size=size, share=f"{100 * share:.2g} %")


def parameter_shifts(
    before: Mapping[str, Mapping[str, Any]], after: Mapping[str, Mapping[str, Any]]
) -> dict[str, float]:
    """By how much the base fit had shared parameters too high, as shares of their values after.

    Those whose intervals overlap tell nothing and are left out.
    """
    shifts = {}
    for name, old in before.items():
        new = after.get(name)
        if new is None or name.split("[")[0] not in SHARED or not new["median"]:
            continue
        apart = old["ci90"][0] > new["ci90"][1] or old["ci90"][1] < new["ci90"][0]
        if apart:
            shifts[name] = float((old["median"] - new["median"]) / abs(new["median"]))
    return shifts


def remaining(left: Remainder | None, unit: str = "m") -> str:
    """What is left, in a sentence; empty where nothing is. `unit` is that of the readings."""
    if left is None:
        return ""
    place = _REGIMES[left.regime]
    guess = left.guess.replace("_", " ")
    size = "smaller than the noise"
    if left.rms > 0.0:
        size = (
            f"{amount(left.rms, unit)} rms, {two_digits(100 * left.share)} % of the signal and "
            f"{two_digits(left.over_noise)} times the noise with it"
        )
    return (
        f" Something remains: {size}, {place}; the next guess is {guess}. "
        "The intervals allow for it."
    )


def failure(fit: Fit) -> str:
    """A sentence where the base model leaves more than half of the signal; else empty."""
    if not base_failed(fit):
        return ""
    reasons = ["a wrong sign, unit or clock of the recordings"]
    inputs = [r.input for r in fit.target.oscillator.campaign.recordings if r.input is not None]
    if inputs:
        wrong = "sign, delay or kind" if all(i.free for i in inputs) else "sign, scale or kind"
        hint = "" if all(i.free for i in inputs) else ' (gain = "free" lets the scale be found)'
        reasons.append(f"a wrong {wrong} of the input{hint}")
    reasons.append("a stop that is not there or not declared")
    return (
        "The base fit failed: it leaves more than half of the signal. Likely reasons are "
        f"{', '.join(reasons)}, or strong physics outside the base model. "
    )


def _moved(shifts: Mapping[str, float]) -> str:
    """What ignoring the missing physics did to the stiffest parameter, in per cent."""
    chosen = [n for n in shifts if n.startswith("k2")] or list(shifts)
    if not chosen:
        return ""
    worst = max(chosen, key=lambda n: abs(shifts[n]))
    share = 100 * shifts[worst]
    direction = "high" if share > 0 else "low"
    return f" Without it {worst} was {two_digits(abs(share))} % too {direction}."


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
    faults: str = "",
    angle: bool = False,
    drifts: bool = False,
) -> str:
    """One paragraph; `remains` says what is left beside the named effects, `faults` what was wrong
    with recordings.

    `drifts`: the likelier unknown force changes with time.
    """
    if verdict == "adequate":
        found = "Nothing is missing: the base model describes the recordings down to the noise."
        return f"{found} {detectable}".strip()
    if location is None:
        return f"Nothing is missing beside faults of the recordings:{faults} {detectable}".strip()
    place, cost = _REGIMES[location.regime], _moved(shifts)
    if verdict == "unknown" or (verdict == "partly" and not effects):
        scale, length, force = (1.0, "rad", "N m") if angle else (1e3, "mm", "N")
        low, high = (scale * x for x in location.displacement)
        slowly = " It is a stiffness or damping that changes with time." if drifts else ""
        return (
            f"Something is missing that the catalogue does not hold. It acts {place}, mostly "
            f"between {low:.2f} and {high:.2f} {length}, with {location.force_rms:.2g} {force} "
            f"rms.{slowly}{cost}{remains}{faults}"
        )
    titles = " and ".join(e.title for e in effects)
    if verdict == "ambiguous" and alternatives:
        others = ", ".join(alternatives)
        return (
            f"Something is missing {place}; the likeliest is {titles}, but the recordings cannot "
            f"tell it from {others}.{cost}{faults}"
        )
    if verdict == "partly":
        needed = "is needed" if len(effects) == 1 else "are needed"
        return (
            f"{titles[0].upper()}{titles[1:]} {needed} by every likely model, but something else "
            f"is missing too. {' '.join(statements)}{cost}{remains}{faults}"
        )
    return f"The base model leaves out {titles}, {place}. {' '.join(statements)}{cost}{faults}"
