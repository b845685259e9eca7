"""Figures drawn by two processes, for matplotlib keeps Python's lock while it draws.

The second one draws every other group of figures of the results in a folder, and says as JSON which
figures they are.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from bayesimpact.report.archive import load_results
from bayesimpact.report.figures.same_package import command
from bayesimpact.report.figures.save import SavedFigures, drawers, file_name, save_drawn
from bayesimpact.report.results import Results

FIGURES = "figures"
MODULE = "bayesimpact.report.figures.shares"
PATIENCE = 300.0
"""Seconds for which a second process may go on after the first one is done."""

Share = dict[int, SavedFigures]  # by the position of who drew


def save_all(results: Results, folder: Path) -> SavedFigures:
    """All figures of the results that `folder` holds, into its folder of figures.

    Returns
    -------
    The PNG files' content by name, in the order of the page, and what could not be drawn.

    Raises
    ------
    OSError : the folder cannot be written
    """
    # other results have too few figures for a second process to pay
    other = started(folder) if results.diagnosis is not None else None
    if other is None:
        found = save_share(results, folder, 0, 1)
    else:
        try:
            found = save_share(results, folder, 0, 2)
            told = _answer(other)
        finally:
            other.kill()
            other.wait()
        second = None if told is None else read(told, folder)
        found |= save_share(results, folder, 1, 2) if second is None else second
    ordered = [found[i] for i in sorted(found)]
    return SavedFigures(
        {name: data for drawn in ordered for name, data in drawn.pictures.items()},
        {name: reason for drawn in ordered for name, reason in drawn.failed.items()},
    )


def _answer(other: subprocess.Popen[bytes]) -> bytes | None:
    """What the second process said; None where it failed or does not end."""
    try:
        told, _ = other.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return None
    return told if other.returncode == 0 else None


def started(folder: Path) -> subprocess.Popen[bytes] | None:
    """The second process; None where no interpreter can be started."""
    try:
        return subprocess.Popen(
            command(MODULE, str(folder.absolute())),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
    except OSError:
        return None


def save_share(results: Results, folder: Path, share: int, shares: int) -> Share:
    """Draw and save what every `shares`-th function draws, from number `share` on."""
    functions = drawers(results)
    return {
        i: save_drawn(functions[i], results, folder / FIGURES)
        for i in range(share, len(functions), shares)
    }


def read(told: bytes, folder: Path) -> Share | None:
    """What the other process has saved; None where its answer is not one."""
    try:
        return {
            int(i): SavedFigures(
                {n: (folder / FIGURES / f"{file_name(n)}.png").read_bytes() for n in names}, failed
            )
            for i, (names, failed) in json.loads(told).items()
        }
    except (ValueError, TypeError, AttributeError, OSError):
        return None


def main() -> None:
    """The second process."""
    folder = Path(sys.argv[1])
    found = save_share(load_results(folder), folder, 1, 2)
    said = {i: [list(drawn.pictures), dict(drawn.failed)] for i, drawn in found.items()}
    sys.stdout.write(json.dumps(said))
