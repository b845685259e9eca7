"""What a probe reads: a displacement or a time derivative of it, along a line or about an axis.

The one place that says so. A quantity has an order, that of the time derivative: the model predicts
a reading as this derivative of the displacement plus the probe's offset, and whatever reads a
recording asks for the order or for the unit.
"""

from __future__ import annotations

import math
import re
from typing import Literal

from bayesimpact.errors import InputError

Quantity = Literal[
    "displacement",
    "velocity",
    "acceleration",
    "angle",
    "angular_velocity",
    "angular_acceleration",
]
QUANTITIES: tuple[Quantity, ...] = (
    "displacement", "velocity", "acceleration", "angle", "angular_velocity", "angular_acceleration",
)  # fmt: skip
#: Standard acceleration of free fall, m/s2 (ISO 80000-3).
STANDARD_GRAVITY = 9.80665
_DEGREE = math.pi / 180.0
UNITS: dict[str, tuple[Quantity, float]] = {
    "m": ("displacement", 1.0),
    "cm": ("displacement", 1e-2),
    "mm": ("displacement", 1e-3),
    "um": ("displacement", 1e-6),
    "rad": ("angle", 1.0),
    "deg": ("angle", _DEGREE),
    "m/s": ("velocity", 1.0),
    "cm/s": ("velocity", 1e-2),
    "mm/s": ("velocity", 1e-3),
    "um/s": ("velocity", 1e-6),
    "m/s2": ("acceleration", 1.0),
    "cm/s2": ("acceleration", 1e-2),
    "mm/s2": ("acceleration", 1e-3),
    "g": ("acceleration", STANDARD_GRAVITY),
    "rad/s": ("angular_velocity", 1.0),
    "deg/s": ("angular_velocity", _DEGREE),
    "rad/s2": ("angular_acceleration", 1.0),
    "deg/s2": ("angular_acceleration", _DEGREE),
}
"""Unit of a file -> quantity and factor to SI."""
RESPONSE_COLUMNS = {f"{q}_{unit.replace('/', '_')}": unit for unit, (q, _) in UNITS.items()}
"""Name of a column, as velocity_mm_s -> its unit."""


def order_of(quantity: Quantity) -> int:
    """Of the time derivative: 0 for a displacement or an angle, 1, 2."""
    return QUANTITIES.index(quantity) % 3


def is_angular(quantity: Quantity) -> bool:
    """True for motion about an axis."""
    return QUANTITIES.index(quantity) >= 3


def unit_of(quantity: Quantity) -> str:
    """SI unit of a quantity."""
    return next(unit for unit, (q, factor) in UNITS.items() if q == quantity and factor == 1.0)


def units_of(quantity: Quantity) -> tuple[str, ...]:
    """Units in which files may hold a quantity."""
    return tuple(unit for unit, (q, _) in UNITS.items() if q == quantity)


def units_like(unit: str) -> dict[str, float]:
    """Factor to SI of every unit of a unit's quantity; nothing for what is none of `UNITS`."""
    own = UNITS.get(unit, (None,))[0]
    return {other: factor for other, (quantity, factor) in UNITS.items() if quantity == own}


def with_article(quantity: Quantity) -> str:
    """As in "a displacement", "an angular velocity"."""
    words = quantity.replace("_", " ")
    return f"an {words}" if words[0] == "a" else f"a {words}"


def check_quantity(where: str, asked: Quantity | None, found: Quantity) -> None:
    """Refuse readings that are of another quantity than campaign.toml says; raises InputError."""
    if asked is not None and asked != found:
        accepted = f'"{found}", or a unit of {", ".join(units_of(asked))}'
        said = f'"{asked}" for readings in a unit of {with_article(found)}'
        raise InputError(where, said, accepted)


def reading_unit(unit: str, order: int) -> str:
    """Unit, from one for displacements in m and s, of a parameter that acts on readings.

    A length becomes the order-th derivative of one: for a velocity m/s becomes m/s2, 1/m s/m.
    """
    powers = {"m": 0, "s": 0}
    for part, sign in zip(unit.split("/", 1), (1, -1), strict=False):
        for symbol, power in re.findall(r"([a-zA-Z]+)(-?\d*)", part):
            if symbol not in powers:
                return unit
            powers[symbol] += sign * int(power or 1)
    powers["s"] -= order * powers["m"]
    top = " ".join(_powered(s, p) for s, p in powers.items() if p > 0)
    bottom = " ".join(_powered(s, -p) for s, p in powers.items() if p < 0)
    return f"{top or '1'}/{bottom}" if bottom else top or "1"


def _powered(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}{power}"
