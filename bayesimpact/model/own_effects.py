"""Effects of one's own: read from a file of Python, and refused in words where they cannot work.

`load_effects` executes the file, as `python FILE.py` would; nothing else in the package executes
code that a user hands in. What is wrong is said before any work, with the file and the line: of a
syntax error, of an exception, of the argument at fault, of what cannot be compiled in a law.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import InputError
from bayesimpact.model.effects import EFFECTS, SEARCHED
from bayesimpact.model.effects.effect import (
    Effect,
    EffectParameter,
    Energy,
    Law,
    Regime,
    Scales,
    Scope,
    Where,
    address,
)
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
ARGUMENTS = ("y", "v", "d", "t", "z", "touching", "p", "q")
UNITS = ("N", "m", "kg", "s", "rad", "Hz", "1", "-")
USUAL = Scales(
    mass=0.5, stiffness=800.0, damping=0.15, contact_stiffness=5e3, contact_damping=2.0,
    amplitude=6e-3, speed=0.24, indentation=2.2e-3, impact_speed=0.23, duration=6.0, interval=1e-3,
    impacts=35, gap=1.1e-3, cases=2, recordings=4,
)  # fmt: skip
"""Scales of an ordinary rig, on which priors and sizes are tried."""

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def catalogue_with(own: Sequence[Effect] | Path | str) -> tuple[Effect, ...]:
    """The effects that a diagnosis looks for by default, and one's own; checked.

    Parameters
    ----------
    own : effects, or a file that defines them

    Raises
    ------
    InputError : as `load_effects`
    """
    effects = load_effects(own) if isinstance(own, Path | str) else tuple(own)
    return (*SEARCHED, *effects)


def load_effects(file: Path | str) -> tuple[Effect, ...]:
    """The effects that a file defines, in its order.

    Raises
    ------
    InputError : the file cannot be read or executed, defines no effect, or one that cannot be used
    """
    path = Path(file)
    try:
        source = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        found = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), str(found).lower(), "a file of Python") from None
    found = _executed(path, source)
    known = set(map(id, EFFECTS))
    effects: dict[int, Effect] = {}
    for value in found.values():
        for one in value if isinstance(value, tuple | list) else (value,):
            if isinstance(one, Effect) and id(one) not in known:
                effects[id(one)] = one
    if not effects:
        raise InputError(str(path), "no effect", "at least one bayesimpact Effect by a name")
    own = tuple(effects.values())
    check_effects(own, _Place(path, ast.parse(source)))
    return own


def _executed(path: Path, source: str) -> dict[str, Any]:
    """What a file defines; its errors become one message with the line."""
    try:
        code = compile(source, str(path), "exec")
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        place = f"{path}, line {line}" if line else str(path)
        raise InputError(place, f"{getattr(error, 'msg', error)}", "valid Python") from None
    module = ModuleType(f"effects_of_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # as an import would: what it defines finds its module
    try:
        exec(code, module.__dict__)
    except (Exception, SystemExit) as error:
        raise _as_input_error(path, error, "a file that runs to its end") from None
    return module.__dict__


def _as_input_error(path: Path | None, error: BaseException, accepted: str) -> InputError:
    """An exception of a user's code: the last line of the file that it came through."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if path is not None and f.filename == str(path)]
    place = f"{path}, line {lines[-1]}" if lines else f"{path or 'effects'}"
    return InputError(place, f"{type(error).__name__}: {error}", accepted)


class _Place:
    """Where in a file something is said of an effect; without a file only its id is known."""

    def __init__(self, path: Path | None = None, tree: ast.Module | None = None) -> None:
        self.path = path
        self.calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call)] if tree else []

    def of(self, effect: Effect, key: str = "") -> str:
        """File, line, effect and key."""
        words = [f"effect {effect.id!r}", *([key] if key else [])]
        if self.path is None:
            return ", ".join(words)
        for call in self.calls:
            named = {k.arg: k.value for k in call.keywords}
            first = named.get("id", call.args[0] if call.args else None)
            if isinstance(first, ast.Constant) and first.value == effect.id:
                line = named[key].lineno if key in named else call.lineno
                return ", ".join([f"{self.path}, line {line}", *words])
        return ", ".join([str(self.path), *words])


def check_effects(own: Sequence[Effect], place: _Place | None = None) -> None:
    """Refuse effects of one's own that cannot be used; laws are compiled here.

    Raises
    ------
    InputError : one message with the place, what was found there and what is accepted
    """
    place = place or _Place()
    taken = {e.id for e in EFFECTS}
    for effect in own:
        if not isinstance(effect, Effect):
            raise InputError("effects", repr(effect)[:80], "effects (bayesimpact Effect)")
        if any(effect is known for known in EFFECTS):
            continue
        if not re.fullmatch(r"[a-z][a-z0-9_]*", str(effect.id)):
            accepted = "lower-case letters, digits and _"
            raise InputError(place.of(effect, "id"), repr(effect.id), accepted)
        if effect.id in taken:
            raise InputError(place.of(effect, "id"), "a duplicate id", "an id of its own")
        taken.add(effect.id)
        _check_words(effect, place)
        for parameter in effect.parameters:
            _check_parameter(effect, parameter, place)
        _check_action(effect, place)


def _one_of(place: str, value: object, accepted: Sequence[object]) -> None:
    if value not in accepted:
        raise InputError(place, repr(value), ", ".join(map(str, accepted)))


def _check_words(effect: Effect, place: _Place) -> None:
    _one_of(place.of(effect, "regime"), effect.regime, get_args(Regime))
    _one_of(place.of(effect, "energy"), effect.energy, get_args(Energy))
    try:
        effect.statement.format(size="1 N", share="1 %")
    except (KeyError, IndexError, ValueError, AttributeError):
        accepted = "a sentence in which {size} and {share} may stand"
        raise InputError(place.of(effect, "statement"), repr(effect.statement), accepted) from None


def _check_parameter(effect: Effect, parameter: EffectParameter, place: _Place) -> None:
    where = place.of(effect, "parameters") + f", {parameter.name}"
    words = re.sub(r"\d+(\.\d+)?", "", str(parameter.unit).replace("/", " ")).split()
    for word in words or ["1"] * bool(parameter.unit):
        _one_of(f"{where}, unit {parameter.unit!r}", word, UNITS)
    _one_of(f"{where}, scope", parameter.scope, get_args(Scope))
    if not parameter.lower < parameter.upper:
        found = f"{parameter.lower} to {parameter.upper}"
        raise InputError(f"{where}, lower and upper", found, "a lower bound below the upper one")
    null = parameter.null
    if null is not None and not parameter.lower <= null <= parameter.upper:
        raise InputError(f"{where}, null", str(null), "a value within the bounds")
    scale = tried(place, where, lambda: float(parameter.scale(USUAL)))
    if not (np.isfinite(scale) and scale > 0.0):
        raise InputError(f"{where}, scale", f"{scale} on an ordinary rig", "a size above 0")
    if parameter.grid is not None:
        grid = tried(place, where, lambda: np.asarray(parameter.grid(USUAL), float))  # type: ignore[misc]
        inside = grid.ndim == 1 and grid.size and np.isfinite(grid).all()
        if not (inside and grid.min() >= parameter.lower and grid.max() <= parameter.upper):
            raise InputError(f"{where}, grid", str(grid)[:80], "values within the bounds")
    if parameter.within is not None:
        found = tried(place, where, lambda: tuple(map(float, parameter.within(USUAL))))  # type: ignore[misc]
        ordered = len(found) == 2 and 0.0 < found[0] < found[1] < np.inf
        if not (ordered and parameter.is_shape):
            accepted = "for a shape (null=None): two numbers above 0, ascending"
            raise InputError(f"{where}, within", str(found), accepted)


def tried(place: _Place, where: str, call: Callable[[], Any]) -> Any:
    """The value of a function of the user's; what it raises is told with its line."""
    try:
        return call()
    except Exception as error:
        told = _as_input_error(place.path, error, "a function that returns a value")
        raise InputError(f"{where}: {told.where}", told.found, told.accepted) from None


def _check_action(effect: Effect, place: _Place) -> None:
    for key in ("binds", "sets"):
        for slot in getattr(effect, key):
            _one_of(place.of(effect, key), slot, SLOTS)
    names = [p.name for p in effect.parameters]
    for name in effect.binds.values():
        _one_of(place.of(effect, "binds"), name, names)
    if not (effect.law or effect.observe or effect.binds or effect.sets):
        raise InputError(place.of(effect), "nothing that it does", "law, observe, binds or sets")
    numbers = [float(p.fixed or p.null or p.scale(USUAL)) for p in effect.parameters]
    if effect.size is not None:
        size = tried(place, place.of(effect, "size"), lambda: effect.size(numbers, USUAL))  # type: ignore[misc]
        if not (isinstance(size, tuple) and len(size) == 3):
            accepted = "value, unit, share of its reference"
            raise InputError(place.of(effect, "size"), repr(size)[:80], accepted)
    if effect.condition is not None:
        tried(place, place.of(effect, "condition"), lambda: effect.condition(USUAL))  # type: ignore[misc]
    if effect.observe is not None:
        _check_observe(effect, numbers, place)
    if effect.law is not None:
        _check_law(effect, effect.law, place)


def _check_observe(effect: Effect, numbers: Sequence[float], place: _Place) -> None:
    where, observe = place.of(effect, "observe"), effect.observe
    y: Array = np.linspace(-1e-3, 1e-3, 10).reshape(2, 5)
    t: Array = np.arange(5, dtype=np.float64) * 1e-3
    p: Array = np.tile(np.array(numbers), (2, 1))
    assert observe is not None
    read = tried(place, where, lambda: np.asarray(observe(y, t, p), float))
    if read.shape != y.shape:
        raise InputError(where, f"readings of shape {read.shape}", f"shape {y.shape}, as y")


def _check_law(effect: Effect, law: Law, place: _Place) -> None:
    _one_of(place.of(effect, "law") + ", where", law.where, get_args(Where))
    if law.rate is not None and law.travel is not None:
        found = "rate and travel"
        raise InputError(place.of(effect, "law"), found, "one state: it follows time, or the path")
    initial = [p.name for p in effect.parameters if p.initial]
    if len(initial) > (law.rate is not None or law.travel is not None):
        accepted = "one initial state at most, of a law with a rate or a travel"
        raise InputError(place.of(effect, "parameters"), ", ".join(initial), accepted)
    if law.jump_at_surface and law.surface is None:
        raise InputError(place.of(effect, "law"), "jump_at_surface without surface", "both")
    for field in fields(law):
        function = getattr(law, field.name)
        if not (function is None or isinstance(function, bool | str)):
            _compile(effect, field.name, function, place)


def _compile(effect: Effect, name: str, function: Callable[..., float], place: _Place) -> None:
    """Compile a law's function; what cannot be compiled is told with its line."""
    code = getattr(function, "__code__", None)
    where = f"{place.of(effect, 'law')}, {name}"
    if code is None:
        raise InputError(where, repr(function)[:80], f"a function of ({', '.join(ARGUMENTS)})")
    where = f"{code.co_filename}, line {code.co_firstlineno}, effect {effect.id!r}, {name}"
    count = len(inspect.signature(function).parameters)
    if count != len(ARGUMENTS):
        accepted = f"the {len(ARGUMENTS)} arguments ({', '.join(ARGUMENTS)})"
        raise InputError(where, f"a function of {count} arguments", accepted)
    try:
        address(function)
    except Exception as error:
        line, reason = _compiler_words(str(error), code.co_filename)
        place_ = f"{code.co_filename}, line {line or code.co_firstlineno}"
        accepted = "arithmetic on floats, `math`, and `power` of bayesimpact.model.power"
        raise InputError(f"{place_}, effect {effect.id!r}, {name}", reason, accepted) from None


def _compiler_words(text: str, file: str) -> tuple[int | None, str]:
    """The line of `file` in the compiler's message, and its first sentence that says something."""
    plain = _COLOUR.sub("", text)
    lines = re.findall(r'File "([^"]+)", line (\d+)', plain)
    own = [int(n) for name, n in lines if Path(name).name == Path(file).name]
    skipped = ("Failed in", "File ", "During: ", ">>>", "<source", "- Resol", "There are")
    sentences = [s.strip() for s in plain.splitlines()]
    said = [s for s in sentences if s and not s.startswith(skipped)]
    return (own[-1] if own else None), said[0] if said else "something that cannot be compiled"


__all__ = ["USUAL", "catalogue_with", "check_effects", "load_effects", "tried"]
