"""Fields of a line of text: what stands in quotes is one of them, whatever is inside."""

from __future__ import annotations

import csv
import re

_WORD = re.compile(r'(?:"[^"]*"|[^\s"])+')
_QUOTED = re.compile(r'"[^"]*"')


def fields(line: str, separator: str | None) -> list[str]:
    """Fields of a line, without quotes; a separator inside quotes is part of the field (RFC 4180).

    Quotes that do not come in pairs are inch marks or damage, and only left out.

    separator : one character; None for any blanks
    """
    if '"' not in line:
        return line.split(separator)
    if line.count('"') % 2:
        return line.replace('"', "").split(separator)
    if separator is None:
        return [word.replace('"', "") for word in _WORD.findall(line)]
    try:
        (found,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
    except (csv.Error, ValueError):  # a field longer than the library reads; no field at all
        return line.replace('"', "").split(separator)
    return [field.replace('"', "") for field in found]


def unquoted(line: str) -> str:
    """The line with a number in place of everything in quotes: only its separators count."""
    return _QUOTED.sub("0", line) if '"' in line else line
