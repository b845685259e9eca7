"""How much of what a model leaves is no noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bayesimpact.diagnosis.remainder import beyond_noise, next_guess, recordings_of
from bayesimpact.formula.grammar import Power, Term
from bayesimpact.formula.law import effect_of
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects.quadratic_drag import EFFECT as QUADRATIC_DRAG


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


@pytest.mark.parametrize("with_drag", [True, False])
def test_the_next_guess_writes_a_formula_out_as_it_was_fitted(with_drag: bool) -> None:
    """Where time is up before formulas are compared, the one that the motion is right beside."""
    found = Term("bump", Power(1.0, True), place=5e-3, width=6e-4, side=-1)
    bump = effect_of(found, 1.0, 6e-3, 0.1, signed=True)
    campaign = SimpleNamespace(angular=False)
    fit = SimpleNamespace(
        names=("k1", f"{bump.id}.size", f"{bump.id}.place", f"{bump.id}.width"),
        mode=np.array([500.0, 270.0, 4.4e-3, 5e-4]),
        density=SimpleNamespace(oscillator=SimpleNamespace(campaign=campaign)),
    )
    effects = (bump, QUADRATIC_DRAG) if with_drag else (bump,)
    larger = SimpleNamespace(effects=effects, ids=tuple(e.id for e in effects), fit=fit)
    base = SimpleNamespace(effects=(), ids=())
    selection: Any = SimpleNamespace(tried=(larger, base), log_odds=lambda c: len(c.ids))
    guess = next_guess(selection, SimpleNamespace(candidate=base))  # type: ignore[arg-type]
    fitted = Term("bump", Power(1.0, True), place=4.4e-3, width=5e-4, side=-1)
    assert "4.4" in guess
    assert guess == f"a force A {fitted.text()}" + (", with quadratic drag" if with_drag else "")
