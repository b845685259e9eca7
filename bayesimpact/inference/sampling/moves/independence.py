"""Independence proposal: every walker at once to a fresh draw from a frozen distribution."""

from __future__ import annotations

import numpy as np
from emcee.moves import MHMove
from numpy.typing import NDArray

from bayesimpact.inference.sampling.moves.mixture import Mixture

Array = NDArray[np.float64]


class IndependenceMove(MHMove):  # type: ignore[misc]
    """Metropolised independence sampler (Tierney 1994, Ann. Statist. 22:1701).

    Proposes x' ~ q whatever x is and accepts with min(1, p(x') q(x) / (p(x) q(x'))); exact for any
    q that covers the posterior. One batch of all walkers a step, no half-ensembles.

    Parameters
    ----------
    mixture : q, frozen: it must not be changed while draws are kept
    """

    def __init__(self, mixture: Mixture) -> None:
        self.mixture = mixture
        super().__init__(self._propose, ndim=len(mixture.frames[0].centre))

    def _propose(self, walkers: Array, random: np.random.RandomState) -> tuple[Array, Array]:
        proposed = self.mixture.draw(random, len(walkers))
        return proposed, self.mixture.log_density(walkers) - self.mixture.log_density(proposed)
