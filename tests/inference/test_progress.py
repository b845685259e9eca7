"""The sampler's bar: quiet where nobody looks, and always closed."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.diagnosis.models import Models
from bayesimpact.inference.progress import Refit, progress_bar, refit_bar
from bayesimpact.inference.sample import Progress

WHERE = Progress(burning=False, steps=50, max_steps=200, tau=3.0, ess=1234.4)


def test_it_tells_steps_and_effective_draws(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar(True) as tell:
        tell(WHERE)
    told = capsys.readouterr()
    assert "1234 effective draws" in told.err and "50/200" in told.err and told.out == ""


@pytest.mark.parametrize("shown", [False, None])
def test_it_is_quiet_where_there_is_no_terminal(
    shown: bool | None, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_bar(shown) as tell:
        tell(WHERE)
    assert capsys.readouterr().err == ""


def test_refits_are_counted_by_a_bar_and_the_rest_is_told(
    capsys: pytest.CaptureFixture[str],
) -> None:
    told: list[str] = []
    with refit_bar(told.append, True) as tell:
        tell("scoring what the base model lacks")
        tell(Refit("fitting coulomb_friction", 7))
    shown = capsys.readouterr().err
    assert told == ["scoring what the base model lacks"]
    assert "fitting coulomb_friction" in shown and "7 refits" in shown


@pytest.mark.parametrize("shown", [False, None])
def test_without_a_bar_refits_are_told_as_all_else(
    shown: bool | None, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[str] = []
    with refit_bar(told.append, shown) as tell:
        tell(Refit("fitting coulomb_friction", 7))
    assert told == ["fitting coulomb_friction"] and capsys.readouterr().err == ""


def test_a_search_counts_its_refits() -> None:
    told: list[Refit] = []
    search = Models((), None, np.random.default_rng(0), told.append)
    search.tell("fitting coulomb_friction")
    search.tell("without coulomb_friction")
    assert [(words, words.number) for words in told] == [
        ("fitting coulomb_friction", 1),
        ("without coulomb_friction", 2),
    ]
    assert search.refits == 2
