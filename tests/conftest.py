"""Lets every test import the helpers beside this file: pytest puts its folder on the path.

The workers of pytest-xdist take all cores: each computes on one thread, and the files with the
longest tests are handed out first, so that the workers end together.
"""

from __future__ import annotations

import os
from collections.abc import Callable

if WORKER := os.environ.get("PYTEST_XDIST_WORKER"):
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when NumPy is loaded

import numba
import numpy as np
import pytest
import small_rig
from coarse_figures import draw_coarsely
from compiled_once import compile_once

from bayesimpact.cli import main
from bayesimpact.inference.identify import Identification, identify


def pytest_configure(config: pytest.Config) -> None:
    config.option.loadscopereorder = False  # those with the most tests first, otherwise


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    long = {item.path for item in items if item.get_closest_marker("long")}
    items.sort(key=lambda item: item.path not in long)


def pytest_sessionstart() -> None:
    if WORKER:
        numba.set_num_threads(1)
        compile_once(WORKER)


@pytest.fixture(scope="session")
def small() -> Identification:
    """The small rig, with nothing missing, and its fit."""
    return identify(small_rig.record(1), rng=np.random.default_rng(0), search=False)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run a command in this process: exit code, standard output, standard error."""

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(a) for a in arguments])
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return run


@pytest.fixture
def coarse_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports in a moment: see the module of this name."""
    draw_coarsely(monkeypatch)


@pytest.fixture
def catalogue_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Diagnoses without formulas, the search for which takes more than half of a small one: for
    what is said of faults, noise and effects of the catalogue (of formulas: test_formulas.py).
    """
    without = "bayesimpact.diagnosis.loop.with_formulas"
    monkeypatch.setattr(without, lambda answer, *_, **__: answer)
