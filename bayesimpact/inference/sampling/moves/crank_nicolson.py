"""Autoregressive proposal that leaves a multivariate Student-t unchanged."""

from __future__ import annotations

import numpy as np
from emcee.moves import MHMove
from numpy.typing import NDArray

from bayesimpact.inference.sampling.moves.mixture import Frame, log_student
from bayesimpact.inference.sampling.whiten import squared_norm, transform

Array = NDArray[np.float64]


class CrankNicolsonMove(MHMove):  # type: ignore[misc]
    """Preconditioned Crank-Nicolson step with a Student-t reference.

    With v = whitened walker, nu degrees of freedom and d dimensions:
    s ~ InverseGamma((nu + d)/2, (nu + |v|^2)/2),  v' = sqrt(1 - b^2) v + b sqrt(s) N(0, I).
    Given s this is reversible for N(0, s I) (Cotter, Roberts, Stuart & White 2013, Statist. Sci.
    28:424); drawing s from its law given v makes it reversible for the Student-t
    (Kamatani 2018, Bernoulli 24:3711; the inverse gamma is conjugate). So the acceptance is
    min(1, p(v') t(v) / (p(v) t(v'))): the step is large where the posterior is nearly elliptical
    and, unlike a random walk, needs no shortening with the number of dimensions. b is drawn anew
    for every walker, uniformly in `steps`, which spares tuning and stays exact.

    Parameters
    ----------
    frame : centre and scatter of the reference
    dof : nu
    steps : range of b, within (0, 1]
    """

    def __init__(
        self, frame: Frame, dof: float = 10.0, steps: tuple[float, float] = (0.1, 1.0)
    ) -> None:
        self.frame = frame
        self.dof = dof
        self.steps = steps
        super().__init__(self._propose, ndim=len(frame.centre))

    def _propose(self, walkers: Array, random: np.random.RandomState) -> tuple[Array, Array]:
        count, dimension = walkers.shape
        v = transform(walkers - self.frame.centre, self.frame.inverse)
        r2 = squared_norm(v)
        b = random.uniform(*self.steps, size=count)
        s = 0.5 * (self.dof + r2) / random.standard_gamma(0.5 * (self.dof + dimension), size=count)
        moved = np.sqrt(1.0 - b**2)[:, None] * v
        moved += (b * np.sqrt(s))[:, None] * random.standard_normal((count, dimension))
        factors = log_student(r2, dimension, 1.0, self.dof)
        factors = factors - log_student(squared_norm(moved), dimension, 1.0, self.dof)
        return self.frame.centre + transform(moved, self.frame.factor), factors
