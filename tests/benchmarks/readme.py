"""Writes the evidence page's tables from stored results: `python tests/benchmarks/readme.py`."""

from __future__ import annotations

import re
import sys
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

if __name__ == "__main__":  # imports go by the tests' folder, not by this one
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from benchmarks.coverage_tables import coverage_table, sensor_coverage_table
from benchmarks.driven_tables import driven_table, driven_trials_table
from benchmarks.fault_tables import fault_table
from benchmarks.robustness_tables import robustness_table
from benchmarks.tables import HERE, grid, measured, stored
from benchmarks.trial_tables import (
    blind_table,
    controls_table,
    next_table,
    single_table,
    strong_table,
    trial_coverage_table,
)

from bayesimpact.model import effects

EFFECTS = {effect.id: effect for effect in effects.EFFECTS}
PAGE = HERE / "EVIDENCE.md"


def duration(us: float) -> str:
    """Microseconds in a unit that fits."""
    return f"{us:.0f} us" if us < 1e3 else f"{us / 1e3:.1f} ms" if us < 1e5 else f"{us / 1e6:.2f} s"


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
    return grid(
        ("nine recordings of 6,000 samples", "median, us"),
        ((label, f"{value:.0f}") for label, value in rows),
        measured(k, "one core"),
    )


def peers_table() -> str:
    """One simulation by other people's integrators."""
    p = stored("peers")
    head = (f"{p['samples']:,} samples, {p['contacts']} contacts", "largest error, m", "median")
    rows = [
        (
            name,
            "" if row["error_m"] is None else f"{row['error_m']:.0e}",
            duration(row["us"]),
            f"{row['over_ours']:,.0f}",
        )
        for name, row in sorted(p["peers"].items(), key=lambda item: item[1]["us"])
    ]
    return grid((*head, "over ours"), rows, measured(p, "one core"))


def added_table() -> str:
    """Cost and error of the steps that an added effect needs."""
    a = stored("added")
    here, half = a["scales"].index(1.0), a["scales"].index(0.5)
    plain = a["recurrence_ns_per_sample"]

    def row_of(effect: str, row: dict[str, Any]) -> tuple[str, ...]:
        cost = row["ns_per_sample"]
        return (
            effect.replace("_", " "),
            f"{cost[here]:.0f}",
            f"{cost[here] / plain[here]:.1f}",
            f"{row['halving_m']:.0e}",
            f"{cost[half] / cost[here]:.1f}",
        )

    ranked = sorted(a["effects"].items(), key=lambda item: item[1]["ns_per_sample"][here])
    rows = [("none: plain recurrence", f"{plain[here]:.0f}", "1.0", "", "")]
    rows += [row_of(effect, row) for effect, row in ranked]
    change = "change with half the steps, m"
    head = ("added effect", "ns per sample", "over the first", change, "at what cost")
    note = measured(a, f"{a['samples']:,} samples, one thread")
    return grid(head, rows, f"{of_pairs(a['pairs'])} {note}")


def of_pairs(pairs: dict[str, dict[str, float]]) -> str:
    """Cost and error of two added effects, in words."""
    costs = {name: row["ns_per_sample"] for name, row in pairs.items()}
    dearest = max(costs, key=costs.__getitem__)
    return (
        f"All {len(costs)} pairs of effects: median {median(costs.values()):.0f} ns, "
        f"{sum(cost <= 40 for cost in costs.values())} within 40 ns, at most {costs[dearest]:.0f} "
        f"({dearest.replace('_', ' ')}); half the steps change them by "
        f"{max(row['halving_m'] for row in pairs.values()):.0e} m at most."
    )


def samplers_table() -> str:
    """Effective draws per second."""
    s = stored("samplers")
    rows = []
    for name, row in s["samplers"].items():
        rate, ratio = "none: disagrees with ours", ""
        if row["agrees"]:
            rate, ratio = f"{row['ess_per_s']:,.0f}", f"{row['ours_over_this']:,.1f}"
        if row["long_enough"] is False:
            rate += f" (only {row['autocorrelation_times']:.0f} autocorrelation times)"
        per_draw = f"{row['evaluations_per_effective_draw']:,.1f}"
        rows.append((name, str(row["threads"]), rate, ratio, per_draw))
    head = ("sampler", "threads", "effective draws per s", "ours over it", "evaluations per draw")
    return grid(head, rows, measured(s, f"worst of {s['parameters']} parameters"))


def scaling_table() -> str:
    """How the cost of a likelihood grows."""
    s = stored("scaling")
    rows = []
    for label, series, grown in (
        ("samples of nine recordings (longer, as the motion dies away)", "samples", "samples"),
        ("recordings of 6,000 samples", "recordings", "recordings"),
        ("impacts in 6,000 samples (cost of the stop)", "impacts", "impacts"),
        ("parameter vectors in one call", "batch", "vectors"),
    ):
        values, slope = s[series][grown], s[series]["slope"]
        rows.append((label, f"{values[0]:,}", f"{values[-1]:,}", f"{slope:.2f}"))
    t = s["threads"]
    foot = (
        f"A batch on {t['threads']} threads is {100 * t['efficiency']:.0f} % efficient by the "
        f"clock and {100 * t['efficiency_by_processor_time']:.0f} % by processor time; an impact "
        f"takes {s['impacts']['ns_per_impact']:.0f} ns. {measured(s)}"
    )
    return grid(("one likelihood against", "from", "to", "slope of log time"), rows, foot)


def startup_table() -> str:
    """Fresh processes."""
    s = stored("startup")
    rows = [
        (label, f"{s[f'{key}_s']:.1f}", f"{s[f'{key}_processor_s']:.1f}")
        for label, key in (
            ("`bayesimpact --help`", "help"),
            ("first likelihood, compiled before", "first_likelihood"),
            ("mode from raw recordings, after imports", "mode"),
            ("first likelihood, nothing compiled", "cold_first_likelihood"),
            ("everything compiled anew", "cold"),
        )
    ]
    return grid(("a fresh process", "s", "processor time, s"), rows, measured(s))


def loops_table() -> str:
    """Whole diagnoses."""
    found = stored("loops")
    rows = []
    for name, row in found["campaigns"].items():
        verdicts = dict.fromkeys(r["verdict"] for r in row.values())
        times = [
            f"{row[c]['s']:.0f} ({row[c]['slowest_s']:.0f})" if c in row else ""
            for c in ("quick", "sampled")
        ]
        rows.append((name, ", ".join(verdicts), *times))
    foot = (
        f"Median of {found['runs']} runs, in brackets the slowest; plain recurrence of the nine "
        f"recordings {found['recurrence_us']:.0f} us in the same minutes. {measured(found)}"
    )
    return grid(("missing", "verdict", "`--quick`, s", "with sampling, s"), rows, foot)


def power_table() -> str:
    """How large an effect must be."""
    p = stored("detection_power")
    rows = []
    for effect, row in p["effects"].items():
        parameter = EFFECTS[effect].parameter(row["size"])
        sizes = (row["limit"], row["detected_90_size"], row["named_90_size"])
        shown = ("beyond" if size is None else f"{size:.2g}" for size in sizes)
        rival = f"{row['nearest'].replace('_', ' ')} ({100 * row['distinct']:.0f} % apart)"
        name = f"{effect.replace('_', ' ')}, {row['size'].replace('_', ' ')}"
        rows.append((name, parameter.unit, *shown, rival))
    head = ("effect, size", "unit", "limit", "found", "named", "nearest rival")
    return grid(head, rows, f"Commit {p['commit'][:7]}, {p['date']}.")


def sbc_table() -> str:
    """Simulation-based calibration, one column of verdicts per run."""
    runs = stored("sbc")
    rows = []
    for model, first in runs[0]["models"].items():
        outside = [", ".join(run["models"][model]["outside"]) or "none" for run in runs]
        held = [p["covered_90"] for r in runs for p in r["models"][model]["parameters"].values()]
        ranked = f"{len(first['parameters'])}"
        held_text = f"{100 * min(held):.0f} to {100 * max(held):.0f} %"
        rows.append((model, ranked, *outside, held_text))
    seeds = [f"{run['seed']} to {run['seed'] + run['replicates'] - 1}" for run in runs]
    head = (
        "model",
        "quantities ranked",
        *(f"outside the 99 % band, seeds {s}" for s in seeds),
        "90 % intervals hold the truth in",
    )
    every = [row for run in runs for row in run["models"].values()]
    count, out = sum(len(r["parameters"]) for r in every), sum(len(r["outside"]) for r in every)
    commits = " and ".join(run["commit"][:7] + run["commit"][40:] for run in runs)
    foot = (
        f"{out} of {count} outside, {0.01 * count:.1f} expected by chance; 300 replicates per run."
    )
    return grid(head, rows, f"{foot} Commits {commits}, {runs[-1]['date']}.")


TABLES = {
    "trials": partial(blind_table, "trials"),
    "pairs": partial(blind_table, "pairs"),
    "controls": controls_table,
    "slow_noise": partial(blind_table, "slow_noise"),
    "trial_coverage": trial_coverage_table,
    "singles": single_table,
    "strong": strong_table,
    "faults": fault_table,
    "next": next_table,
    "detection_power": power_table,
    "sbc": sbc_table,
    "robustness": robustness_table,
    "kernel": kernel_table,
    "peers": peers_table,
    "added": added_table,
    "samplers": samplers_table,
    "scaling": scaling_table,
    "startup": startup_table,
    "loops": loops_table,
    "coverage": coverage_table,
    "sensor_coverage": sensor_coverage_table,
    "driven_trials": driven_trials_table,
    "driven": driven_table,
}


def rendered(text: str) -> str:
    """The evidence page with its tables made anew."""
    for name, table in TABLES.items():
        pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
        text = re.sub(pattern, lambda m, t=table: m[1] + t() + "\n" + m[2], text, flags=re.DOTALL)
    return text


if __name__ == "__main__":
    PAGE.write_text(rendered(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
