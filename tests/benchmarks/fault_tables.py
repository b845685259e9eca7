"""The evidence page's tables of faults of recordings."""

from __future__ import annotations

from benchmarks.tables import HERE, grid, stored
from benchmarks.trial_tables import share

BASE = ("c1", "k1", "c2", "g", "k2")
ALONE, BESIDE, NONE = "faults", "fault_single", "controls"


def fault_table() -> str:
    """Every fault alone and beside an effect, and what is reported where there is none."""
    if not all((HERE / f"{name}.json").exists() for name in (ALONE, BESIDE)):
        return "No run is stored yet."
    alone, beside = stored(ALONE), stored(BESIDE)
    kinds = sorted({answer["fault"] for answer in alone["answers"]})
    rows = [(f"`{kind}`", _right(alone, kind), _right(beside, kind)) for kind in kinds]
    rows += [
        ("all", share(alone["right"]["fault"]), share(beside["right"]["fault_single"])),
        _both("a wrong name given with confidence", "confident_wrong_names"),
        _both("fit worse after than before", "worse"),
        _both("crashes, report and figures included", "crashes"),
    ]
    rows += [
        (f"90 % intervals of {name} hold the truth", _held(alone, name), _held(beside, name))
        for name in BASE
    ]
    head = ("fault of one recording", "alone: named, with its place", "beside an effect: both")
    feet = [_run(t) for t in (alone, beside)]
    return grid(head, rows, f"{'; '.join(feet)}. In brackets: 95 % interval.")


def _both(words: str, key: str) -> tuple[str, str, str]:
    return words, share(stored(ALONE)[key]), share(stored(BESIDE)[key])


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
