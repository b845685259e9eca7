"""The evidence page's table of damaged campaigns, killed commands and fleets."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from benchmarks.tables import HERE, grid, stored


def _fuzz(run: dict) -> tuple[str, str]:
    endings = run["endings"]
    good = endings["accepted"] + endings["refused"]
    return (
        f"{run['campaigns']:,} damaged campaigns",
        f"{endings['accepted']:,} accepted, {endings['refused']:,} refused in one message, "
        f"{run['campaigns'] - good} other ends; at most {run['peak_mib']} MiB",
    )


def _strange_campaigns(run: dict) -> tuple[str, str]:
    codes, refused = run["exit_codes"], run["exit_codes"].get("2", 0)
    other = run["campaigns"] - refused - run["reports"]
    return (
        f"{run['campaigns']} strange campaigns, whole path",
        f"{run['reports']} reports with exit code {' or '.join(c for c in codes if c != '2')}, "
        f"{refused} refused, {other} other ends",
    )


def _kills(run: dict) -> tuple[str, str]:
    commands = [name for name, part in run.items() if isinstance(part, dict)]
    return f"{run['kills']} kills -9 of {', '.join(commands)}", f"{run['losses']} losses"


def _fleet_kills(run: dict) -> tuple[str, str]:
    return (
        f"a fleet of {run['campaigns']} campaigns with {run['kills']} kills",
        f"{len(run['different_files'])} files differ from an undisturbed run's",
    )


def _fleet_workers(run: dict) -> tuple[str, str]:
    return (
        f"a fleet of {run['campaigns']} campaigns on two local workers",
        f"{100 * run['efficiency']:.0f} % of twice the speed of one process, start-up included",
    )


RUNS: Mapping[str, Callable[[dict], tuple[str, str]]] = {
    "fuzz": _fuzz,
    "strange_campaigns": _strange_campaigns,
    "kills": _kills,
    "fleet_kills": _fleet_kills,
    "fleet_workers": _fleet_workers,
}


def robustness_table() -> str:
    """One row per stored run, with the commit it was made on."""
    rows = []
    for name, said in RUNS.items():
        if (HERE / f"{name}.json").exists():
            run = stored(name)
            rows.append((f"`{name}.py`", *said(run), f"{run['commit'][:7]}, {run['date']}"))
    return grid(("run", "what", "found", "commit"), rows, "Kills count that fell before the end.")
