"""What a column may be, by its unit, name and numbers, where campaign.toml does not say."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from bayesimpact.data.quantity import UNITS, Quantity, order_of, units_of
from bayesimpact.data.readers.channel import Channel, words_of

_NAMES: dict[Quantity, frozenset[str]] = {
    "angular_velocity": frozenset(("gyro", "gyroscope", "winkelgeschwindigkeit")),
    "angle": frozenset(("angle", "theta", "winkel", "ángulo", "angulo", "angolo")),
    "acceleration": frozenset(
        ("acceleration", "accelerometer", "accel", "acc", "beschleunigung", "accélération",
         "aceleración", "aceleracion", "accelerazione")
    ),
    "velocity": frozenset(
        ("velocity", "speed", "vel", "geschwindigkeit", "vitesse", "velocidad", "velocità")
    ),
    "displacement": frozenset(
        ("displacement", "position", "deflection", "disp", "pos", "weg", "auslenkung",
         "déplacement", "desplazamiento", "posición", "posicion", "spostamento", "posizione")
    ),
}  # fmt: skip
"""Words of a name that say a quantity, in the languages of `Channel.is_time`."""
_AXIS = re.compile(r"^(|.*[\W_])[xyz]$")
_TURNING = frozenset(("angular", "rotational", "rotation", "angolare", "angulaire"))


def guessed_response(
    channels: Sequence[Channel], quantity: Quantity | None = None
) -> list[Channel]:
    """The channels that may be the response: those of the quantity that is wanted.

    Without one those with a unit of displacement or angle, else of a velocity, else acceleration.
    """
    known = [c for c in channels if not c.is_time and c.unit in UNITS]
    if quantity is not None:
        return [c for c in known if UNITS[c.unit][0] == quantity]
    orders = [order_of(UNITS[c.unit][0]) for c in known]
    return [c for c, order in zip(known, orders, strict=True) if order == min(orders)]


def clocks_of(channels: Sequence[Channel], channel: Channel) -> list[Channel]:
    """The columns of time stamps beside a channel."""
    beside = [c for c in channels if c.is_time and c.block == channel.block]
    return [c for c in beside if c.samples.size == channel.samples.size and c is not channel]


def nearest_clock(channels: Sequence[Channel], channel: Channel) -> Channel | None:
    """Of several columns of time stamps the last before the channel, as loggers pair them."""
    beside = clocks_of(channels, channel)
    order = list(channels)
    before = [c for c in beside if order.index(c) < order.index(channel)]
    return next(iter([*reversed(before), *beside]), None)


def named_response(channels: Sequence[Channel], quantity: Quantity | None = None) -> list[Channel]:
    """As `guessed_response`, by names: of channels whose unit the file does not state."""
    named = [(c, named_quantity(c.name)) for c in channels if not c.is_time and c.unit not in UNITS]
    known = [(c, q) for c, q in named if q is not None and quantity in (None, q)]
    least = min((order_of(q) for _, q in known), default=0)
    return [c for c, q in known if order_of(q) == least]


def other_responses(channels: Sequence[Channel]) -> list[Channel]:
    """What is left where neither unit nor name tells: no clock, and no count that never falls."""
    others = [c for c in channels if not c.is_time]
    return [c for c in others if not c.never_falls] or others


def quantity_of(channel: Channel) -> Quantity | None:
    """What a channel holds by its unit, else by its name; None where neither says."""
    return UNITS[channel.unit][0] if channel.unit in UNITS else named_quantity(channel.name)


def named_quantity(name: str) -> Quantity | None:
    """What a column's name says that it holds, as `Acceleration x` or `Winkel`."""
    words = set(words_of(name))
    found = next((quantity for quantity, names in _NAMES.items() if words & names), None)
    turned: dict[Quantity, Quantity] = {
        "velocity": "angular_velocity",
        "acceleration": "angular_acceleration",
        "displacement": "angle",
    }
    return turned.get(found, found) if found and words & _TURNING else found


def moving(channels: Sequence[Channel]) -> Channel:
    """The channel that shows a motion best, of several that may.

    Of the axes of one sensor, as `Acceleration x`, `... y`, the one that moves most: the motion is
    along it. Of others the first that moves at least half as much as any of its quantity: beside
    the response, which comes first, there may be a driver that moves more.
    """
    first = channels[0]
    alike = [c for c in channels if quantity_of(c) == quantity_of(first)]
    if first.unit not in UNITS:
        alike = [c for c in alike if c.unit == first.unit]
    alike = [c for c in alike if (c.unit in UNITS) == (first.unit in UNITS)]
    axes = [c for c in alike if _axis_of(c.name) == _axis_of(first.name) is not None]
    if len(axes) > 1:
        return max(axes, key=_variation)
    most = max(map(_variation, alike))
    return next(c for c in alike if _variation(c) >= 0.5 * most)


def _axis_of(name: str) -> str | None:
    """The name of the sensor of which a channel is the axis x, y or z; None for any other."""
    found = _AXIS.match(name.lower())
    return found.group(1) if found else None


def units_by_name(name: str) -> tuple[str, ...]:
    """Units that the readings of a column of this name may have; a position may be an angle."""
    named = named_quantity(name)
    if named is None:
        return tuple(UNITS)
    return units_of(named) + (units_of("angle") if named == "displacement" else ())


def _variation(channel: Channel) -> float:
    """Standard deviation of a channel's finite readings, SI where its unit is known."""
    finite = channel.samples[np.isfinite(channel.samples)]
    sd = float(np.std(finite)) if finite.size else 0.0
    return sd * UNITS.get(channel.unit, ("", 1.0))[1]
