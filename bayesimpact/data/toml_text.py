"""Values and remarks as TOML writes them."""

from __future__ import annotations

import json
from collections.abc import Mapping


def toml(value: object) -> str:
    """A text, a number, a truth value or a table of these as TOML writes it, on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, float):
        return repr(float(value))  # NumPy's own would say its type
    # strings, integers and truth values agree, but for a character that JSON leaves as it is
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def one_line(words: str) -> str:
    """Words without what would break a comment's line."""
    return "".join(c if c.isprintable() else " " for c in words)
