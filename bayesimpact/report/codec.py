"""Frozen records as JSON text and named arrays, and back: no pickles, nothing executable.

Arrays leave the text as `{"array": "path.to.field"}`; NaN and infinities are written as strings, so
the text is strict JSON. Reading follows the type hints of the record, so a file that does not fit
is refused rather than believed.
"""

from __future__ import annotations

import json
import math
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
Arrays = dict[str, NDArray[Any]]


def encode(record: Any) -> tuple[str, Arrays]:
    """JSON text of a record and its arrays by name."""
    arrays: Arrays = {}
    return json.dumps(_plain(record, "", arrays), ensure_ascii=False, allow_nan=False), arrays


def decode(kind: type[T], text: str, arrays: Mapping[str, NDArray[Any]]) -> T:
    """The record of class `kind` that `encode` wrote; ValueError where text and class differ."""
    return _typed(kind, json.loads(text), arrays, kind.__name__)  # type: ignore[no-any-return]


def _plain(value: Any, path: str, arrays: Arrays) -> Any:
    if is_dataclass(value):
        return {
            f.name: _plain(getattr(value, f.name), _join(path, f.name), arrays)
            for f in fields(value)
        }
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return {"array": path}
    if isinstance(value, Mapping):
        return {str(k): _plain(v, _join(path, str(k)), arrays) for k, v in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(v, _join(path, str(i)), arrays) for i, v in enumerate(value)]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else str(float(value))
    if value is None or isinstance(value, str):
        return value
    raise TypeError(f"{path}: {type(value).__name__} cannot be saved")


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _typed(hint: Any, value: Any, arrays: Mapping[str, NDArray[Any]], path: str) -> Any:
    origin, arguments = get_origin(hint), get_args(hint)
    while hasattr(origin, "__value__"):  # NDArray is a `type` statement in NumPy 2.5
        origin = get_origin(origin.__value__)
    if hint is Any:
        return _untyped(value, arrays)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        (hint,) = [a for a in arguments if a is not type(None)]
        return _typed(hint, value, arrays, path)
    if isinstance(hint, type) and is_dataclass(hint):
        return _record(hint, value, arrays, path)
    if origin is np.ndarray:
        return arrays[_field(value, "array", path)]
    if origin is tuple and isinstance(value, list):
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            arguments = arguments[:1] * len(value)
        pairs = zip(arguments, value, strict=True)
        return tuple(_typed(a, v, arrays, f"{path}[{i}]") for i, (a, v) in enumerate(pairs))
    if isinstance(origin, type) and issubclass(origin, Mapping) and isinstance(value, dict):
        return {k: _typed(arguments[1], v, arrays, f"{path}.{k}") for k, v in value.items()}
    if hint is float and isinstance(value, (int, float, str)) and not isinstance(value, bool):
        return float(value)
    if hint in (int, str, bool) and type(value) is hint:
        return value
    raise ValueError(f"{path}: {type(value).__name__} instead of {hint}")


def _record(kind: type, value: Any, arrays: Mapping[str, NDArray[Any]], path: str) -> Any:
    if not isinstance(value, dict):
        raise ValueError(f"{path}: {type(value).__name__} instead of {kind.__name__}")
    hints = _hints(kind)
    return kind(
        **{
            f.name: _typed(hints[f.name], _field(value, f.name, path), arrays, f"{path}.{f.name}")
            for f in fields(kind)
        }
    )


def _field(value: Any, name: str, path: str) -> Any:
    if not isinstance(value, dict) or name not in value:
        raise ValueError(f"{path}: no {name!r}")
    return value[name]


def _untyped(value: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    if isinstance(value, dict):
        if set(value) == {"array"}:
            return arrays[value["array"]]
        return {k: _untyped(v, arrays) for k, v in value.items()}
    if isinstance(value, list):
        return [_untyped(v, arrays) for v in value]
    return value
