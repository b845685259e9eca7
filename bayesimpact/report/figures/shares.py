"""Figures drawn by two processes, for matplotlib keeps Python's lock while it draws.

    python -m bayesimpact.report.figures.shares FOLDER

is the second one: it draws every other group of figures of the results in FOLDER, and says as JSON
which figures they are.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from bayesimpact.report.archive import load_results
from bayesimpact.report.figures.save import drawers, file_name, save_figures
from bayesimpact.report.results import Results

FIGURES = "figures"

Pictures = dict[int, dict[str, bytes]]  # PNG files by name, by the position of who drew them


def save_all(results: Results, folder: Path) -> dict[str, bytes]:
    """All figures of the results that `folder` holds, into its folder of figures.

    Returns
    -------
    The PNG files' content by name, in the order of the page.
    """
    # other results have too few figures for a second process to pay
    other = started(folder) if results.diagnosis is not None else None
    if other is None:
        pictures = save_share(results, folder, 0, 1)
    else:
        with other:
            pictures = save_share(results, folder, 0, 2)
            told, _ = other.communicate()
        done = other.returncode == 0
        pictures |= read(told, folder) if done else save_share(results, folder, 1, 2)
    return {name: data for i in sorted(pictures) for name, data in pictures[i].items()}


def started(folder: Path) -> subprocess.Popen[bytes] | None:
    """The second process; None where no interpreter can be started."""
    command = [sys.executable, "-m", __name__, str(folder)]
    try:
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    except OSError:
        return None


def save_share(results: Results, folder: Path, share: int, shares: int) -> Pictures:
    """Draw and save what every `shares`-th function draws, from number `share` on."""
    functions = drawers(results)
    return {
        i: save_figures(functions[i](results), folder / FIGURES)
        for i in range(share, len(functions), shares)
    }


def read(told: bytes, folder: Path) -> Pictures:
    """What the other process has saved."""
    return {
        int(i): {n: (folder / FIGURES / f"{file_name(n)}.png").read_bytes() for n in names}
        for i, names in json.loads(told).items()
    }


def main() -> None:
    """The second process."""
    folder = Path(sys.argv[1])
    pictures = save_share(load_results(folder), folder, 1, 2)
    sys.stdout.write(json.dumps({i: list(found) for i, found in pictures.items()}))


if __name__ == "__main__":
    main()
