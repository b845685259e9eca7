"""Lets every test import the helpers beside this file: pytest puts its folder on the path."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig

from bayesimpact.inference.identify import Identification, identify


@pytest.fixture(scope="session")
def small() -> Identification:
    """The small rig, with nothing missing, and its fit."""
    return identify(small_rig.record(1), rng=np.random.default_rng(0), search=False)
