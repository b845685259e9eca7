"""What a column may be, by its unit and its numbers, where campaign.toml does not say."""

from __future__ import annotations

from collections.abc import Sequence

from bayesimpact.data.quantity import UNITS, Quantity, order_of
from bayesimpact.data.readers.channel import Channel


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
