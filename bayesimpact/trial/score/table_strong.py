"""What `summary_strong` adds, as text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Rate = Callable[[str, Mapping[str, Any]], str]


def added_text(summary: Mapping[str, Any], line: Rate) -> list[str]:
    """Lines of summary.txt; `line` writes a rate."""
    lines = ["", line("crashes", summary["crashes"])]
    for key, title in (
        ("worse", "fits worse after than before"),
        ("medians_outside", "a median outside its interval"),
        ("overconfident", "named, and something is left"),
    ):
        found = summary[key]
        seeds = f"  seeds {', '.join(map(str, found['seeds']))}" if found["seeds"] else ""
        lines.append(line(title, found) + seeds)
    lines += [
        line(f"90 % intervals hold: {verdict}", found)
        for verdict, found in summary["inside_by_verdict"].items()
    ]
    chosen = summary["selection"]
    if chosen is not None:
        low, middle, high = chosen["misfit"]
        lines += [
            "",
            f"{chosen['kept']} trials from {chosen['draws']} draws; misfit over noise {low:.3g} to "
            f"{high:.3g}, median {middle:.3g}; {chosen['resting']} begin before the release",
            *(f"  thrown away {n:4d}: {why}" for why, n in chosen["thrown_away"].items()),
        ]
        if chosen["gave_up"]:
            lines.append(f"  no draw found: seeds {', '.join(map(str, chosen['gave_up']))}")
    return lines
