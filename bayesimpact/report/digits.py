"""How many digits an estimate is told with: one rule for the page, LaTeX, figures and notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, isfinite, log10
from typing import Any

from bayesimpact.model.units import decimals, number, readable, span, typeset, without_zero

ALIKE = 10.0  # intervals that differ by less are told with the same digits
MOST = 6
"""Digits of a number beyond which the second one of its interval's half-width is left out."""

Interval = Sequence[float]
"""Both ends of a 90 % interval, SI."""


@dataclass(frozen=True)
class Digits:
    """How all numbers of one parameter are written.

    Attributes
    ----------
    scale, unit : multiply by `scale`, write `unit`
    places : decimals
    """

    scale: float
    unit: str
    places: int

    def value(self, x: float) -> str:
        """One number, SI, without its unit."""
        return number(x * self.scale, self.places)

    def interval(self, ends: Interval) -> str:
        """Both ends of an interval, SI, without the unit."""
        return span(ends[0], ends[1], self.scale, self.places)

    def estimate(self, median: float, ends: Interval) -> str:
        """Median, interval and unit: "5349.0 (5348.2 to 5349.8) N/m"."""
        return f"{self.value(median)} ({self.interval(ends)}) {typeset(self.unit)}".rstrip()


def digits(
    unit: str, median: float, ends: Interval, others: Sequence[Mapping[str, Any]] = ()
) -> Digits:
    """Digits of an estimate: those that the half-width of its 90 % interval allows.

    Parameters
    ----------
    unit : SI
    median, ends : of the estimate, SI
    others : further estimates of the same parameter (`median`, `ci90`), as of the base model. All
        have one unit, and as many digits as the widest interval allows unless it is of another
        order
    """
    half = _half(ends)
    sizes = [abs(median), half, *(abs(other["median"]) for other in others)]
    shown = readable(unit, max(sizes))
    widest = max([half, *(h for h in (_half(o["ci90"]) for o in others) if h < ALIKE * half)])
    return Digits(
        shown.scale,
        shown.unit,
        _places(widest * shown.scale, sizes[0] * shown.scale, [x * shown.scale for x in ends]),
    )


def places(median: float, ends: Interval) -> int:
    """Decimals of an estimate that stands by itself, in the unit in which it is shown."""
    return _places(_half(ends), abs(median), ends)


def _places(half: float, size: float, ends: Interval) -> int:
    """One or two digits of a half-width, as `decimals` has it; one where a number of that size
    would have more than `MOST`.
    """
    chosen = decimals(half)
    if half > 0 and size > 0 and isfinite(size) and chosen + floor(log10(size)) + 1 > MOST:
        chosen = decimals(half, 1)
    return without_zero(chosen, *ends)


def _half(ends: Interval) -> float:
    return 0.5 * (ends[1] - ends[0])
