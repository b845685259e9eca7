"""Tables of the evidence page about recordings with a measured input."""

from __future__ import annotations

from benchmarks.tables import HERE, grid, measured, stored
from benchmarks.trial_tables import share

KINDS = {"sweep": "a sine sweep", "steps": "steps", "noise": "noise", "all": "all"}


def driven_trials_table() -> str:
    """What was said of rigs with a stop under an input."""
    t = stored("driven_trials")
    rows = []
    for kind, words in KINDS.items():
        found = t["kinds"][kind]
        rows.append((words, *(share(found[k]) for k in ("adequate", "named", "wrong", "inside"))))
    foot = (
        f"{t['trials']} rigs, seeds {t['seeds'][0]} to {t['seeds'][1]}. In brackets: 95 % "
        f"interval. Commit {(t['commit'] or '?')[:7]}, {t['date']}."
    )
    head = ("driven by", "nothing hidden: adequate", "one effect: named", "a wrong name")
    return grid((*head, "sizes inside, where named"), rows, foot)


def driven_table() -> str:
    """Times of a long recording."""
    if not (HERE / "driven.json").exists():
        return "No run is stored yet."
    d = stored("driven")
    rows = []
    for key, words in (("no_stop", "without a stop"), ("stop", "with a stop")):
        row = d[key]
        ratios = (f"{row[f'driven_over_{name}']:.1f}" for name in ("recurrence", "decay", "floor"))
        rows.append((words, f"{row['mode_s']:.1f} s", f"{row['driven_us'] / 1e3:.2f} ms", *ratios))
    head = (f"{d['samples']:,} samples under an input", "mode", "one likelihood")
    peers = ("over the plain recurrence of a decay", "over our decay", "over the floor")
    return grid((*head, *peers), rows, measured(d, "one core"))
