"""Where a stored result comes from: settings, seeds, versions, commit, date."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.run.blind import LIBRARIES
from bayesimpact.trial.score.summary import summarise


def origin() -> dict[str, Any]:
    """Date, versions of the libraries, and the commit when the package lies in a Git checkout."""
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "commit": commit(),
        "versions": {name: metadata.version(name) for name in LIBRARIES},
    }


def commit() -> str | None:
    """Commit of the checkout, with a + when the package differs from it; None elsewhere."""
    package = Path(__file__).resolve().parents[2]
    try:
        head = _git(package, "rev-parse", "HEAD")
        return head + ("+" if _git(package, "status", "--porcelain", "--", str(package)) else "")
    except (OSError, subprocess.CalledProcessError):
        return None


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def stamped(
    results: Sequence[Mapping[str, Any]], settings: Settings, seeds: Sequence[int]
) -> dict[str, Any]:
    """The summary of a run with its origin."""
    return {
        **origin(),
        "settings": settings.document(),
        "seeds": [seeds[0], seeds[-1]],
        **summarise(results),
    }
