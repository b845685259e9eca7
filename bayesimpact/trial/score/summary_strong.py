"""What a summary adds: crashes, intervals under every verdict, fits that became worse, rejections.

For all trials; with several effects at once these are what the proof stands on.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from bayesimpact.trial.score.rates import rate, rate_in_groups

Result = Mapping[str, Any]


def added(results: Sequence[Result]) -> dict[str, Any]:
    """Entries of summary.json beside those of `summary`."""
    tried = [r for r in results if r.get("stage") != "drawing"]
    scored = [r for r in results if "score" in r]
    crashes = [r["seed"] for r in tried if r.get("stage") == "diagnosing"]
    return {
        "crashes": rate(len(crashes), len(tried)) | {"seeds": crashes},
        "worse": _listed(scored, lambda s: s["quality"]["worse"]),
        "medians_outside": _listed(scored, lambda s: s["inconsistent"]),
        "overconfident": _listed(scored, lambda s: s["outcome"] == "overconfident"),
        "verdicts": dict(Counter(r["score"]["verdict"] for r in scored)),
        "inside_by_verdict": _inside(scored),
        "selection": selection(results),
    }


def _listed(scored: Sequence[Result], hit: Any) -> dict[str, Any]:
    seeds = [r["seed"] for r in scored if hit(r["score"])]
    return rate(len(seeds), len(scored)) | {"seeds": seeds}


def _inside(scored: Sequence[Result]) -> dict[str, Any]:
    """Verdict -> share of base parameters whose 90 % interval, as reported, holds the truth.

    Read from what the answer gives as `parameters.after`, whatever the verdict.
    """
    verdicts = sorted({r["score"]["verdict"] for r in scored})
    table = {v: [r for r in scored if r["score"]["verdict"] == v] for v in verdicts}
    return {
        label: rate_in_groups(
            [[c["after"] for c in r["score"]["coverage"].values() if "after" in c] for r in rows]
        )
        for label, rows in {**table, "all": list(scored)}.items()
    }


def selection(results: Sequence[Result]) -> dict[str, Any] | None:
    """How many draws it took, and why those were thrown away; None where it was not counted."""
    truths = [r["truth"] for r in results if "rejected" in r.get("truth", {})]
    if not truths:
        return None
    reasons: Counter[str] = Counter()
    for truth in truths:
        reasons.update({_reason(text): n for text, n in truth["rejected"].items()})
    misfits = sorted(t["misfit"] for t in truths)
    return {
        "draws": len(truths) + reasons.total(),
        "kept": len(truths),
        "thrown_away": dict(reasons.most_common()),
        "gave_up": [r["seed"] for r in results if r.get("stage") == "drawing"],
        "misfit": [misfits[0], misfits[len(misfits) // 2], misfits[-1]],
        "resting": sum(bool(t["rest_s"]) for t in truths),
    }


def _reason(text: str) -> str:
    """Without the name of the effect, which a reason may begin with."""
    first, _, rest = text.partition(" is hidden")
    return f"an effect is hidden{rest}" if rest else first
