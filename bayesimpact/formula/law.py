"""A term as an effect: one compiled law for all of them, which its constants tell what to do."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bayesimpact.formula.grammar import REGIONS, Power, Term
from bayesimpact.model.effects.effect import (
    Effect,
    EffectParameter,
    Law,
    Numbers,
    Scales,
    Size,
)
from bayesimpact.model.effects.power_damping import SLOW
from bayesimpact.model.power import power

PREFIX = "formula_"
SMALLEST = 0.01  # of the reach (of the speed): bound of a place, a width, a fading
FAMILY = "formula"
KINKED = (Power(1.0, False), Power(2.0, True))  # powers of the speed with a kink at a turning point


def force(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Force of a term, N.

    p = (size, place, width, fade, region, side, exponent and parity of the coordinate, of the
    speed, drift, lorentzian); regions are numbered as in `grammar.REGIONS`. z is the side of a
    surface (box, beyond, second stage) or the direction of the motion (dry friction; 0 beyond a
    surface).
    """
    inside, beyond = 1.0, z <= 0.0
    if p[8] == 0.0 and p[9] > 0.0:
        beyond = z == 0.0
    x = y - p[5] * p[1]
    if p[4] == 1.0:
        x = d - p[1]  # called in contact only: a force that jumps at impact is there at d = 0
        if p[1] > 0.0 and beyond:
            inside = 0.0
    elif p[4] == 2.0:
        x = p[5] * y - p[1]
        if beyond:
            inside = 0.0
    elif p[4] == 3.0:
        inside = math.exp(-(x * x) / (p[2] * p[2]))
    elif p[4] == 4.0 and beyond:
        inside = 0.0
    if inside == 0.0:
        return 0.0
    n, a = p[6], abs(x)
    if n == 1.0:
        inside *= a
    elif n == 2.0:
        inside *= a * a
    elif n == 3.0:
        inside *= a * a * a
    elif n == 4.0:
        inside *= a * a * a * a
    elif n == 5.0:
        inside *= a * a * a * a * a
    elif n != 0.0:
        inside *= power(a, n) if a > 1e-300 else 0.0
    if p[7] > 0.0 and x < 0.0:
        inside = -inside
    m = p[8]
    if p[9] > 0.0:
        if m == 0.0:
            inside *= z
        elif m == 1.0:
            inside *= v
        elif m == 2.0:
            inside *= abs(v) * v
        elif m == 3.0:
            inside *= v * v * v
        else:
            inside *= power(v * v + SLOW * SLOW, 0.5 * (m - 1.0)) * v
    elif m == 1.0:
        inside *= abs(v)
    elif m == 2.0:
        inside *= v * v
    if p[3] > 0.0:
        fallen = v / p[3]
        inside *= 1.0 / (1.0 + fallen * fallen) if p[11] > 0.0 else math.exp(-abs(fallen))
    if p[10] > 0.0:
        inside *= t
    return p[0] * inside


def deeper(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Where a second stage begins."""
    return d - p[1]


def edge(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Above 0 beyond a place."""
    return p[5] * y - p[1]


def edges(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Above 0 inside a box."""
    x = y - p[5] * p[1]
    return p[2] * p[2] - x * x


def feature_length(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Length below which a bump looks like a polynomial, m."""
    return 0.5 * p[2]


def first_at_turn(y, v, d, t, z, touching, p, q):  # type: ignore[no-untyped-def]
    """Shortest step at a turning point over the usual one, as in the catalogue's power_damping."""
    return min(1.0, power(1e-6, min(1.0, 2.0 - p[8]) / (1.0 + p[8])))


@dataclass(frozen=True)
class Fixed:
    """A scale whatever the campaign; a record, for lambdas cannot be pickled."""

    value: float

    def __call__(self, scales: Scales) -> float:
        """The scale."""
        return self.value


@dataclass(frozen=True)
class FrictionSize:
    """Size of dry friction, which has no law: its force over the peak elastic force."""

    def __call__(self, p: Numbers, scales: Scales) -> Size:
        """The size."""
        return p[0], "N", p[0] / scales.force


def effect_of(
    term: Term, scale: float, reach: float, speed: float, *, signed: bool, angle: bool = False
) -> Effect:
    """The effect that adds a term.

    Parameters
    ----------
    scale : plausible size of its force, as `grammar.Term.unit` says
    reach, speed : largest displacement, m, and speed, m/s, which bound its shapes
    signed : negative sizes are admissible too
    angle : the displacement is an angle; only words differ
    """
    text = term.text(angle=angle, numbers=False)
    size = EffectParameter(
        "size", term.unit, scale=Fixed(scale), lower=-math.inf if signed else 0.0
    )
    common = {
        "id": effect_id(term),
        "family": FAMILY,
        "title": f"force A {text}",
        "equation": f"A {text}",
        "regime": term.regime,
        "energy": "either" if signed and term.energy == "dissipates" else term.energy,
        "statement": (
            f"A force A {text} acts, up to {{size}} ({{share}} of the peak elastic force)."
        ),
        "needs_stop": term.region == "contact",
    }
    if is_friction(term) and not signed:  # the oscillator's own, which sticks
        binds = MappingProxyType({"friction": "size"})
        return Effect(**common, parameters=(size,), binds=binds, size=FrictionSize())  # type: ignore[arg-type]
    bounds = {"place": reach, "width": reach, "fade": speed}
    own = tuple(
        EffectParameter(
            name,
            "m/s" if name == "fade" else "m",
            scale=Fixed(getattr(term, name) or 1.0),
            lower=SMALLEST * largest,
            upper=largest,
            null=None,
            fixed=None if getattr(term, name) > 0 else 0.0,
        )
        for name, largest in bounds.items()
    )
    told = tuple(
        EffectParameter(name, "1", scale=Fixed(1.0), fixed=float(value))
        for name, value in constants(term).items()
    )
    return Effect(**common, parameters=(size, *own, *told), law=law_of(term))  # type: ignore[arg-type]


def constants(term: Term) -> dict[str, float]:
    """What the compiled law is told, after size, place, width and fade."""
    return {
        "region": float(REGIONS.index(term.region)),
        "side": float(term.side),
        "exponent": term.position.exponent,
        "odd": float(term.position.odd),
        "speed_exponent": term.speed.exponent,
        "speed_odd": float(term.speed.odd),
        "drift": float(term.drift),
        "lorentzian": float(term.lorentzian),
    }


def law_of(term: Term) -> Law:
    """The law with the flags that its steps need."""
    surface = {"beyond": edge, "box": edges}.get(term.region)
    if term.region == "contact" and term.place > 0:
        surface = deeper
    if term.region == "everywhere" and not (term.position.is_plain or term.position.is_one):
        surface = edge  # the kink at rest
    m = term.speed
    jumps = m == Power(0.0, True)
    rooted = not m.exponent.is_integer()
    cusped = term.fade > 0 and not term.lorentzian
    return Law(
        force,
        where="contact" if term.region == "contact" else "everywhere",
        surface=surface,
        jump_at_surface=surface in (edges, deeper) or term.region == "beyond",
        jump_at_turn=jumps,
        kink_at_turn=not jumps and (rooted or cusped or m in KINKED),
        first_at_turn=first_at_turn if rooted else None,
        rough_at_touch=term.region == "contact" and not term.position.exponent.is_integer(),
        feature_length=feature_length if term.region in ("bump", "box") else None,
        polynomial=_is_polynomial(term),
        ignores_speed=m.is_one and term.fade == 0.0,
    )


def _is_polynomial(term: Term) -> bool:
    """Whether it is a polynomial between its kinks (a bump, below its feature_length)."""
    whole = term.position.exponent.is_integer() and term.speed.exponent.is_integer()
    kinked = term.region in ("everywhere", "bump", "box") and not (
        term.position.is_plain or term.position.is_one
    )
    return whole and not kinked and term.fade == 0.0


def is_friction(term: Term) -> bool:
    """Whether it is Coulomb's law, everywhere."""
    return term == Term("everywhere", Power(0.0, False), Power(0.0, True))


def effect_id(term: Term) -> str:
    """An id that says which term it is, and at which shape, um or mm/s, it was found."""
    words = term.text(numbers=False).replace("|v|^", "abs v ").replace("|", " abs ")
    words = words.replace("-", " m ").replace("^", " ").replace(".", "_")
    words = words.replace(">", " from ").replace("<", " below ")
    own = {"place": 1e6, "width": 1e6, "fade": 1e3}
    shape = [f"{round(own[name] * value)}" for name, value in term.shapes.items()]
    side = "m" if term.side < 0 and term.place else ""
    at = f" at {side}" + "_".join(shape) if shape else ""
    return PREFIX + re.sub(r"[^a-z0-9]+", "_", (words + at).lower()).strip("_")


def is_formula(effect: Effect) -> bool:
    """Whether an effect is a term of a formula."""
    return effect.family == FAMILY and is_formula_id(effect.id)


def is_formula_id(effect_id: str) -> bool:
    """Whether an id is a formula's, which is made of it and nothing to read."""
    return effect_id.startswith(PREFIX)


def kind_id(effect_id: str) -> str:
    """The id of an effect without the shape at which a formula's term was found."""
    return re.sub(r"_at_m?[0-9_]+$", "", effect_id) if is_formula_id(effect_id) else effect_id


def term_of(effect: Effect, values: Mapping[str, float]) -> Term:
    """The term that a formula's effect adds, with its shape from `<effect>.<parameter>` values."""
    if effect.law is None:
        return Term("everywhere", speed=Power(0.0, True))
    told = {p.name: float(p.fixed) for p in effect.parameters if p.fixed is not None}
    shape = {
        n: told.get(n, values.get(f"{effect.id}.{n}", 0.0)) for n in ("place", "width", "fade")
    }
    return Term(
        REGIONS[int(told["region"])],
        Power(told["exponent"], bool(told["odd"])),
        Power(told["speed_exponent"], bool(told["speed_odd"])),
        side=int(told["side"]),
        drift=int(told["drift"]),
        lorentzian=bool(told["lorentzian"]),
        **shape,
    )


def starts_of(term: Term) -> dict[str, float]:
    """Values of the term's shape parameters by their full names."""
    return {f"{effect_id(term)}.{name}": value for name, value in term.shapes.items()}
