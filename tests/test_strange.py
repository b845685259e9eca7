"""Campaigns that nobody expects but the door lets in: each ends in a report with all its parts.

All of them, by the command: `python tests/benchmarks/strange_campaigns.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strange import STRANGE, Strange

from bayesimpact.data.read import load_campaign
from bayesimpact.workflow import fit_campaign

QUICK = 8
ONE_PYTHON = 4  # of these


def written(folder: Path, strange: Strange) -> Path:
    """The campaign's folder."""
    toml, files = strange
    folder.mkdir(parents=True)
    for name, content in {"campaign.toml": toml, **files}.items():
        (folder / name).write_text(content)
    return folder


@pytest.mark.parametrize(
    "kind",
    [
        kind if number >= ONE_PYTHON else pytest.param(kind, marks=pytest.mark.long)
        for number, kind in enumerate(list(STRANGE)[:QUICK])
    ],
)
def test_a_strange_campaign_ends_in_a_report(kind: str, tmp_path: Path) -> None:
    campaign = load_campaign(written(tmp_path / "campaign", STRANGE[kind]()))
    made = fit_campaign(campaign, tmp_path / "out")
    assert dict(made.failed) == {}
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000
    assert all(np.isfinite(row.median) for row in made.results.rows)


@pytest.mark.parametrize("kind", STRANGE)
def test_the_door_lets_it_in(kind: str, tmp_path: Path) -> None:
    load_campaign(written(tmp_path / "campaign", STRANGE[kind]()))
