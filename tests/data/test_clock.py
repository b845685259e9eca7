"""Even spacing: what rounding may do to it, and what it may not hide."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayesimpact.data.clock import even_interval
from bayesimpact.errors import InputError

FILE = Path("a.csv")


def interval_of(times: np.ndarray) -> float:
    return even_interval(FILE, times, np.arange(times.size) + 2)


def test_written_exactly_is_read_exactly() -> None:
    assert interval_of(np.array([float(f"{i * 1e-3:.3f}") for i in range(6001)])) == 1e-3


@pytest.mark.parametrize(("rate", "decimals"), [(25_600.0, 6), (3_000.0, 5), (1_652.0, 5)])
def test_rounded_stamps_give_the_true_rate(rate: float, decimals: int) -> None:
    times = np.round(np.arange(6000) / rate, decimals)
    # The slope of a line through n stamps with uniform rounding errors has this standard error.
    error = 10**-decimals / np.sqrt(12) * np.sqrt(12 / 6000**3)
    assert interval_of(times) == pytest.approx(1 / rate, abs=5 * error)


@pytest.mark.parametrize(
    ("change", "line", "words"),
    [
        (lambda t: np.delete(t, 40), 42, "a gap"),
        (lambda t: np.insert(t, 40, t[39]), 42, "the same time twice"),
        (lambda t: np.concatenate([t[:40], t[20:]]), 42, "time running backwards"),
        (lambda t: t[::-1], 3, "time running backwards"),
        (lambda t: t + 1e-4 * (np.arange(t.size) == 50), 52, "of an interval off"),
    ],
)
def test_uneven_times_are_refused_with_their_line(change, line: int, words: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=f"a.csv, line {line}: found .*{words}"):
        interval_of(change(np.arange(200) * 1e-3))


def test_a_rate_that_drifts_is_refused() -> None:
    steps = 1e-3 * (1 + 0.01 * np.linspace(-1, 1, 2000))  # no single step is 1.1 % off
    with pytest.raises(InputError, match="of an interval off"):
        interval_of(np.cumsum(steps))
