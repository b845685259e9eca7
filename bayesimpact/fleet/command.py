"""`bayesimpact fleet`. Heavy imports happen when it runs."""

from __future__ import annotations

from pathlib import Path

import click

from bayesimpact.cluster import one_thread_each
from bayesimpact.console import NOT_CONVERGED, common, made_folder


@click.command()
@click.argument("file", metavar="FILE.toml", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Folder for the results; made if absent. What it holds is not done again."
    "  [default: FILE without its ending]",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Processes of a local Dask cluster; 1 stays in this process.",
)
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler to use instead.")
@common
@click.pass_context
def fleet(
    ctx: click.Context,
    file: Path,
    out: Path | None,
    workers: int,
    scheduler: str | None,
    seed: int,
    quiet: bool,
) -> None:
    """Many campaigns: identify or diagnose each, then compare them.

    FILE.toml lists campaigns with dates and conditions. DIR gets a folder for every campaign, one
    table (fleet.csv, fleet.parquet), fleet.json and a report: which parameters drift or jump
    between sessions or go with a condition, the population that the campaigns come from, and those
    whose physics is not that of the others. A run that was interrupted goes on; a campaign that
    fails never stops the rest.

    \b
    name = "rig over the summer"
    command = "diagnose"             # or "fit", "sample"
    quick = true                     # diagnose without sampling
    [[campaign]]                     # one or more
    folder = "may_1"                 # relative to this file
    date = 2026-05-01
    temperature_c = 21.5             # any further number or text is a condition
    """
    one_thread_each()
    from bayesimpact.fleet.plan import load_plan
    from bayesimpact.fleet.write import fleet_results

    plan = load_plan(file)
    out = out or file.with_suffix("")
    command = f"bayesimpact fleet {file} --out {out} --seed {seed}"
    folder = made_folder(out, command, kept="finished")
    from tqdm.auto import tqdm

    with tqdm(total=len(plan.sessions), desc=plan.command, unit="campaign", disable=quiet) as bar:
        found = fleet_results(
            plan, folder, seed=seed, workers=workers, scheduler=scheduler, step=bar.update
        )
    if not quiet:
        click.echo(found.headline)
        click.echo(f"report: {found.page}")
    for name, why in found.failed.items():
        click.echo(f"bayesimpact: {name}: {why}", err=True)
    if found.failed or not found.converged:
        ctx.exit(NOT_CONVERGED)
