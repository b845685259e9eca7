"""Writes the README's tables from the stored results: `python tests/benchmarks/readme.py`."""

from __future__ import annotations

import json
import re
from pathlib import Path

HERE = Path(__file__).resolve().parent
README = HERE.parents[1] / "README.md"


def stored(name: str) -> dict:
    """Content of a stored result."""
    return json.loads((HERE / f"{name}.json").read_text(encoding="utf-8"))


def kernel_table() -> str:
    """Speed of the likelihood."""
    k = stored("kernel")
    rows = [
        ("sum of squared differences of two stored arrays (floor)", k["floor_us"]),
        ("simulation and likelihood", k["sse_us"]),
        ("the same, called alone from Python", k["sse_called_alone_us"]),
        ("with all derivatives (Gram matrices)", k["with_derivatives_us"]),
        ("plain recurrence, for comparison", k["recurrence_us"]),
    ]
    lines = ["| nine recordings of 6,000 samples | median, us |", "|---|---|"]
    lines += [f"| {label} | {value:.0f} |" for label, value in rows]
    lines.append(f"\n{k['machine']}, one core, commit {k['commit']}, {k['date']}.")
    return "\n".join(lines)


def coverage_table() -> str:
    """Coverage of the intervals."""
    c = stored("coverage")
    lines = ["| parameter | 90 % intervals that hold the truth | of |", "|---|---|---|"]
    for name, row in c["parameters"].items():
        lines.append(f"| {name} | {100 * row['coverage90']:.0f} % | {row['n']} |")
    lines.append(
        f"\n{c['campaigns']} campaigns of nine recordings of {c['duration_s']:.0f} s from the "
        f"independent generator, commit {c['commit']}, {c['date']}."
    )
    return "\n".join(lines)


TABLES = {"kernel": kernel_table, "coverage": coverage_table}


def rendered(text: str) -> str:
    """The README with its tables made anew."""
    for name, table in TABLES.items():
        pattern = rf"(<!-- {name} -->\n).*?(\n<!-- end -->)"
        text = re.sub(pattern, lambda m, t=table: m[1] + t() + m[2], text, flags=re.DOTALL)
    return text


if __name__ == "__main__":
    README.write_text(rendered(README.read_text(encoding="utf-8")), encoding="utf-8")
