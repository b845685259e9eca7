"""How much of what a model leaves is no noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayesimpact.diagnosis.remainder import beyond_noise
from bayesimpact.inference.noise.whitening import Noise


@pytest.mark.parametrize(
    ("chi2", "is_bound", "share"),
    [(4.0, False, np.sqrt(0.75)), (0.5, False, 0.0), (4.0, True, 1.0), (0.5, True, 1.0)],
)
def test_what_is_less_than_a_bound_of_the_noise_remains(
    chi2: float, is_bound: bool, share: float
) -> None:
    likelihood = SimpleNamespace(noise=Noise(level=1e-3, is_bound=is_bound))
    density = SimpleNamespace(likelihood=likelihood)
    fit: Any = SimpleNamespace(rms=2e-3, reduced_chi2=chi2, density=density)
    assert beyond_noise(fit) == pytest.approx(2e-3 * share)
