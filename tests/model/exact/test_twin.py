"""The simulator against its 50-digit twin (errors as in tests/benchmarks/accuracy.py)."""

from __future__ import annotations

import pytest
from benchmarks.accuracy import summary, survey


def check(count: int, seed: int) -> dict[str, float]:
    found = summary(survey(count, seed))
    assert found["wrong_counts"] == 0
    assert found["largest_displacement_error"] < 1e-12, found
    assert found["largest_time_error"] < 1e-12, found
    assert found["chaotic_systems"] <= 0.01 * count
    assert found["largest_error_over_rounding_of_chaotic"] < 10, found
    return found


@pytest.mark.long
def test_accuracy_sample() -> None:
    assert check(30, 1)["events"] > 150


@pytest.mark.slow
def test_accuracy() -> None:
    assert check(1000, 7)["events"] > 5000
