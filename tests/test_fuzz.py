"""Whatever a campaign holds, it is accepted or refused in one short message: a short fuzzing run.

The long one is `python tests/benchmarks/fuzz.py` (10,000 campaigns), its result in fuzz.json.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from damaged import BASE, GOOD, Case, cases, outcome
from hypothesis import HealthCheck, given, settings

SHORT = settings(
    max_examples=300,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


def test_the_undamaged_campaign_is_accepted(folder: Path) -> None:
    plain = Case(BASE.encode(), GOOD, GOOD)
    assert outcome(folder, plain)[0] == "accepted", outcome(folder, plain)


@SHORT
@given(case=cases)
def test_every_campaign_is_accepted_or_refused_in_one_message(folder: Path, case: Case) -> None:
    kind, details = outcome(folder, case)
    assert kind in ("accepted", "refused"), details
