"""What all commands share: options, progress, results in words, errors as messages."""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import click

from bayesimpact.data.files import clear_unfinished
from bayesimpact.data.lock import locked
from bayesimpact.errors import (
    BayesimpactError,
    InputError,
    interruption_kept,
    system_words,
    terminated_like_ctrl_c,
)

if TYPE_CHECKING:
    from bayesimpact.data.campaign import Campaign

BAD_INPUT = 2
NOT_CONVERGED = 3
INTERRUPTED = 130
FAILED_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
_GO_ON = "bayesimpact.go_on"  # in a context's meta: tells what to type after an interruption
_BLOCKS = "chain/**/block-*.npz"  # of `inference.sampling.chainfile`, in a folder of results

Kept = Literal["nothing", "draws", "finished"]
"""What an interrupted command leaves to go on with: the sampler's draws, by `--resume`, or the
campaigns that were finished, by the same command.
"""


class Commands(click.Group):
    """A group that turns what goes wrong in any command into one message and its exit code."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Every command with its first sentence, whole: click cuts it to one line."""
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, one.get_short_help_str(limit=200)) for name, one in self.commands.items()]
            )

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; `InputError` exits 2, other errors of the package 1, Ctrl-C and SIGTERM
        130; a place that cannot be written exits 2, a disk that is full or fails 1.
        """
        with terminated_like_ctrl_c():
            try:
                with interruption_kept():
                    return super().invoke(ctx)
            except InputError as error:
                _end(ctx, f"bayesimpact: {error}", BAD_INPUT)
            except BayesimpactError as error:
                _end(ctx, f"bayesimpact: {error}", 1)
            except KeyboardInterrupt:
                _end(ctx, f"bayesimpact: interrupted{_how_to_go_on(ctx)}", INTERRUPTED)
            except MemoryError:
                words = "out of memory; shorter recordings, or fewer samples a second, need less"
                _end(ctx, f"bayesimpact: {words}{_how_to_go_on(ctx)}", 1)
            except BrokenPipeError:
                raise
            except OSError as error:
                failed = error.errno in FAILED_DISK
                again = _how_to_go_on(ctx) if failed else ""
                code = 1 if failed else BAD_INPUT
                _end(ctx, f"bayesimpact: {system_words(error)}{again}", code)


def _how_to_go_on(ctx: click.Context) -> str:
    tell = ctx.meta.get(_GO_ON)
    return f"; {tell()}" if tell else ""


def _end(ctx: click.Context, message: str, code: int) -> NoReturn:
    click.echo(message, err=True)
    ctx.exit(code)


def _common(seed: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Options that every command takes; `seed`: what --seed does there."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        number = click.IntRange(min=0)
        given = click.option("--seed", type=number, default=0, show_default=True, help=seed)
        quiet = click.option("--quiet", is_flag=True, help="Print nothing but warnings and errors.")
        return given(quiet(command))

    return decorate


common = _common("Same seed, same result.")
without_chance = _common("No effect here; taken since all commands take it.")


_DATA = "bayesimpact.data"  # in a context's meta: folders of --data


def campaign_argument(command: Callable[..., None]) -> Callable[..., None]:
    """CAMPAIGN, and `--data FOLDER` for recordings that lie outside its folder."""

    def kept(ctx: click.Context, _: click.Parameter, folders: tuple[Path, ...]) -> None:
        ctx.meta[_DATA] = folders

    option = click.option(
        "--data",
        type=click.Path(exists=True, file_okay=False, path_type=Path),
        multiple=True,
        metavar="FOLDER",
        expose_value=False,
        callback=kept,
        help="A folder beside CAMPAIGN whose files campaign.toml may name; may be repeated.",
    )
    return click.argument("campaign", type=click.Path(path_type=Path))(option(command))


def loaded_campaign(campaign: Path) -> Campaign:
    """CAMPAIGN, read and checked."""
    from bayesimpact.data.read import load_campaign

    return load_campaign(campaign, click.get_current_context().meta[_DATA])


def _out(words: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    return click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        metavar="DIR",
        help=f"Folder for the results; made if absent.{words}",
    )


out_option = _out("")
results_option = _out("  [default: a folder in CAMPAIGN's, called as this command]")


def results_folder(campaign: Path, out: Path | None) -> Path:
    """The folder of `--out`, or the one beside campaign.toml that is called as the command."""
    if out is not None:
        return out
    home = campaign if campaign.is_dir() else campaign.parent
    return home / str(click.get_current_context().info_name)


def made_folder(out: Path, command: str = "", *, kept: Kept = "nothing") -> Path:
    """Make the folder of `--out` and hold it until the command ends; called once the input has
    proved good.

    Parameters
    ----------
    command : what to type after an interruption; "" where that needs no telling
    kept : what it goes on with then
    """
    ctx = click.get_current_context()
    try:
        out.mkdir(parents=True, exist_ok=True)
        if command:  # before the lock: who sees it may interrupt at once
            ctx.meta[_GO_ON] = lambda: _after_interruption(out, command, kept)
        ctx.with_resource(locked(out))
        clear_unfinished(out)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"--out {out}", reason.lower(), "a folder that can be written") from None
    return out


def _after_interruption(out: Path, command: str, kept: Kept) -> str:
    """What is left to go on with, and what to type; a search leaves nothing."""
    if kept == "finished":
        return f"what was finished is kept in {out}; to go on: {command}"
    if kept == "draws" and any(out.glob(_BLOCKS)):
        return f"the draws so far are kept in {out}; to go on with them: {command} --resume"
    return f"there is nothing to resume; to begin again: {command}"


def telling(quiet: bool) -> Callable[[str], None]:
    """Progress in words on stderr, with the seconds since the start, above whatever bar is shown;
    nothing when quiet. What must be compiled is announced until the command ends.
    """
    import sys
    import time

    from tqdm import tqdm

    from bayesimpact.model.jit.compiled import compilation_announced

    began = time.perf_counter()

    def say(message: str) -> None:
        if not quiet:
            tqdm.write(f"[{time.perf_counter() - began:6.1f} s] {message}", file=sys.stderr)

    click.get_current_context().with_resource(compilation_announced(say))
    return say


def announce(outcome: Any, out: Path, quiet: bool) -> None:
    """Say what was found, and where the report is."""
    if quiet:
        return
    if outcome.diagnosis is not None:
        click.echo(f"{outcome.diagnosis['verdict']}: {outcome.diagnosis['summary']}")
    else:
        click.echo(outcome.results.headline or outcome.results.verdict)
    click.echo(f"report: {out / 'report.html'}")


def finish(ctx: click.Context, *outcomes: Any) -> None:
    """Exit code 3 when something did not converge, or a part of the report could not be made."""
    unmade = [name for outcome in outcomes for name in outcome.failed]
    words = [unmade_words(unmade)] if unmade else []
    if not all(outcome.converged for outcome in outcomes):
        words.insert(0, "not converged; the report says what did not")
    if words:
        click.echo(f"bayesimpact: {'; '.join(words)}", err=True)
        ctx.exit(NOT_CONVERGED)


def unmade_words(names: Sequence[str]) -> str:
    """What a report lacks, and what finishes it."""
    some = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return f"the report lacks {some} and says why; `bayesimpact report DIR` tries again"
