"""Tables of the evidence page that count how often intervals hold the truth."""

from __future__ import annotations

from benchmarks.tables import HERE, grid, stored
from benchmarks.trial_tables import share

UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s2"}


def coverage_table() -> str:
    """Of displacements."""
    c = stored("coverage")
    rows = [
        (name, f"{100 * row['coverage90']:.0f} %", str(row["n"]))
        for name, row in c["parameters"].items()
    ]
    foot = (
        f"{c['campaigns']} campaigns of nine recordings of {c['duration_s']:.0f} s from the "
        f"independent generator, commit {c['commit']}, {c['date']}."
    )
    return grid(("parameter", "90 % intervals that hold the truth", "of"), rows, foot)


def sensor_coverage_table() -> str:
    """Of one quantity alone: intervals normal about the mode, and of some campaigns sampled."""
    runs = {q: stored(f"coverage_{q}") for q in UNITS if (HERE / f"coverage_{q}.json").exists()}
    if not runs:
        return "No run is stored yet."
    rows = []
    for name in next(iter(runs.values()))["parameters"]:
        row = [name]
        for c in runs.values():
            found = c["parameters"][name]
            sampled = found["sampled"]
            row += [share(found["normal"]), f"{sampled['hits']} of {sampled['of']}"]
        rows.append(row)
    said = [
        f"{quantity}: {c['campaigns']} campaigns, seeds {c['seeds'][0]} to {c['seeds'][1]}, noise "
        f"{c['noise']:g} {UNITS[quantity]}, {len(c['not_converged'])} not converged, "
        f"commit {(c['commit'] or '?')[:7]}, {c['date']}"
        for quantity, c in runs.items()
    ]
    head = ["parameter"]
    for quantity in runs:
        head += [f"{quantity} alone: intervals hold the truth", "sampled ones"]
    foot = f"Nine recordings of 6 s each; {'; '.join(said)}. In brackets: 95 % interval."
    return grid(head, rows, foot)
