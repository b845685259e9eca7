"""next.json: the ranked designs as scripts read them (schema bayesimpact/next/1); SI units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bayesimpact.design.hypotheses import Rivalry
from bayesimpact.design.rank import Proposal
from bayesimpact.diagnosis.thresholds import DECISIVE

SCHEMA = "bayesimpact/next/1"


def next_document(rivals: Rivalry, found: Sequence[Proposal], seed: int) -> dict[str, Any]:
    """The content of next.json, without words."""
    return {
        "schema": SCHEMA,
        "verdict": rivals.verdict,
        "open": rivals.is_open,
        "angle": rivals.quantity.startswith("ang"),
        "decisive": DECISIVE,
        "rivals": [
            {"effects": list(h.ids), "log_odds": h.log_odds, "probability": float(p)}
            for h, p in zip(rivals.hypotheses, rivals.probabilities, strict=True)
        ],
        "designs": [_entry(number, p, rivals) for number, p in enumerate(found, start=1)],
        "seed": seed,
    }


def _entry(number: int, p: Proposal, rivals: Rivalry) -> dict[str, Any]:
    d, decides = p.design, rivals.is_open
    return {
        "rank": number,
        "kind": d.kind,
        "case": d.case if d.stop and rivals.stop else None,
        "y0_m": d.y0,
        "v0_m_s": d.v0,
        "duration_s": d.duration,
        "sample_rate_hz": 1.0 / d.interval,
        "stop": d.stop and rivals.stop,
        "gap_shift_m": d.gap_shift,
        "repeats": d.repeats or None,
        "same_campaign": d.joins,
        "expected_log_odds": p.log_odds if decides else None,
        "pairs": p.odds.tolist() if decides else None,
        "chance_to_settle": p.chance if rivals.verdict == "ambiguous" else None,
        "half_ci90": {n: {"before": b, "after": a} for n, (b, a) in p.halves.items()},
        "narrowing": p.narrowing,
    }
