"""The sampler's bar: quiet where nobody looks, and always closed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numba
import numpy as np
import pytest

import bayesimpact as bi
from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.selection.models import Models
from bayesimpact.inference.progress import Refit, compilation_shown, progress_bar, refit_bar
from bayesimpact.inference.sampling.sample import Progress

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


@pytest.mark.parametrize("shown", [True, None])
def test_the_first_call_is_not_silent_while_it_compiles(
    shown: bool | None, capsys: pytest.CaptureFixture[str]
) -> None:
    @numba.njit  # type: ignore[untyped-decorator]
    def new(x: float) -> float:
        return x + 1.0

    new.py_func.__module__ = "bayesimpact.example"
    with compilation_shown(shown, after=0.001):
        new(1.0)
    assert ("compiling bayesimpact.example.new" in capsys.readouterr().err) is bool(shown)


def test_the_main_steps_show_what_they_compile(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a notebook `bi.fit` has no other sign of life."""
    listening: list[bool] = []

    @contextmanager
    def shown(*_: object) -> Iterator[None]:
        listening.append(True)
        yield
        listening.append(False)

    def step(*_: object, **__: object) -> bool:
        return listening[-1]

    monkeypatch.setattr("bayesimpact.api.compilation_shown", shown)
    for place in ("api.identify", "inference.posterior.sample", "diagnosis.diagnose.diagnose"):
        monkeypatch.setattr(f"bayesimpact.{place}", step)
    for kind in ("Identification", "Posterior", "Diagnosis"):
        monkeypatch.setattr(f"bayesimpact.found.{kind}.of", staticmethod(lambda found: found))
    campaign = Campaign("any", 1.0, (Recording("a", "", np.zeros(4), 1.0),), stop=False)
    assert all(call(campaign) is True for call in (bi.fit, bi.sample, bi.diagnose))
    assert listening == [True, False] * 3
