"""The table of a fleet: a line per campaign, as CSV, and as Parquet where pandas can write it."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bayesimpact.data.files import write_bytes, write_text
from bayesimpact.fleet.plan import Plan
from bayesimpact.fleet.run import Row

FOUND = ("failed", "converged", "verdict", "effects", "reduced_chi2")


def columns(plan: Plan, rows: Sequence[Row]) -> dict[str, list[Any]]:
    """The table by columns; what a campaign does not have is None.

    A parameter has three columns: estimate, `_low` and `_high` (90 %), SI units.
    """
    conditions = dict.fromkeys(name for s in plan.sessions for name in s.conditions)
    parameters = dict.fromkeys(n for row in rows for n in row.get("parameters", {}))
    table: dict[str, list[Any]] = {
        "name": [s.name for s in plan.sessions],
        "date": [s.date or None for s in plan.sessions],
    }
    for name in conditions:
        table[f"condition.{name}"] = [s.conditions.get(name) for s in plan.sessions]
    for name in FOUND:
        table[name] = [row.get(name) for row in rows]
    table["effects"] = [" + ".join(row.get("effects", ())) or None for row in rows]
    for name in parameters:
        known = [row.get("parameters", {}).get(name, {}) for row in rows]
        for ending, key in (("", "estimate"), ("_low", "low"), ("_high", "high")):
            table[name + ending] = [entry.get(key) for entry in known]
    return table


def write_table(table: dict[str, list[Any]], out: Path) -> list[Path]:
    """fleet.csv and, where pandas and pyarrow are installed, fleet.parquet; the files written."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(table)
    for line in zip(*table.values(), strict=True):
        writer.writerow(["" if value is None else _text(value) for value in line])
    files = [out / "fleet.csv"]
    write_text(files[0], stream.getvalue())
    try:
        import pandas

        content = pandas.DataFrame(table).to_parquet(index=False)  # needs pyarrow beside pandas
    except ImportError:
        return files
    files.append(out / "fleet.parquet")
    write_bytes(files[1], content)
    return files


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else str(value)
