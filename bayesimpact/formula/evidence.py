"""Odds of every sum of up to three terms, in closed form.

What the recordings say of K terms is, in the linearised problem, a Gaussian: the scores b and the
information S of their sizes, everything else that the model fits projected off. A subset then has
sizes S^-1 b and a gain b' S^-1 b in the sum of squares R. With the level of the noise free (a model
that explains more has less of it) its log evidence is

    -n/2 ln(R / R0) + sum_i [ln p(size_i) + 1/2 ln 2 pi] - 1/2 ln det(S n / R) - sum_i price_i,

by Laplace's method, with the heavy-tailed priors of the catalogue's sizes, and a price that says
how long a formula is to write down. All subsets are enumerated (as Bartlett, Desmond and Ferreira
2023 do for whole formulas), so nothing simpler is skipped; 2 x 2 systems are solved in closed form
for all pairs of further terms at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COLLINEAR = 1e-6  # determinant of unit responses below which the sizes mean nothing
KEPT = 2000  # of all subsets


@dataclass(frozen=True, eq=False)
class Problem:
    """What is known of K terms in the linearised problem.

    Attributes
    ----------
    score, information : b (K,), S (K, K), noise = 1
    left : sum of squares without any term, R0
    samples : independent numbers that it sums over, n
    scale : (K,) plausible size of every term
    price : (K,) nats
    power : (K,) mean power that each dissipative term of unit size takes, over the others'; 0 for
        terms that may have either sign
    """

    score: Array
    information: Array
    left: float
    samples: float
    scale: Array
    price: Array
    power: Array


@dataclass(frozen=True)
class Subset:
    """Terms by position, their sizes and the log odds against none."""

    terms: tuple[int, ...]
    sizes: tuple[float, ...]
    log_odds: float


def single_log_odds(problem: Problem) -> Array:
    """Log odds of every term alone, (K,); -inf where its sign is not admissible."""
    unit = np.sqrt(np.diag(problem.information))
    b = problem.score / unit
    work = _Work(problem, unit, np.eye(b.size), b)
    return work.log_odds((np.arange(b.size),), (b,), np.zeros(b.size))


def subsets(problem: Problem, most: int = 3) -> list[Subset]:
    """The likeliest sums of one to `most` terms, best first, `KEPT` at most."""
    unit = np.sqrt(np.diag(problem.information))
    scaled = problem.information / np.outer(unit, unit)
    work = _Work(problem, unit, scaled, problem.score / unit)
    work.singles()
    if most > 1:
        for i in range(unit.size - 1):
            work.pairs(i)
    if most > 2:
        for i in range(unit.size - 2):
            work.triples(i)
    return work.best()


@dataclass(eq=False)
class _Work:
    """The problem with responses of unit length."""

    problem: Problem
    unit: Array
    s: Array
    b: Array
    least: float = -np.inf
    rows: list[Array] = field(default_factory=list)  # (m, 7): log odds, three terms, three sizes
    waiting: int = 0

    def singles(self) -> None:
        one = np.arange(self.b.size)
        odds = self.log_odds((one,), (self.b,), np.zeros(one.size))
        self._keep((one,), (self.b,), odds)

    def pairs(self, i: int) -> None:
        j = np.arange(i + 1, self.b.size)
        c = self.s[i, j]
        det = 1.0 - c**2
        det = np.where(det > COLLINEAR, det, np.nan)
        a0, a1 = (self.b[i] - c * self.b[j]) / det, (self.b[j] - c * self.b[i]) / det
        first = np.full(j.size, i)
        odds = self.log_odds((first, j), (a0, a1), np.log(det))
        self._keep((first, j), (a0, a1), odds)

    def triples(self, i: int) -> None:
        rest = np.arange(i + 1, self.b.size)
        c = self.s[i, rest]
        g = self.s[np.ix_(rest, rest)] - np.outer(c, c)
        h = self.b[rest] - c * self.b[i]
        j, k = self._promising(i, rest, g, h)
        gjj, gkk, gjk = g[j, j], g[k, k], g[j, k]
        det = gjj * gkk - gjk**2
        aj, ak = (h[j] * gkk - h[k] * gjk) / det, (h[k] * gjj - h[j] * gjk) / det
        ai = self.b[i] - c[j] * aj - c[k] * ak
        terms = (np.full(j.size, i), rest[j], rest[k])
        self._keep(terms, (ai, aj, ak), self.log_odds(terms, (ai, aj, ak), np.log(det)))

    def _promising(
        self, i: int, rest: NDArray[np.int64], g: Array, h: Array
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Pairs beside term i whose log odds may reach the best `KEPT` so far.

        A bound: the gain is exact, the prior of every size is at its peak, and the determinant as
        small as is admitted.
        """
        p, diagonal = self.problem, np.diag(g)
        det = np.outer(diagonal, diagonal) - g**2
        with np.errstate(invalid="ignore", divide="ignore"):
            squared = np.outer(h**2, diagonal)
            gain = (squared + squared.T - 2 * np.outer(h, h) * g) / det + self.b[i] ** 2
            left = np.maximum(p.left - gain, 1e-3 * p.left)
            bound = -0.5 * p.samples * np.log(left / p.left)
            bound += 1.5 * np.log(2 * np.pi * left / p.samples)
        peak = -np.log(np.pi * self.unit * p.scale) - p.price
        bound += peak[i] + peak[rest][:, None] + peak[rest] - 0.5 * np.log(COLLINEAR)
        found = np.argwhere(np.triu((det > COLLINEAR) & (bound > self.least), 1))
        return found[:, 0], found[:, 1]

    def log_odds(
        self, terms: Sequence[NDArray[np.int64]], sizes: Sequence[Array], log_det: Array
    ) -> Array:
        """Of subsets (m,), given sizes for unit responses; -inf where they are not admissible."""
        p = self.problem
        with np.errstate(invalid="ignore", divide="ignore"):
            gain = sum(self.b[t] * a for t, a in zip(terms, sizes, strict=True))
            left = np.maximum(p.left - gain, 1e-3 * p.left)
            value = -0.5 * p.samples * np.log(left / p.left) - 0.5 * log_det
            value = value + 0.5 * len(terms) * np.log(2 * np.pi * left / p.samples)
            taken = np.zeros(log_det.size)
            for t, a in zip(terms, sizes, strict=True):
                share = a / (self.unit[t] * p.scale[t])
                value = value - np.log(self.unit[t] * p.scale[t])
                value = value - np.log(np.pi * (1.0 + share**2)) - p.price[t]
                taken = taken + p.power[t] * a / self.unit[t]
            return np.where(np.isfinite(value) & (taken >= 0.0), value, -np.inf)

    def _keep(
        self, terms: Sequence[NDArray[np.int64]], sizes: Sequence[Array], odds: Array
    ) -> None:
        """Remember those that may be among the best."""
        good = np.flatnonzero(odds > self.least)
        row = np.full((good.size, 7), np.nan)
        row[:, 0] = odds[good]
        for k, (t, a) in enumerate(zip(terms, sizes, strict=True)):
            row[:, 1 + k], row[:, 4 + k] = t[good], a[good] / self.unit[t[good]]
        self.rows.append(row)
        self.waiting += good.size
        if self.waiting > 4 * KEPT:
            self._shrink()

    def _shrink(self) -> None:
        whole = np.concatenate(self.rows)
        whole = whole[np.argsort(-whole[:, 0], kind="stable")[:KEPT]]
        if whole.shape[0] == KEPT:
            self.least = float(whole[-1, 0])
        self.rows, self.waiting = [whole], whole.shape[0]

    def best(self) -> list[Subset]:
        """Those that are left, best first."""
        self._shrink()
        found = []
        for row in self.rows[0]:
            terms = row[1:4][np.isfinite(row[1:4])].astype(np.int64)
            sizes = row[4 : 4 + terms.size]
            found.append(Subset(tuple(terms.tolist()), tuple(sizes.tolist()), float(row[0])))
        return found
