"""The evidence page's tables of faults of recordings."""

from __future__ import annotations

from benchmarks.tables import HERE, grid, stored
from benchmarks.trial_tables import share

BASE = ("c1", "k1", "c2", "g", "k2")
RUNS = {"faults": "alone: named, with its place", "fault_single": "beside an effect: both"}
KINDS = {"faults": "fault", "fault_single": "fault_single"}
SHARES = {
    "confident_wrong_names": "a wrong name given with confidence",
    "worse": "fit worse after than before",
    "crashes": "crashes, report and figures included",
}


def fault_table() -> str:
    """Every fault alone and, once that run is stored, beside an effect."""
    runs = {name: stored(name) for name in RUNS if (HERE / f"{name}.json").exists()}
    if not runs:
        return "No run is stored yet."
    faults = sorted({answer["fault"] for t in runs.values() for answer in t["answers"]})
    rows = [(f"`{fault}`", *(_right(t, fault) for t in runs.values())) for fault in faults]
    rows.append(("all", *(share(t["right"][KINDS[name]]) for name, t in runs.items())))
    rows += [(words, *(share(t[key]) for t in runs.values())) for key, words in SHARES.items()]
    rows += [
        (f"90 % intervals of {p} hold the truth", *(_held(t, p) for t in runs.values()))
        for p in BASE
    ]
    feet = "; ".join(_run(t) for t in runs.values())
    head = ("fault of one recording", *(RUNS[name] for name in runs))
    return grid(head, rows, f"{feet}. In brackets: 95 % interval.")


def _right(run: dict, kind: str) -> str:
    answers = [a for a in run["answers"] if a["fault"] == kind]
    return f"{sum(a['right'] for a in answers)} of {len(answers)}"


def _held(run: dict, name: str) -> str:
    return share(run["coverage"]["named"][name]["after"])


def _run(t: dict) -> str:
    first, last = t["seeds"]
    seconds = t["seconds"]["median"]
    return (
        f"{t['trials']} trials, seeds {first} to {last}, median {seconds:.0f} s a diagnosis, "
        f"commit {t['commit'][:7]}, {t['date']}"
    )
