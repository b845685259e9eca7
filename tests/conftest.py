"""Lets every test import the helpers beside this file: pytest puts its folder on the path."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from coarse_figures import draw_coarsely

from bayesimpact.inference.identify import Identification, identify


@pytest.fixture(scope="session")
def small() -> Identification:
    """The small rig, with nothing missing, and its fit."""
    return identify(small_rig.record(1), rng=np.random.default_rng(0), search=False)


@pytest.fixture
def coarse_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports in a moment: see the module of this name."""
    draw_coarsely(monkeypatch)
