"""From the file of a fleet to its folder: campaigns, table, comparison, page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesimpact.data.files import write_text
from bayesimpact.fleet.compare import compare
from bayesimpact.fleet.page import headline, write_page
from bayesimpact.fleet.plan import Plan
from bayesimpact.fleet.run import Step, run_fleet
from bayesimpact.fleet.table import columns, write_table

SCHEMA = "bayesimpact/fleet/1"


@dataclass(frozen=True)
class FleetOutcome:
    """What a fleet came to.

    Attributes
    ----------
    headline : what the campaigns say together
    page : report.html
    failed : name -> last line of the reason
    converged : False when a campaign that did not fail did not converge either
    """

    headline: str
    page: Path
    failed: Mapping[str, str]
    converged: bool


def fleet_results(
    plan: Plan,
    out: Path,
    *,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    step: Step | None = None,
) -> FleetOutcome:
    """Run the campaigns of a plan and write everything into `out`; arguments as `run_fleet`."""
    rows = run_fleet(plan, out, seed=seed, workers=workers, scheduler=scheduler, step=step)
    write_table(columns(plan, rows), out)
    found = compare(plan, rows, rng=np.random.default_rng(seed))
    failed = {
        s.name: r["failed"] for s, r in zip(plan.sessions, rows, strict=True) if "failed" in r
    }
    content = {
        "schema": SCHEMA,
        "name": plan.name,
        "command": plan.command,
        "seed": seed,
        "campaigns": len(plan.sessions),
        "failed": failed,
        **found.document(),
    }
    write_text(out / "fleet.json", json.dumps(content, indent=1, allow_nan=False) + "\n")
    page = write_page(plan, rows, found, out)
    return FleetOutcome(
        headline(plan, rows, found),
        page,
        {name: reason.strip().splitlines()[-1] for name, reason in failed.items()},
        all(row["converged"] for row in rows if "failed" not in row),
    )
