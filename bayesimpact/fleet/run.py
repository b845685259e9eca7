"""Runs the campaigns of a fleet, one after another or on a cluster, and goes on where it stopped.

    DIR/campaigns/NAME/      what the command writes for one campaign
    DIR/rows/NAME.json       its line of the table, written last: the campaign is done

Workers get campaigns by value and return files by value; only this process writes into DIR. A row
carries the identity of its work (recordings, command, seed, version): what has changed is done
anew. A campaign that fails leaves its reason and never stops the others.
"""

from __future__ import annotations

import json
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from bayesimpact.cluster import executor
from bayesimpact.data.campaign import Campaign
from bayesimpact.data.files import write_bytes, write_text
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import BayesimpactError, InputError
from bayesimpact.fleet.plan import Plan, Session
from bayesimpact.report.figures.save import file_name
from bayesimpact.workflow import Outcome, diagnose_campaign, fit_campaign, sample_campaign

Row = dict[str, Any]
Step = Callable[[int], None]
"""Called with how many campaigns are done just now."""

CHAIN = "chain"  # a folder that only `--resume` of a single campaign needs


@dataclass(frozen=True)
class Work:
    """What is done with every campaign."""

    command: str
    quick: bool
    seed: int

    def identity(self, campaign: Campaign) -> dict[str, Any]:
        """What a result belongs to."""
        return {
            "sha256": campaign.sha256,
            "command": self.command,
            "quick": self.quick,
            "seed": self.seed,
            "version": metadata.version("bayesimpact"),
        }


def campaign_job(campaign: Campaign, work: Work) -> dict[str, Any]:
    """On a worker: the row of a campaign and its files, or why there are none."""
    with tempfile.TemporaryDirectory(prefix="bayesimpact-") as name:
        out = Path(name)
        try:
            outcome = _outcome(campaign, work, out)
        except BayesimpactError as error:
            return {"failed": str(error)}
        except Exception:
            return {"failed": traceback.format_exc()}
        files = {
            f.relative_to(out).as_posix(): f.read_bytes()
            for f in sorted(out.rglob("*"))
            if f.is_file() and CHAIN not in f.relative_to(out).parts
        }
        return {"row": row_of(outcome), "files": files}


def _outcome(campaign: Campaign, work: Work, out: Path) -> Outcome:
    if work.command == "fit":
        return fit_campaign(campaign, out, seed=work.seed)
    if work.command == "sample":
        return sample_campaign(campaign, out, seed=work.seed)
    return diagnose_campaign(campaign, out, seed=work.seed, quick=work.quick)


def row_of(outcome: Outcome) -> Row:
    """What the table says of one campaign: no times, so that it is the same whenever it is made."""
    found = outcome.diagnosis or {}
    return {
        "converged": bool(outcome.converged),
        "verdict": found.get("verdict", ""),
        "effects": [effect["id"] for effect in found.get("effects", [])],
        "reduced_chi2": found["fit"]["after"]["reduced_chi2"] if found else None,
        "parameters": {
            row.name: {
                "unit": row.unit,
                "estimate": float(row.median),
                "low": float(row.ci90[0]),
                "high": float(row.ci90[1]),
            }
            for row in outcome.results.select("physical", "effect")
        },
    }


def run_fleet(
    plan: Plan,
    out: Path,
    *,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    step: Step | None = None,
) -> list[Row]:
    """The rows of all campaigns, in the order of the plan; a failed one has the key `failed`.

    Parameters
    ----------
    plan : of `load_plan`
    out : an existing folder; what it holds of the same work is not done again
    workers : processes of a local cluster; 1 stays in this process
    scheduler : address of a Dask scheduler to use instead
    step : told how many more campaigns are done
    """
    say = step or (lambda count: None)
    work, store = Work(plan.command, plan.quick, seed), _Store(out)
    loaded = {s.name: _loaded(s) for s in plan.sessions}
    rows: dict[str, Row] = {n: {"failed": c} for n, c in loaded.items() if isinstance(c, str)}
    campaigns = {name: c for name, c in loaded.items() if isinstance(c, Campaign)}
    for name, campaign in campaigns.items():
        known = store.row(name, work.identity(campaign))
        if known is not None:
            rows[name] = known
    say(len(rows))
    missing = [name for name in campaigns if name not in rows]
    with executor(workers, scheduler) as distribute:
        jobs = ((name, (campaigns[name], work)) for name in missing)
        for name, answered in distribute(campaign_job, jobs):
            rows[name] = store.keep(name, answered, work.identity(campaigns[name]))
            say(1)
    return [rows[s.name] for s in plan.sessions]


def _loaded(session: Session) -> Campaign | str:
    """A campaign, or why it cannot be used."""
    try:
        return load_campaign(session.folder)
    except InputError as error:
        return str(error)


class _Store:
    """The folder of a fleet."""

    def __init__(self, out: Path) -> None:
        self.out = out
        (out / "rows").mkdir(exist_ok=True)
        (out / "campaigns").mkdir(exist_ok=True)

    def row(self, name: str, identity: Mapping[str, Any]) -> Row | None:
        """What is known of the same work; None for other work, or a file that is damaged."""
        try:
            kept = json.loads(self._row(name).read_text(encoding="utf-8"))
            same = kept["identity"] == identity
            return dict(kept["row"]) if same else None
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None

    def keep(self, name: str, answered: Mapping[str, Any], identity: Mapping[str, Any]) -> Row:
        """Write a campaign's files, then its row; a failure is not kept, but tried again."""
        if "row" not in answered:
            return {"failed": str(answered["failed"])}
        folder = self.out / "campaigns" / file_name(name)
        for relative, content in answered["files"].items():
            target = folder / relative
            target.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(target, content)
        text = json.dumps({"identity": identity, "row": answered["row"]}, indent=1)
        write_text(self._row(name), text + "\n")
        return dict(json.loads(text)["row"])

    def _row(self, name: str) -> Path:
        return self.out / "rows" / f"{file_name(name)}.json"


def done(rows: Sequence[Row]) -> list[Row]:
    """The rows that did not fail."""
    return [row for row in rows if "failed" not in row]
