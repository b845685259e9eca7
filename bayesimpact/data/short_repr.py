"""What a record prints as: arrays by their shape, records and long sequences by their kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

FEW = 3  # items of a sequence that are shown
LONG = 40  # characters of an item, beyond which only its kind is shown


def short_repr(record: Any) -> str:
    """One line on a dataclass, to be its `__repr__`: as generated, without what fills pages."""
    parts = (
        f"{one.name}={_shown(getattr(record, one.name))}"
        for one in fields(record)
        if one.repr and hasattr(record, one.name)
    )
    return f"{type(record).__name__}({', '.join(parts)})"


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"<array {value.shape}>"
    if isinstance(value, (float, np.floating)):
        return f"{float(value):.6g}"
    if isinstance(value, (tuple, list, set, frozenset, Mapping)):
        return _sequence(value)
    if is_dataclass(value) and type(value).__repr__ is short_repr:
        return _kind(value)  # without the work of a text that is too long
    words = repr(value)
    return words if len(words) <= LONG else _kind(value)


def _sequence(values: Any) -> str:
    shown = [_shown(v) for v in values]
    few = f"{{{', '.join(shown)}}}" if isinstance(values, Mapping) else f"({', '.join(shown)})"
    return few if len(shown) <= FEW and len(few) <= 2 * LONG else f"<{len(shown)} items>"


def _kind(value: Any) -> str:
    return f"<{type(value).__name__}>"
