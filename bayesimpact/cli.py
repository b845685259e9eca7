"""The commands. Thin, and the only place that prints.

Nothing heavy is imported before a command runs: every command imports what it needs in its body.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import click

from bayesimpact.errors import BayesimpactError, InputError

BAD_INPUT = 2
NOT_CONVERGED = 3
INTERRUPTED = 130


class Commands(click.Group):
    """A group that turns what goes wrong in any command into one message and its exit code."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; `InputError` exits 2, other errors of the package 1, Ctrl-C 130."""
        try:
            return super().invoke(ctx)
        except InputError as error:
            _end(ctx, f"bayesimpact: {error}", BAD_INPUT)
        except BayesimpactError as error:
            _end(ctx, f"bayesimpact: {error}", 1)
        except KeyboardInterrupt:
            _end(ctx, "bayesimpact: interrupted", INTERRUPTED)


def _end(ctx: click.Context, message: str, code: int) -> NoReturn:
    click.echo(message, err=True)
    ctx.exit(code)


def common(command: Callable[..., None]) -> Callable[..., None]:
    """Options that every command takes."""
    for option in (
        click.option("--quiet", is_flag=True, help="Print nothing but warnings and errors."),
        click.option(
            "--seed",
            type=click.IntRange(min=0),
            default=0,
            show_default=True,
            help="Same seed, same result.",
        ),
    ):
        command = option(command)
    return command


campaign_argument = click.argument("campaign", type=click.Path(path_type=Path))


def out_option(required: bool) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """`--out DIR`."""
    return click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        required=required,
        metavar="DIR",
        help="Folder for the results; made if absent.",
    )


def made_folder(out: Path) -> Path:
    """Make the folder of `--out`; called once the input has proved good."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"--out {out}", reason.lower(), "a folder that can be written") from None
    return out


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="bayesimpact")
def main() -> None:
    """Identify an impacting system from displacement recordings, and what its model leaves out.

    CAMPAIGN is a folder with campaign.toml and recordings, or that file.
    """
    # A terminal that lacks a character shows a question mark in its place.
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


@main.command()
@campaign_argument
@out_option(required=False)
@common
def check(campaign: Path, out: Path | None, seed: int, quiet: bool) -> None:
    """Read and check CAMPAIGN, plot it, and say what will be estimated.

    With --out the plot is saved as DIR/check.png. Nothing is drawn at random here: --seed is taken
    for the sake of scripts that pass it to every command.
    """
    from bayesimpact.data.read import load_campaign
    from bayesimpact.report.check_text import campaign_text, campaign_warnings, measured_noise

    loaded = load_campaign(campaign)
    noise = measured_noise(loaded)
    if not quiet:
        click.echo(campaign_text(loaded, noise))
    for warning in campaign_warnings(loaded, noise):
        click.echo(f"warning: {warning}", err=True)
    if out is not None:
        from bayesimpact.report.check_figure import campaign_figure

        file = made_folder(out) / "check.png"
        campaign_figure(loaded).savefig(file)
        if not quiet:
            click.echo(f"plot: {file}")
