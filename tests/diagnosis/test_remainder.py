"""How much of what a model leaves is no noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayesimpact.diagnosis.remainder import beyond_noise, recordings_of
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


@pytest.mark.parametrize(
    ("chi2", "names"),
    [((1.4, 1.8, 34.5, 2.0), ("c", "b")), ((5.0, 1.0, 1.0, 5.0), ("d", "a"))],
)
def test_recordings_are_those_that_hold_what_is_left(
    chi2: tuple[float, ...], names: tuple[str, ...]
) -> None:
    """Of sizes of their own; the noise in the others is no part of it."""
    sizes = np.array([100.0, 400.0, 100.0, 300.0])
    likelihood = SimpleNamespace(noise=Noise(level=1e-3), sizes=sizes)
    campaign = SimpleNamespace(recordings=[SimpleNamespace(name=n) for n in "abcd"])
    density = SimpleNamespace(likelihood=likelihood, oscillator=SimpleNamespace(campaign=campaign))
    fit: Any = SimpleNamespace(density=density, sums=np.array(chi2) * sizes * 1e-6)
    assert recordings_of(fit) == names
