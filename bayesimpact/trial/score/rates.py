"""Proportions with their exact intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from scipy import stats

CONFIDENCE = 0.95


def rate(hits: int, of: int) -> dict[str, Any]:
    """A proportion with its exact interval (Clopper and Pearson 1934)."""
    return {
        "hits": hits,
        "of": of,
        "rate": hits / of if of else None,
        "interval": _interval(hits, of),
    }


def rate_in_groups(groups: Sequence[Sequence[bool]]) -> dict[str, Any]:
    """The same for numbers of which those of one trial err together, such as phases.

    The interval is that of as many independent numbers as have the variance found between trials
    (Korn and Graubard 1998, Survey Methodology 24:193), of one per trial where there is none.
    """
    groups = [g for g in groups if len(g)]
    found = rate(sum(map(sum, groups)), sum(map(len, groups)))
    if not groups:
        return found
    share = found["rate"]
    variance = sum((sum(g) - share * len(g)) ** 2 for g in groups) / found["of"] ** 2
    of = min(found["of"], share * (1 - share) / variance) if variance > 0 else len(groups)
    return found | {"interval": _interval(share * of, of)}


def _interval(hits: float, of: float) -> list[float]:
    tail = (1 - CONFIDENCE) / 2
    low = float(stats.beta.ppf(tail, hits, of - hits + 1)) if hits > 0 else 0.0
    high = float(stats.beta.ppf(1 - tail, hits + 1, of - hits)) if hits < of else 1.0
    return [low, high]
