"""The library: every term of the grammar that a campaign of given sizes could show.

Some 400 terms. What the base model has already (k1 y, c1 v, k2 d, c2 v in contact, a constant) is
left out. Shape parameters stand on grids: places where the mass has been, widths of a sixteenth to
a quarter of the amplitude; a refit sets them free.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from bayesimpact.formula.grammar import ONE, Power, Region, Term
from bayesimpact.model.effects.effect import Scales

SIGN, V, DRAG = Power(0.0, True), Power(1.0, True), Power(2.0, True)
LINEAR = Power(1.0, True)

POSITIONS = (
    ONE, LINEAR, Power(1.0, False), Power(1.5, True), Power(2.0, False), Power(2.0, True),
    Power(3.0, True), Power(4.0, False), Power(5.0, True),
)  # fmt: skip
SPEEDS = (
    ONE, SIGN, Power(0.5, True), V, Power(1.0, False), Power(1.5, True), DRAG, Power(2.0, False),
    Power(3.0, True),
)  # fmt: skip
DEPTHS = tuple(Power(n, False) for n in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0))
CONTACT_SPEEDS = (ONE, SIGN, V, Power(1.0, False), DRAG, Power(2.0, False), Power(3.0, True))
BASE = ((ONE, ONE), (LINEAR, ONE), (ONE, V))
BASE_CONTACT = ((Power(1.0, False), ONE), (ONE, V))

FADES = (0.05, 0.1, 0.2, 0.4)  # of the largest speed: of a friction that fades
MAXIMA = (0.1, 0.2, 0.4, 0.8)  # of a damping that fades, where it is largest
STAGES = (0.1, 0.25, 0.4, 0.6, 0.8)  # of the deepest indentation
BEYOND = (0.15, 0.3, 0.45, 0.6, 0.75, 0.9)  # of the reach on that side
PLACES = 9  # of bumps and boxes, over all displacements outside contact
BUMPS = (0.06, 0.12, 0.25)  # widths, of the reach
BOXES = (0.1, 0.2)
LOCAL: tuple[tuple[Region, Power, Power], ...] = tuple(
    ("bump", position, speed)
    for position, speed in ((ONE, ONE), (LINEAR, ONE), (ONE, V), (ONE, SIGN), (ONE, DRAG))
)
LOCAL_BOXES: tuple[tuple[Region, Power, Power], ...] = tuple(
    ("box", ONE, speed) for speed in (V, SIGN, DRAG)
)


def library(scales: Scales, low: float, high: float) -> tuple[Term, ...]:
    """All terms for motions from `low` to `high`, m."""
    terms = [*_everywhere(scales), *_drifts(scales)]
    if scales.impacts > 0 and scales.indentation > 0:
        terms += _contact(scales)
        high = min(high, scales.gap)
    terms += _beyond(-1, -low) if low < 0 else ()
    if scales.impacts == 0 and high > 0:
        terms += _beyond(1, high)
    terms += _local(low, high)
    return tuple(terms)


def _everywhere(scales: Scales) -> Iterator[Term]:
    for position, speed in itertools.product(POSITIONS, SPEEDS):
        if (position, speed) not in BASE:
            yield Term("everywhere", position, speed)
    for speed, shares in ((SIGN, FADES), (V, MAXIMA)):
        for share, lorentzian in itertools.product(shares, (False, True)):
            fade = share * scales.speed
            yield Term("everywhere", ONE, speed, fade=fade, lorentzian=lorentzian)


def _drifts(scales: Scales) -> Iterator[Term]:
    for position, speed in ((LINEAR, ONE), (Power(3.0, True), ONE), (ONE, V), (ONE, SIGN),
                            (ONE, DRAG)):  # fmt: skip
        yield Term("everywhere", position, speed, drift=1)
    if scales.impacts > 0:
        yield Term("contact", Power(1.0, False), ONE, drift=1)
        yield Term("contact", ONE, V, drift=1)


def _contact(scales: Scales) -> Iterator[Term]:
    for position, speed in itertools.product(DEPTHS, CONTACT_SPEEDS):
        if (position, speed) not in BASE_CONTACT:
            yield Term("contact", position, speed)
    for share in STAGES:
        place = share * scales.indentation
        for position, speed in ((Power(1.0, False), ONE), (Power(2.0, False), ONE), (ONE, V)):
            yield Term("contact", position, speed, place=place)


def _beyond(side: int, reach: float) -> Iterator[Term]:
    for share in BEYOND:
        for n in (0.0, 1.0, 2.0, 3.0):
            yield Term("beyond", Power(n, False), ONE, side=side, place=share * reach)
        yield Term("beyond", ONE, V, side=side, place=share * reach)


def _local(low: float, high: float) -> Iterator[Term]:
    for share, kinds in ((BUMPS, LOCAL), (BOXES, LOCAL_BOXES)):
        for width in share:
            centres = [low + (i + 0.5) / PLACES * (high - low) for i in range(PLACES)]
            yield from _at(centres, width * max(-low, high), kinds)


def local_starts(low: float, high: float) -> list[Term]:
    """Local terms on a grid so dense that one of them shows any: half a width from place to place.

    Too many to enumerate their sums; the likeliest of each kind join the library.
    """
    found: list[Term] = []
    for share, kinds in ((BUMPS, LOCAL), (BOXES, LOCAL_BOXES)):
        for width in (s * max(-low, high) for s in share):
            count = math.ceil((high - low) / (0.5 * width))
            centres = [low + (i + 0.5) / count * (high - low) for i in range(count)]
            found += _at(centres, width, kinds)
    return found


def _at(
    centres: Iterable[float], width: float, kinds: Sequence[tuple[Region, Power, Power]]
) -> Iterator[Term]:
    for centre in centres:
        side, place = (1 if centre > 0 else -1), abs(centre)
        for region, position, speed in kinds:
            yield Term(region, position, speed, side, place, width)


def neighbours(term: Term, step: float, reach: float) -> list[Term]:
    """Terms of one kind around one: places moved by `step` widths, widths by as many octaves.

    Places without a width move by that share of a sixth of the reach, m.
    """
    move = step * (term.width or reach / len(BEYOND))
    places = [term.place + k * move for k in (-1, 0, 1)] if term.place > 0 else [0.0]
    factors = [2.0 ** (k * step) for k in (-1, 0, 1)]
    found = [
        replace(term, place=place, width=term.width * f, fade=term.fade * f)
        for place in places
        for f in (factors if term.width or term.fade else [1.0])
    ]
    return [t for t in found if t != term and (t.place > 0 or term.place == 0)]
