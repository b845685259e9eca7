"""The commands. Thin; only they, and what they share in `console`, print.

Nothing heavy is imported before a command runs: every command imports what it needs in its body.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any

import click

from bayesimpact.console import (
    BAD_INPUT,
    NOT_CONVERGED,
    Commands,
    announce,
    campaign_argument,
    common,
    finish,
    loaded_campaign,
    made_folder,
    out_option,
    results_folder,
    results_option,
    telling,
    unmade_words,
    without_chance,
)
from bayesimpact.errors import InputError
from bayesimpact.fleet.command import fleet
from bayesimpact.trial.command import trial


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="bayesimpact")
def main() -> None:
    """Identify an impacting system from recordings of its motion, and what its model leaves out.

    CAMPAIGN is a folder with campaign.toml and recordings, or that file.

    \b
    Completion of commands and options in bash (or zsh, fish):
    eval "$(_BAYESIMPACT_COMPLETE=bash_source bayesimpact)"
    """
    # Numbers that overflow in a trial step are dealt with there; the warning tells a user nothing.
    warnings.filterwarnings("ignore", category=RuntimeWarning)
    # A terminal that lacks a character shows a question mark in its place.
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


@main.command()
@campaign_argument
@out_option
@without_chance
def check(campaign: Path, out: Path | None, seed: int, quiet: bool) -> None:
    """Read and check CAMPAIGN, plot it, and say what will be estimated.

    With --out the plot is saved as DIR/check.png.
    """
    from bayesimpact.data.faults.find import set_aside
    from bayesimpact.report.check_text import campaign_text, campaign_warnings, measured_noise
    from bayesimpact.report.fault_text import fault_lines

    loaded = loaded_campaign(campaign)
    cleaned, faults = set_aside(loaded)
    noise = measured_noise(cleaned)
    if not quiet:
        click.echo(campaign_text(loaded, noise))
    for line in fault_lines(loaded, faults):
        click.echo(line, err=quiet)
    for warning in campaign_warnings(cleaned, noise):
        click.echo(f"warning: {warning}", err=True)
    if out is not None:
        from bayesimpact.report.check_figure import campaign_figure

        file = made_folder(out) / "check.png"
        campaign_figure(loaded, faults).savefig(file)
        if not quiet:
            click.echo(f"plot: {file}")


@main.command()
@click.argument("folder", metavar="FOLDER", type=click.Path(file_okay=False, path_type=Path))
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option("--mass", type=click.FloatRange(min=0, min_open=True), help="Moving mass, kg.")
@click.option("--stop/--no-stop", default=None, help="Is there an obstacle?")
@click.option("--case", metavar="NAME", help="The obstacle's name.")
@click.option("--unit", metavar="UNIT", help="Of readings for which the files give none: mm, ...")
@click.option(
    "--rate",
    type=click.FloatRange(min=0, min_open=True),
    metavar="HZ",
    help="Sampling rate of files without a clock.",
)
@click.option("--plot", is_flag=True, help="Draw all channels into FOLDER/channels.png.")
@without_chance
def new(
    folder: Path, files: tuple[Path, ...], mass: float | None, stop: bool | None, case: str | None,
    unit: str | None, rate: float | None, plot: bool, seed: int, quiet: bool,
) -> None:  # fmt: skip
    """Look at instrument files FILE... and write FOLDER/campaign.toml with comments.

    Says which channels the files hold and what it assumed. Files from elsewhere are copied into
    FOLDER; what is there already is never replaced. Nothing is asked.
    """
    from bayesimpact.data import draft
    from bayesimpact.data.quantity import UNITS
    from bayesimpact.data.read import load_campaign

    if unit not in (None, *UNITS):
        raise InputError("--unit", f'"{unit}"', ", ".join(UNITS))
    if (folder / "campaign.toml").exists():
        accepted = "a folder without one; it is never replaced"
        raise InputError(str(folder / "campaign.toml"), "a campaign already", accepted)
    looks = draft.looks_at(folder, files)
    title = folder.resolve().name or "campaign"
    made = draft.draft(title, looks, draft.DraftedRig(mass, stop, case, unit, rate))
    file = draft.write(folder, looks, made)
    if plot:
        from bayesimpact.report.channel_figure import channel_figure

        channel_figure([(one.file, one.channels) for one in looks]).savefig(folder / "channels.png")
    if quiet:
        return
    for one in looks:
        click.echo(f"{one.file}:")
        for channel in one.channels:
            click.echo(f"  {draft.listing(channel)}")
    click.echo(f"written: {file}" + (f", {folder / 'channels.png'}" if plot else ""))
    for line in (*made.assumed, *made.needed):
        click.echo(f"  {line}")
    try:
        load_campaign(folder)
        click.echo(f"ready for: bayesimpact check {folder}, bayesimpact diagnose {folder}")
    except InputError as error:
        click.echo(f"not yet complete: {error}")


@main.command()
@campaign_argument
@results_option
@common
@click.pass_context
def fit(ctx: click.Context, campaign: Path, out: Path | None, seed: int, quiet: bool) -> None:
    """Find the mode: differential evolution with the Metropolis criterion, then a polish."""
    loaded, out = loaded_campaign(campaign), results_folder(campaign, out)
    from bayesimpact.workflow import fit_campaign

    command = f"bayesimpact fit {campaign} --out {out} --seed {seed}"
    folder = made_folder(out, command)
    outcome = fit_campaign(loaded, folder, seed=seed, command=command, say=telling(quiet))
    announce(outcome, out, quiet)
    finish(ctx, outcome)


@main.command()
@campaign_argument
@results_option
@click.option("--resume", is_flag=True, help="Go on with the chain that DIR holds.")
@common
@click.pass_context
def sample(
    ctx: click.Context, campaign: Path, out: Path | None, resume: bool, seed: int, quiet: bool
) -> None:
    """Sample the posterior by emcee; the backbone is the posterior-predictive check."""
    loaded, out = loaded_campaign(campaign), results_folder(campaign, out)
    from bayesimpact.workflow import sample_campaign

    command = f"bayesimpact sample {campaign} --out {out} --seed {seed}"
    folder = made_folder(out, command, kept="draws")
    told: dict[str, Any] = {"say": telling(quiet), "bar": False if quiet else None}
    outcome = sample_campaign(loaded, folder, seed=seed, resume=resume, command=command, **told)
    announce(outcome, out, quiet)
    finish(ctx, outcome)


@main.command()
@campaign_argument
@results_option
@click.option("--quick", is_flag=True, help="No sampling: intervals from the mode's curvature.")
@click.option(
    "--certify",
    type=click.IntRange(min=0),
    default=0,
    metavar="N",
    help="Repeat the loop on N simulated controls, and on N campaigns with what was named.",
)
@click.option("--resume", is_flag=True, help="Go on with the chains that DIR holds.")
@click.option(
    "--effects",
    "own",
    type=click.Path(path_type=Path),
    metavar="FILE.py",
    help="Effects of your own beside the catalogue. The file is executed as Python: it can do "
    "whatever you can. Nothing else that a command takes is executed.",
)
@common
@click.pass_context
def diagnose(
    ctx: click.Context,
    campaign: Path,
    out: Path | None,
    quick: bool,
    certify: int,
    resume: bool,
    own: Path | None,
    seed: int,
    quiet: bool,
) -> None:
    """Locate, name, model and show what the base model leaves out of CAMPAIGN."""
    loaded, out = loaded_campaign(campaign), results_folder(campaign, out)
    from bayesimpact.model.own_effects import catalogue_with
    from bayesimpact.workflow import diagnose_campaign

    effects = catalogue_with(own or ())
    command = f"bayesimpact diagnose {campaign} --out {out} --seed {seed}"
    command += f" --effects {own}" if own else ""
    command += " --quick" * quick + f" --certify {certify}" * bool(certify)
    outcome = diagnose_campaign(
        loaded,
        made_folder(out, command, kept="nothing" if quick else "draws"),
        seed=seed,
        quick=quick,
        certify=certify,
        resume=resume,
        effects=effects,
        command=command,
        say=telling(quiet),
        bar=False if quiet else None,
    )
    announce(outcome, out, quiet)
    finish(ctx, outcome)


@main.command()
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--pdf", is_flag=True, help="Print it as DIR/report.pdf by an installed Chromium.")
@click.option("--latex", is_flag=True, help="Write its tables for a paper: DIR/tables.tex.")
@without_chance
@click.pass_context
def report(
    ctx: click.Context, folder: Path, pdf: bool, latex: bool, seed: int, quiet: bool
) -> None:
    """Write the report of whatever DIR holds, from its files alone."""
    from bayesimpact.report.write import more_files, rewrite_report

    if folder.is_dir() and (folder / "results.nc").exists():
        made_folder(folder, f"bayesimpact report {folder}")
    written = rewrite_report(folder)
    for file in (written.page, *more_files(folder, pdf=pdf, latex=latex)):
        if not quiet:
            click.echo(f"report: {file}")
    if written.failed:
        click.echo(f"bayesimpact: {unmade_words(list(written.failed))}", err=True)
        ctx.exit(NOT_CONVERGED)


@main.command("next")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option(
    "--effects",
    "own",
    type=click.Path(path_type=Path),
    metavar="FILE.py",
    help="Effects of your own, as for the diagnosis. The file is executed as Python.",
)
@common
@click.pass_context
def next_(ctx: click.Context, folder: Path, own: Path | None, seed: int, quiet: bool) -> None:
    """Which recording would settle what DIR's diagnosis left open.

    Ranks releases, obstacles, lengths, rates and gaps by the ln odds that they are expected to give
    between the models that are left, and by how they narrow k2. Writes DIR/next.json, and the
    report with the table.
    """
    from bayesimpact.model.own_effects import load_effects
    from bayesimpact.report.diagnosis.next_words import table_lines
    from bayesimpact.workflow import NEXT_FILE, next_recording

    effects = load_effects(own) if own else ()
    if folder.is_dir() and (folder / "results.nc").exists():
        made_folder(folder, f"bayesimpact next {folder}")
    content, written = next_recording(folder, seed=seed, effects=effects, say=telling(quiet))
    if not quiet:
        for line in (*table_lines(content), content["sentence"]):
            click.echo(line)
        click.echo(f"next: {folder / NEXT_FILE}")
        click.echo(f"report: {written.page}")
    if written.failed:
        click.echo(f"bayesimpact: {unmade_words(list(written.failed))}", err=True)
        ctx.exit(NOT_CONVERGED)


@main.command()
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("bayesimpact-demo"),
    show_default=True,
    metavar="DIR",
    help="Folder for the results; made if absent.",
)
@common
@click.pass_context
def demo(ctx: click.Context, out: Path, seed: int, quiet: bool) -> None:
    """The whole story on bundled recordings, in two parts.

    First the main job, from raw recordings to posterior and report (in DIR). Then a campaign that
    hides something: its base fit looks right; the diagnosis says what is missing and corrects the
    stiffness (in DIR/concealed; as `diagnose --quick`). What was hidden is opened at the very end,
    beside the answer.
    """
    from bayesimpact.data.bundled import bundled_campaign
    from bayesimpact.data.read import load_campaign

    hiding = bundled_campaign("concealed")
    open_book, concealed = load_campaign(bundled_campaign("paper")), load_campaign(hiding)
    from bayesimpact.workflow import diagnose_campaign, sample_campaign

    say = telling(quiet)
    told: dict[str, Any] = {"seed": seed, "command": "bayesimpact demo", "say": say}
    told["bar"] = False if quiet else None
    say("part 1: recordings that hide nothing")
    first = sample_campaign(open_book, made_folder(out, "bayesimpact demo"), **told)
    announce(first, out, quiet)
    say("part 2: recordings that hide something")
    second = diagnose_campaign(concealed, made_folder(out / "concealed"), quick=True, **told)
    announce(second, out / "concealed", quiet)
    if not quiet:
        from bayesimpact.trial.run.truth import compared, open_truth

        click.echo("\nWhat was hidden, opened now:")
        for line in compared(second.diagnosis or {}, open_truth(hiding)):
            click.echo(line)
    finish(ctx, first, second)


@main.command()
@click.option(
    "--check",
    "own",
    type=click.Path(path_type=Path),
    metavar="FILE.py",
    help="Check the effects that FILE.py defines as those of the catalogue are. The file is "
    "executed as Python.",
)
@without_chance
@click.pass_context
def effects(ctx: click.Context, own: Path | None, seed: int, quiet: bool) -> None:
    """List the catalogue of effects: equations, parameters and units.

    With --check, a table of checks of your own: units, limit at the null value, sign of the energy,
    convergence of the steps, derivatives. Exit code 2 when one failed.
    """
    from bayesimpact.model.effects import EFFECTS
    from bayesimpact.model.effects.catalogue import listing

    if own is not None:
        from bayesimpact.diagnosis.effect_check import check_effect
        from bayesimpact.model.own_effects import load_effects

        checks = [one for effect in load_effects(own) for one in check_effect(effect)]
        for check in checks:
            if not quiet or check.result == "failed":
                click.echo(f"{check.effect}  {check.name:<32} {check.result:<8} {check.detail}")
        ctx.exit(BAD_INPUT if any(check.result == "failed" for check in checks) else 0)
    for effect in () if quiet else EFFECTS:
        click.echo("\n".join(listing(effect)))


main.add_command(fleet)
main.add_command(trial)
