"""`bayesimpact trial`. Heavy imports happen when it runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from bayesimpact.cluster import one_thread_each
from bayesimpact.console import made_folder


def _listed(text: str | None) -> tuple[str, ...] | None:
    return None if text is None else tuple(part.strip() for part in text.split(",") if part.strip())


OPTIONS: tuple[Callable[[Callable[..., None]], Callable[..., None]], ...] = (
    click.option("--number", type=click.IntRange(min=1), default=20, show_default=True,
                 help="How many trials; they have the seeds SEED, SEED + 1, ..."),
    click.option("--regime", type=click.Choice(["weak", "strong"]), default="weak",
                 show_default=True, help="weak: effects near the detection limit. strong: several "
                 "at once and a large misfit, as real recordings have them."),
    click.option("--kinds", metavar="A,B", help="control, single, pair, outside; in turn. [all] "
                 "fault: a fault of a recording, fault_single: an effect as well. "
                 "strong: several, several_outside. [several twice]"),
    click.option("--effects", metavar="A,B", help="Effects of the catalogue to plant. [all]"),
    click.option("--outside", metavar="A,B", help="Forces outside the catalogue to plant. [all]"),
    click.option("--strength", nargs=2, type=float, metavar="LOW HIGH",
                 help="Range of sizes in detection limits. [1.5 6]"),
    click.option("--rig", metavar="A,B",
                 help="paper, soft, stiff, fast, slow, one, five, plain, small. [all but small]"),
    click.option("--noise", metavar="A,B", help="white, ar1, smoothed, slow. [all but slow]"),
    click.option("--misfit", nargs=2, type=float, metavar="LOW HIGH",
                 help="strong: range of the base misfit over the noise. [3 300]"),
    click.option("--rest", type=click.FloatRange(0, 1), metavar="SHARE",
                 help="strong: share of trials whose recordings begin before the release. [0.25]"),
    click.option("--search/--no-search", default=None,
                 help="Diagnose with the global search, and sample where a report is written; or "
                 "without, as `diagnose --quick` does. [only with --no-report]"),
    click.option("--no-report", is_flag=True,
                 help="Leave out figures and report: faster, and blind for what fails there."),
    click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True,
                 help="Processes of a local Dask cluster; 1 stays in this process."),
    click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler to use instead."),
    click.option("--out", type=click.Path(file_okay=False, path_type=Path), metavar="DIR",
                 default=Path("trials"), show_default=True,
                 help="Folder of the run; one that was interrupted goes on."),
    click.option("--keep", is_flag=True, help="Leave the campaigns on disk."),
    click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True,
                 help="Seed of the first trial. Same seed and options, same trial."),
    click.option("--quiet", is_flag=True, help="Print nothing but warnings and errors."),
)  # fmt: skip


def _options(function: Callable[..., None]) -> Callable[..., None]:
    for option in reversed(OPTIONS):
        function = option(function)
    return function


@click.command()
@_options
def trial(
    number: int,
    regime: str,
    kinds: str | None,
    effects: str | None,
    outside: str | None,
    strength: tuple[float, float] | None,
    rig: str | None,
    noise: str | None,
    misfit: tuple[float, float] | None,
    rest: float | None,
    search: bool | None,
    no_report: bool,
    workers: int,
    scheduler: str | None,
    out: Path,
    keep: bool,
    seed: int,
    quiet: bool,
) -> None:
    """Blind trials: conceal effects in simulated recordings, diagnose them, score the answers.

    An independent rig records the campaigns. All truths are sealed (SHA-256) before the first
    diagnosis. One trial again, bit for bit: the same options with --number 1 and its seed.
    """
    one_thread_each()
    from bayesimpact.data.files import write_text
    from bayesimpact.trial.draw.settings import Settings, strong_settings
    from bayesimpact.trial.run.stamp import stamped
    from bayesimpact.trial.run.trials import run_trials
    from bayesimpact.trial.score.table import summary_text

    given: dict[str, Any] = {
        "kinds": _listed(kinds),
        "effects": _listed(effects),
        "outside": _listed(outside),
        "strength": strength,
        "rig_kinds": _listed(rig),
        "noises": _listed(noise),
        "misfit": misfit,
        "rest": rest,
        "search": no_report if search is None else search,
        "report": not no_report,
    }
    given = {k: v for k, v in given.items() if v is not None}
    settings = strong_settings(**given) if regime == "strong" else Settings(**given)
    bars = _Bars(number, quiet)
    results = run_trials(
        settings,
        range(seed, seed + number),
        made_folder(out, "the same command", kept="finished"),
        workers=workers,
        scheduler=scheduler,
        keep=keep,
        sealed=bars.sealed,
        step=bars.step,
    )
    bars.close()
    summary = stamped(results, settings, range(seed, seed + number))
    write_text(out / "summary.json", _json(summary))
    text = summary_text(summary)
    write_text(out / "summary.txt", text)
    if not quiet:
        click.echo(text, nl=False)


def _json(content: Any) -> str:
    import json

    return json.dumps(content, indent=1, allow_nan=False) + "\n"


class _Bars:
    """One progress bar per stage, on standard error."""

    def __init__(self, number: int, quiet: bool) -> None:
        self.number, self.quiet = number, quiet
        self.stage, self.bar = "", None

    def step(self, stage: str, count: int) -> None:
        from tqdm import tqdm

        if stage != self.stage:
            self.close()
            self.stage = stage
            self.bar = tqdm(total=self.number, desc=stage, unit="trial", disable=self.quiet)
        if self.bar is not None:
            self.bar.update(count)

    def sealed(self, digest: str) -> None:
        self.close()
        if not self.quiet:
            click.echo(f"sealed: seals.txt, SHA-256 {digest}")

    def close(self) -> None:
        if self.bar is not None:
            self.bar.close()
            self.bar = None
