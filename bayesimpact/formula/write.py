"""A formula as a file of effects, ready for `bayesimpact diagnose --effects effect_found.py`."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence

from bayesimpact.formula.grammar import Power, Term
from bayesimpact.formula.law import is_friction, law_of
from bayesimpact.model.effects.effect import Effect, Law
from bayesimpact.model.effects.power_damping import SLOW

HEAD = '''"""{title}

Found by `bayesimpact diagnose`{status}. Check it and look for it again with

    bayesimpact effects --check effect_found.py
    bayesimpact diagnose CAMPAIGN --effects effect_found.py

Each part stands on the left-hand side of m y'' + c1 y' + k1 y + ... = 0.
"""
'''
ARGUMENTS = "y, v, d, t, z, touching, p, q"
_SHAPES = ("place", "width", "fade")


def effect_file(
    terms: Sequence[Term],
    effects: Sequence[Effect],
    sizes: Sequence[float],
    status: str,
    *,
    angle: bool = False,
) -> str:
    """The text of a file that defines one effect per term.

    Parameters
    ----------
    terms : with the shapes that were found, which the file tries first
    effects : of `law.effect_of`, one per term
    sizes : that were found
    status : how sure it is, for the head
    angle : the displacement is an angle; only words differ
    """
    title = "A force: " + " + ".join(
        f"{s:.4g} {t.text(angle=angle)}" for s, t in zip(sizes, terms, strict=True)
    )
    parts = [HEAD.format(title=title, status=status)]
    for i, (term, effect, size) in enumerate(zip(terms, effects, sizes, strict=True)):
        parts.append(_one(str(i + 1) if len(terms) > 1 else "", term, effect, size))
    body = "\n\n\n".join(part.rstrip() for part in parts[1:]) + "\n"
    return "\n\n".join([parts[0].strip(), *_imports(body), ""]) + "\n" + body


def _imports(body: str) -> list[str]:
    """What the functions of a file use."""
    names = "Effect, EffectParameter" + (", Law" if "Law(" in body else "")
    lines = [f"from bayesimpact.model.effects import {names}"]
    if "power(" in body:
        lines.append("from bayesimpact.model.power import power")
    return [*(["import math"] if "math." in body else []), "\n".join(lines)]


def _one(number: str, term: Term, effect: Effect, size: float) -> str:
    """One effect: its functions, then its record."""
    functions, law = _law(number, term, effect)
    lines = [
        f"FOUND{number} = Effect(",
        f"    id={_quoted(effect.id)},",
        f"    family={_quoted(effect.family)},",
        f"    title={_quoted(effect.title)},",
        f"    equation={_quoted(effect.equation)},",
        f"    regime={_quoted(effect.regime)},",
        f"    energy={_quoted(effect.energy)},",
        "    statement=(",
        *(f"        {_quoted(words)}" for words in _wrapped(effect.statement)),
        "    ),",
        "    parameters=(",
        *_parameters(term, effect, size),
        "    ),",
        *law,
        *(["    needs_stop=True,"] if effect.needs_stop else []),
        ")\n",
    ]
    return "\n\n\n".join([*functions, "\n".join(lines)])


def _parameters(term: Term, effect: Effect, size: float) -> list[str]:
    first = effect.parameter("size")
    bound = ", lower=0.0" if first.lower == 0.0 else ""
    scale = f"lambda s: {first.scale(None):.6g}"  # type: ignore[arg-type]
    found = f"  # {size:.6g} was found"
    lines = [
        f'        EffectParameter("size", {_quoted(first.unit)}, scale={scale}{bound}),{found}',
    ]
    for name, value in term.shapes.items():
        p = effect.parameter(name)
        lines += [
            f"        EffectParameter({_quoted(name)}, {_quoted(p.unit)},",
            f"                        scale=lambda s: {value:.6g}, grid=lambda s: [{value:.6g}],",
            f"                        lower={p.lower:.6g}, upper={p.upper:.6g}, null=None),",
        ]
    return lines


def _law(number: str, term: Term, effect: Effect) -> tuple[list[str], list[str]]:
    """Definitions of the functions, and the line of the record that uses them."""
    if is_friction(term) and effect.law is None:
        return [], [
            '    binds={"friction": "size"},  # sticks where the other forces cannot move it'
        ]
    law, name = law_of(term), f"force{number}"
    functions = [_function(name, "N.", [f"return {_force(term, law)}"])]
    words = [name]
    if law.where == "contact":
        words.append('where="contact"')
    places = _places(term)
    if law.surface is not None:
        functions.append(
            _function(
                f"surface{number}",
                "Zero at a kink of the force.",
                [f"return {_surface(term, places)}"],
            )
        )
        words.append(f"surface=surface{number}")
    if law.first_at_turn is not None:
        n = term.speed.exponent
        body = f"return {min(1.0, 1e-6 ** (min(1.0, 2.0 - n) / (1.0 + n))):.6g}"
        functions.append(
            _function(f"first{number}", "Shortest step at a turn over the usual one.", [body])
        )
        words.append(f"first_at_turn=first{number}")
    if law.feature_length is not None:
        functions.append(
            _function(
                f"feature_length{number}",
                "Length of its features, m.",
                [f"return 0.5 * {places['width']}"],
            )
        )
        words.append(f"feature_length=feature_length{number}")
    flags = (
        "kink_at_turn",
        "rough_at_touch",
        "jump_at_turn",
        "jump_at_surface",
        "polynomial",
        "ignores_speed",
    )
    words += [f"{flag}=True" for flag in flags if getattr(law, flag)]
    return functions, [f"    law=Law({', '.join(words)}),"]


def _quoted(text: str) -> str:
    return json.dumps(text)


def _wrapped(text: str) -> list[str]:
    """A sentence in pieces that fit a line, each but the last with the space that follows it."""
    lines = textwrap.wrap(text, 80, break_long_words=False, break_on_hyphens=False)
    return [f"{line} " for line in lines[:-1]] + lines[-1:]


def _function(name: str, says: str, body: Sequence[str]) -> str:
    lines = [f"def {name}({ARGUMENTS}):", f'    """{says}"""', *(f"    {line}" for line in body)]
    return "\n".join(lines)


def _places(term: Term) -> dict[str, str]:
    """Where each shape parameter stands in p."""
    own = [name for name in _SHAPES if getattr(term, name) > 0]
    return {name: f"p[{i + 1}]" for i, name in enumerate(own)}


def _coordinate(term: Term, places: dict[str, str]) -> str:
    place = places.get("place", "")
    if term.region == "contact":
        return f"(d - {place})" if place else "d"
    if term.region == "beyond":
        return f"({'-' if term.side < 0 else ''}y - {place})"
    return f"(y {'-' if term.side > 0 else '+'} {place})" if place else "y"


def _surface(term: Term, places: dict[str, str]) -> str:
    x = _coordinate(term, places)
    if term.region == "box":
        return f"{places['width']} ** 2 - {x} ** 2"
    return x


def _force(term: Term, law: Law) -> str:
    """The force as an expression of Python."""
    places = _places(term)
    x = _coordinate(term, places)
    factors = ["p[0]", *(["t"] if term.drift else [])]
    if term.region == "bump":
        factors.append(f"math.exp(-(({x} / {places['width']}) ** 2))")
    factors += _factor(x, term.position) + _speed_factor(term)
    if term.fade > 0:
        fallen = f"v / {places['fade']}"
        slow = term.lorentzian
        factors.append(f"1.0 / (1.0 + ({fallen}) ** 2)" if slow else f"math.exp(-abs({fallen}))")
    product = " * ".join(factors)
    if law.jump_at_surface and not law.jump_at_turn:
        return f"{product} if z > 0.0 else 0.0"
    return product


def _factor(x: str, power: Power) -> list[str]:
    """|x|^n, with its sign where it is odd."""
    n, name = power.exponent, x
    if power.is_one:
        return []
    if n == 0.0:
        return [f"math.copysign(1.0, {x})"]
    if power.is_plain:
        return [" * ".join([name] * int(n))]
    size = (
        " * ".join([f"abs({x})"] * int(n)) if n.is_integer() else f"power(abs({x}) + 1e-300, {n!r})"
    )
    return [size, f"math.copysign(1.0, {x})"] if power.odd else [size]


def _speed_factor(term: Term) -> list[str]:
    power = term.speed
    if power == Power(0.0, True):
        return ["z"]  # the direction of the motion
    if power.exponent.is_integer() or power.is_one:
        return _factor("v", power)
    return [f"power(v * v + {SLOW**2!r}, {0.5 * (power.exponent - 1.0)!r}) * v"]
