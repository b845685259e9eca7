"""Frozen records as JSON text and named arrays, and back: no pickles, nothing executable.

Arrays leave the text as `{"array": "path.to.field"}`; NaN and infinities are written as strings, so
the text is strict JSON. Reading follows the type hints of the record, so a file that does not fit
is refused rather than believed.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Annotated, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import GetPydanticSchema, TypeAdapter
from pydantic_core.core_schema import is_instance_schema

T = TypeVar("T")
Array = Annotated[NDArray[np.float64], GetPydanticSchema(lambda *_: is_instance_schema(np.ndarray))]
"""Of the fields of records: any array, as it was saved."""
Arrays = dict[str, NDArray[Any]]


def encode(record: Any) -> tuple[str, Arrays]:
    """JSON text of a record and its arrays by name."""
    arrays: Arrays = {}
    return json.dumps(_plain(record, "", arrays), ensure_ascii=False, allow_nan=False), arrays


def decode(kind: type[T], text: str, arrays: Mapping[str, NDArray[Any]]) -> T:
    """The record of class `kind` that `encode` wrote; ValueError where text and class differ."""
    found: T = _adapter(cast(Any, kind)).validate_python(_with_arrays(json.loads(text), arrays))
    return found


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
def _adapter(kind: type) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _with_arrays(value: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """The same with every array in its place."""
    if isinstance(value, dict):
        if value.keys() == {"array"}:
            return arrays[value["array"]]
        return {k: _with_arrays(v, arrays) for k, v in value.items()}
    return [_with_arrays(v, arrays) for v in value] if isinstance(value, list) else value
