"""A search along a narrow, bent ridge against a likelihood whose profile is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.profile_likelihood import (
    CLOSE,
    _Profile,
    profiled,
    profiled_shape,
)
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Linearisation
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.prior import HalfNormal, LogNormal, LogUniform, Uniform
from bayesimpact.inference.priors import Priors
from bayesimpact.model.parameters import Parameter

NAMES = ("c2", "contact_relaxation.stiffness", "contact_relaxation.time", "sigma")
STIFFNESS, TIME = 20.0, 0.02  # at the mode


class Branch:
    """A Maxwell branch that is nearly a dashpot: c2 + K tau counts, K tau^2 hardly."""

    sizes = np.array([40.0])
    log_volume = np.array([0.0])
    sigma_columns = np.array([3])
    steps = (0.0,)

    def __init__(self) -> None:
        roles = ("physical", "effect", "effect", "noise")
        parameters = tuple(
            Parameter(n, "", r, 0.0 if i else -np.inf)
            for i, (n, r) in enumerate(zip(NAMES, roles, strict=True))
        )

        def positions(*wanted: str) -> np.ndarray:
            return np.array([i for i, p in enumerate(parameters) if p.role in wanted])

        layout = SimpleNamespace(parameters=parameters, roles=positions, names=NAMES, size=4)
        effects = (BY_ID["contact_relaxation"],)
        self.oscillator = SimpleNamespace(
            layout=layout, campaign=SimpleNamespace(stop=False), acting=effects, effects=effects
        )

    def residuals(self, theta: np.ndarray) -> tuple[np.ndarray, ...]:
        c, k, t = theta[:, 0], theta[:, 1], theta[:, 2]
        dashpot = c + k * t - (1.0 + STIFFNESS * TIME)
        inertia = k * t**2 - STIFFNESS * TIME**2
        slow = k * t**3 - STIFFNESS * TIME**3
        rest = np.tile(1e-3 * np.sin(np.arange(37.0)), (c.size, 1))
        return (np.column_stack([3e2 * dashpot, 1e1 * inertia, 3e2 * slow, rest]),)

    def residuals_and_sums(self, theta: np.ndarray) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
        return self.residuals(theta), self.misfit(theta)

    def misfit(self, theta: np.ndarray) -> np.ndarray:
        return np.sum(self.residuals(np.atleast_2d(theta))[0] ** 2, axis=1)[:, None]

    def linearise(
        self, theta: np.ndarray, steps: object = None, *, roughly: bool = False
    ) -> tuple[Linearisation, ...]:
        at = np.repeat(theta[None], 6, axis=0)
        h = 1e-6 * np.abs(theta[:3])
        at[np.arange(3), np.arange(3)] += h
        at[np.arange(3, 6), np.arange(3)] -= h
        r = self.residuals(at)[0]
        jacobian = -((r[:3] - r[3:]) / (2 * h)[:, None]).T
        return (Linearisation(self.residuals(theta[None])[0][0], jacobian, np.arange(3)),)


def problem() -> PosteriorDensity:
    priors = Priors(
        (Uniform(-1e3, 1e3), HalfNormal(1e4), LogNormal(0.02, 3.0), LogUniform(1e-9, 1e3))
    )
    return PosteriorDensity(Branch(), priors)


def unfinished() -> Fit:
    """An unconverged ascent, where the branch is ten times too fast."""
    t = 0.002
    start = np.array([1.0 + STIFFNESS * TIME - 2000.0 * t, 2000.0, t, 1e-3])
    return find_mode(problem(), start, max_iterations=2)


def test_the_profile_is_that_of_the_time_constant():
    assert NAMES[profiled_shape(unfinished())] == "contact_relaxation.time"


def test_the_lowest_point_of_a_bent_profile_is_found():
    begun = unfinished()
    assert not begun.converged and begun.mode[2] < 0.5 * TIME
    found = profiled(begun)
    assert found.converged and found.log_posterior > begun.log_posterior
    best = find_mode(problem(), np.array([1.0, STIFFNESS, TIME, 1e-3]), max_iterations=500)
    assert best.converged
    away = np.log(found.mode[2] / best.mode[2])
    assert abs(away) < CLOSE
    bend = (best.mode[2] / best.sd[2]) ** 2  # of the profile, over the logarithm
    lost = best.log_posterior - found.log_posterior
    assert lost == pytest.approx(0.5 * bend * away**2, rel=0.3)


@pytest.mark.parametrize("factor", [0.6, 0.8, 1.25, 1.6])
def test_a_step_along_the_profile_begins_where_it_passes(factor):
    """The branch keeps its inertia and the contact its damping; nothing turns negative."""
    best = find_mode(problem(), np.array([1.0, STIFFNESS, TIME, 1e-3]), max_iterations=500)
    profile = _Profile(2, best)
    x = float(np.log(factor * best.mode[2]))
    begun, straight = profile.predicted(best, x), best.mode.copy()
    straight[2] = begun[2]
    assert begun[2] == pytest.approx(factor * best.mode[2])
    assert (begun[1:] > 0).all()
    lost = [float(best.density.likelihood.misfit(at)[0, 0]) for at in (begun, straight)]
    assert lost[0] < 0.2 * lost[1]
    assert profile(x) == pytest.approx(-find_mode(
        problem(), begun, fixed=[2], max_iterations=500
    ).log_posterior, abs=0.01)  # fmt: skip


def test_a_model_without_shapes_has_no_profile():
    fit = unfinished()
    fit.density.likelihood.oscillator.effects = ()
    names = ("c2", "k1", "c1", "sigma")
    fit.density.likelihood.oscillator.layout.names = names
    assert profiled(fit) is fit


def test_a_profile_that_never_rises_has_no_lowest_point(monkeypatch):
    begun = unfinished()

    def forever_down(self, x: float) -> float:
        fit = replace(begun, log_posterior=begun.log_posterior - x, converged=True)
        return -self.fits.setdefault(x, fit).log_posterior

    def bowl(self, x: float) -> float:
        lost = (x - np.log(TIME)) ** 2
        fit = replace(begun, log_posterior=begun.log_posterior + 9.0 - lost, converged=True)
        return -self.fits.setdefault(x, fit).log_posterior

    monkeypatch.setattr(_Profile, "__call__", forever_down)
    assert not profiled(begun).converged
    monkeypatch.setattr(_Profile, "__call__", bowl)
    assert profiled(begun).converged
