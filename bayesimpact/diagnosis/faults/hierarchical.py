"""How the recordings' own parameters spread: a hierarchical linear model of their logarithms.

    log theta_r = shared + trend(x_r) + scatter_r + u direction_r + error_r

x_r is the logarithm of the amplitude. The errors are those of the single fits, and where the
recordings agree within them that is all. Physics that the model lacks shows alike in recordings of
like amplitude: a trend, linear and quadratic, with coefficients N(0, w^2); and a scatter N(0, s^2)
of every recording. How large either is, nobody knows: every parameter has its own w and s, each on
a grid of multiples of its error, and the evidence is summed over them. A recording stands out only
against what the others leave possible, however few they are.

Zellner 1986 for priors in proportion to the errors; MacKay 1992, Neural Comput. 4:415, for one
width per parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.special import logsumexp

from bayesimpact.diagnosis.faults.alone import Alone

Array = NDArray[np.float64]

TRENDS = np.array([0.0, 3.0, 30.0, 300.0])
SCATTERS = np.array([0.0, 1.0, 4.0, 16.0, 64.0, 256.0])
"""Standard deviations of trends and scatter, in errors of a single fit, equally likely: from none
to misfits hundreds of times the noise, as real recordings have them."""

SHARES = (1.0, 0.1, 0.01, 0.001)
"""Prior standard deviations of what a fault changes, of its largest one: as little is known of it
as of trends and scatter."""

Freed = tuple[Array, float]
"""Direction (R, p) of what a fault changes, per unit of it, and its largest prior standard
deviation."""

PASSES = 2  # over the parameters' widths; a third changes no log evidence by 0.1
LEAST_SD = 0.02  # standard deviation of the log amplitudes from which on trends can be told
MEASURED = 10.0  # variance of a logarithm up to which a recording says anything of it
FLAT = 1e-9  # precision of what is shared
NOTHING = 1e-3  # of an error: a trend of no width


@dataclass(frozen=True, eq=False)
class Widths:
    """Positions in `TRENDS` and `SCATTERS`, (p,) each."""

    trend: NDArray[np.int_]
    scatter: NDArray[np.int_]


class Differences:
    """The recordings' logarithms under one labelling.

    Parameters
    ----------
    alone : the R recordings
    labels : their cases; a stiffness of the stop is shared by a case
    exact : True where nothing but the errors makes recordings differ: no trend, no scatter
    """

    def __init__(self, alone: Sequence[Alone], labels: Sequence[str], *, exact: bool) -> None:
        self.log = np.array([a.log for a in alone])
        self.covariance = np.array([a.covariance for a in alone])
        size = self.log.shape[1]
        variance = np.diagonal(self.covariance, axis1=1, axis2=2)
        known = [variance[variance[:, p] < MEASURED, p] for p in range(size)]
        self.error = np.sqrt([np.median(v) if v.size else 1.0 for v in known])
        x = standardised([a.amplitude for a in alone])
        self.trends = TRENDS[:1] if exact or not x.any() else TRENDS
        self.scatters = SCATTERS[:1] if exact else SCATTERS
        self.shares = SHARES[:1] if exact else SHARES
        self.size, self.design = size, _shared(labels, size)
        self.start = self.design.shape[2]
        if self.trends.size > 1:
            linear = x[:, None, None] * np.eye(size)
            self.design = np.concatenate([self.design, linear, x[:, None, None] * linear], axis=2)

    def at_none(self) -> Widths:
        """No trend, no scatter."""
        return Widths(np.zeros(self.size, dtype=int), np.zeros(self.size, dtype=int))

    def evidence(self, freed: Sequence[Freed]) -> tuple[float, float, Widths]:
        """Log evidence over all widths; the likeliest share of the faults', of trends and scatter.

        `freed` are what faults change.
        """
        shares = self.shares if freed else self.shares[:1]
        found = [self._evidence(freed, share) for share in shares]
        best = max(range(len(found)), key=lambda i: found[i][0])
        total = float(logsumexp([value for value, _ in found]) - np.log(len(found)))
        return total, shares[best], found[best][1]

    def roughly(self, freed: Sequence[Freed]) -> float:
        """Log evidence where trends may be of any size and nothing scatters."""
        at = Widths(np.full(self.size, self.trends.size - 1), self.at_none().scatter)
        return float(self._values(freed, 1.0, _one(at))[0])

    def estimate(self, freed: Sequence[Freed], share: float, at: Widths) -> tuple[float, float]:
        """What the last fault changes and its standard error, at given widths."""
        matrix, right, *_ = self._equations(freed, share, _one(at))
        covariance = np.linalg.inv(matrix[0])
        return float(covariance[-1] @ right[0]), float(np.sqrt(covariance[-1, -1]))

    def agreement(self, freed: Sequence[Freed], share: float, at: Widths) -> float:
        """The chance that recordings that agree at given widths differ by as much as they do."""
        matrix, right, constant, _ = self._equations(freed, share, _one(at))
        misfit = constant[0] - right[0] @ np.linalg.solve(matrix[0], right[0])
        variance = np.diagonal(self.covariance, axis1=1, axis2=2)
        degrees = int(np.sum(variance < MEASURED)) - matrix.shape[1]
        return float(stats.chi2.sf(misfit, max(degrees, 1)))

    def _evidence(self, freed: Sequence[Freed], share: float) -> tuple[float, Widths]:
        at, total = self.at_none(), 0.0
        if self.trends.size * self.scatters.size == 1:
            return float(self._values(freed, share, _one(at))[0]), at
        for _ in range(PASSES):
            total = 0.0
            for p in range(self.size):
                grid = self._around(at, p)
                values = self._values(freed, share, grid)
                best = int(np.argmax(values))
                at = Widths(grid.trend[best], grid.scatter[best])
                total += float(logsumexp(values) - values[best] - np.log(values.size))
        return total + float(values[best]), at

    def _around(self, at: Widths, p: int) -> Widths:
        """All widths (G, p) of one parameter, the others' as they are."""
        trend, scatter = np.meshgrid(
            np.arange(self.trends.size), np.arange(self.scatters.size), indexing="ij"
        )
        count = trend.size
        found = Widths(np.tile(at.trend, (count, 1)), np.tile(at.scatter, (count, 1)))
        found.trend[:, p], found.scatter[:, p] = trend.ravel(), scatter.ravel()
        return found

    def _equations(
        self, freed: Sequence[Freed], share: float, at: Widths
    ) -> tuple[Array, Array, Array, Array]:
        """Normal equations (G, q, q) and (G, q), and what does not depend on the unknowns: the sum
        of squares (G,) and the log determinant (G,) of the errors.
        """
        own = [direction[:, :, None] for direction, _ in freed]
        design = np.concatenate([self.design, *own], axis=2)
        scatter, of = np.unique(at.scatter, axis=0, return_inverse=True)
        extra = (self.scatters[scatter] * self.error) ** 2
        total = self.covariance + extra[:, None, :, None] * np.eye(self.size)
        weight = np.linalg.inv(total)
        weighted = np.einsum("grab,rbq->graq", weight, design)
        matrix = np.einsum("raq,grap->gqp", design, weighted)[of]
        right = np.einsum("graq,ra->gq", weighted, self.log)[of]
        constant = np.einsum("ra,grab,rb->g", self.log, weight, self.log)[of]
        places = np.arange(matrix.shape[1])
        matrix[:, places, places] += self._precision(freed, share, at)
        return matrix, right, constant, np.linalg.slogdet(total)[1].sum(axis=1)[of]

    def _precision(self, freed: Sequence[Freed], share: float, at: Widths) -> Array:
        """Prior precisions (G, q): a trend that is not there is held at nothing."""
        size = self.design.shape[2]
        found = np.full((at.trend.shape[0], size + len(freed)), FLAT)
        if self.trends.size > 1:
            trend = np.maximum(self.trends[at.trend], NOTHING) * self.error
            found[:, self.start : size] = np.tile(trend**-2.0, 2)
        found[:, size:] = [(share * width) ** -2.0 for _, width in freed]
        return found

    def _values(self, freed: Sequence[Freed], share: float, at: Widths) -> Array:
        """Log evidence (G,) at given widths, less what all hypotheses have in common."""
        matrix, right, constant, errors = self._equations(freed, share, at)
        prior = np.log(self._precision(freed, share, at)).sum(axis=1)
        solved = np.linalg.solve(matrix, right[..., None])[..., 0]
        misfit = constant + errors - np.einsum("gq,gq->g", right, solved)
        return np.asarray(-0.5 * (misfit + np.linalg.slogdet(matrix)[1] - prior))


def _one(at: Widths) -> Widths:
    """As a grid of one."""
    return Widths(at.trend[None], at.scatter[None])


def standardised(amplitudes: Sequence[float]) -> Array:
    """Logarithms of amplitudes (R,), mean zero and standard deviation one.

    All zero where they are the same.
    """
    x = np.log(np.maximum(amplitudes, 1e-300))
    x -= x.mean()
    return np.asarray(x / x.std() if x.std() > LEAST_SD else 0.0 * x)


def _shared(labels: Sequence[str], size: int) -> Array:
    """Design (R, p, q) of what all recordings share, and of k2, shared by those of a case."""
    known = list(dict.fromkeys(labels))
    found = np.zeros((len(labels), size, size if size < 5 else 4 + len(known)))
    for r, label in enumerate(labels):
        if size == 5:
            found[r, range(4), range(4)] = 1.0
            found[r, 4, 4 + known.index(label)] = 1.0
        else:
            found[r] = np.eye(size)
    return found
