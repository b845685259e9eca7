"""Lets every test import the helpers beside this file: pytest puts its folder on the path."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
import pytest
import small_rig
from coarse_figures import draw_coarsely
from compiled_once import compile_once

from bayesimpact.cli import main
from bayesimpact.inference.identify import Identification, identify


def pytest_sessionstart() -> None:
    if worker := os.environ.get("PYTEST_XDIST_WORKER"):
        compile_once(worker)


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
