"""Forces that the catalogue does not know: what a diagnosis has to call unknown.

Conventions as in the catalogue: forces in N on the left-hand side, SI units, frequencies in Hz.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import exp, pi, sin

from bayesimpact.trial.rig.catalogue import Numbers, Planted, everywhere, in_contact
from bayesimpact.trial.rig.parts import Law, Piece, Rates, RigPart, Site, State


def _detent(site: Site, p: Numbers, slot: int) -> RigPart:
    """Magnetic detent: pulls towards `place` with `stiffness` x exp(-x^2/width^2)."""
    stiffness, place, scale = p["stiffness"], p["place"], 1 / p["width"] ** 2

    def law(t: float, y: float, v: float, state: State) -> float:
        x = y - place
        return stiffness * x * exp(-x * x * scale)

    return RigPart(everywhere(law))


def _inside(piece: Piece, low: float, high: float) -> bool:
    return piece.above(low) and not piece.above(high)


def _friction_pad(site: Site, p: Numbers, slot: int) -> RigPart:
    """Stribeck friction from `low` to `high`: (force + extra exp(-v^2/speed^2)) sign(v)."""
    force, extra, scale = p["force"], p["extra"], 1 / p["speed"] ** 2
    low, high = p["low"], p["high"]

    def friction(piece: Piece) -> Callable[[float], float] | None:
        if not _inside(piece, low, high):
            return None
        return lambda v: force + extra * exp(-v * v * scale)

    return RigPart(friction=friction, kinks=(low, high))


def _damping_bump(site: Site, p: Numbers, slot: int) -> RigPart:
    """Damping near one place: `coefficient` exp(-(y - place)^2/width^2) v."""
    coefficient, place, scale = p["coefficient"], p["place"], 1 / p["width"] ** 2

    def law(t: float, y: float, v: float, state: State) -> float:
        return coefficient * exp(-((y - place) ** 2) * scale) * v

    return RigPart(everywhere(law))


def _eddy_brake(site: Site, p: Numbers, slot: int) -> RigPart:
    """Viscous brake that acts between `low` and `high` only."""
    coefficient, low, high = p["coefficient"], p["low"], p["high"]

    def law(piece: Piece) -> Law | None:
        if not _inside(piece, low, high):
            return None
        return lambda t, y, v, state: coefficient * v

    return RigPart(law, kinks=(low, high))


def _resonator(site: Site, p: Numbers, slot: int) -> RigPart:
    """A loose part of `mass` on a spring and a damper; starts where and as fast as the mass."""
    mass = p["mass"]
    spring = mass * (2 * pi * p["frequency"]) ** 2
    damper = 2 * p["damping_ratio"] * 2 * pi * p["frequency"] * mass

    def pull(y: float, v: float, state: State) -> float:
        return spring * (y - state[slot]) + damper * (v - state[slot + 1])

    def rates(piece: Piece) -> Rates:
        return lambda t, y, v, state: (state[slot + 1], pull(y, v, state) / mass)

    law = everywhere(lambda t, y, v, state: pull(y, v, state))
    return RigPart(law, states=(site.y0, site.v0), rates=rates)


def _damping_drift(site: Site, p: Numbers, slot: int) -> RigPart:
    """Damping that grows with time: c1 (1 + r t)."""
    growth = site.c1 * p["rate"]
    return RigPart(everywhere(lambda t, y, v, state: growth * t * v))


def _contact_friction(site: Site, p: Numbers, slot: int) -> RigPart:
    """Rubbing against the obstacle: force sign(v) in contact; not a part of its normal reaction."""
    force = p["force"]
    return RigPart(friction=lambda piece: (lambda v: force) if piece.contact else None)


def _contact_preload(site: Site, p: Numbers, slot: int) -> RigPart:
    """A constant force in contact: the obstacle rests on a support with this force."""
    force = p["force"]
    return in_contact(lambda d, v: force)


def _knock(site: Site, p: Numbers, slot: int) -> RigPart:
    """A knock on the frame: half a sine of `impulse` (N s) from `time` on, `width` long."""
    start, width = p["time"], p["width"]
    peak = p["impulse"] * pi / (2 * width)

    def law(t: float, y: float, v: float, state: State) -> float:
        inside = start <= t <= start + width
        return -peak * sin(pi * (t - start) / width) if inside else 0.0

    return RigPart(everywhere(law), times=(start, start + width), period=2 * width)


OUTSIDE: Mapping[str, Planted] = {
    "detent": Planted(("stiffness", "place", "width"), part=_detent),
    "friction_pad": Planted(("force", "extra", "speed", "low", "high"), part=_friction_pad),
    "damping_bump": Planted(("coefficient", "place", "width"), part=_damping_bump),
    "eddy_brake": Planted(("coefficient", "low", "high"), part=_eddy_brake),
    "resonator": Planted(("mass", "frequency", "damping_ratio"), part=_resonator),
    "damping_drift": Planted(("rate",), part=_damping_drift),
    "contact_friction": Planted(("force",), obstacle=True, part=_contact_friction),
    "contact_preload": Planted(("force",), obstacle=True, part=_contact_preload),
    "knock": Planted(("impulse", "time", "width"), part=_knock),
}
