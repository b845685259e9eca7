"""Scores: what is left of a direction once the model's own parameters have absorbed what they can.

With J the whitened derivatives of the prediction with respect to everything the model fits (base
parameters, initial conditions, rest readings) and D the directions, the part of D that refitting
cannot imitate is

    D_perp = D - J (J'J)^-1 J'D,     S = D_perp' D_perp,     b = D_perp' r.

Under the model b ~ N(0, S); an effect of size s shifts it by S s. So z = b / sqrt(S) is a score
(Lagrange multiplier) test, b / S the expected size, 1 / sqrt(S) its standard error, and (J'J)^-1
J'D b / S the bias that ignoring the effect puts on the model's parameters (Saris, Satorra and
Sorbom 1987 call the size the expected parameter change).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.score_test.directions import sigma_of
from bayesimpact.inference.fit import Fit, inverse

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Projection:
    """Scores of K direction columns.

    Attributes
    ----------
    score : b (K,)
    information : S (K, K)
    absorbed : (d, K), shift of the model's parameters per unit of each direction when it is ignored
    kept : (K,), fraction of each direction's norm that refitting cannot imitate
    """

    score: Array
    information: Array
    absorbed: Array
    kept: Array

    __repr__ = short_repr

    def subset(self, index: Sequence[int] | NDArray[np.int64]) -> Projection:
        """The same for some of the columns."""
        i = np.asarray(index)
        return Projection(
            self.score[i], self.information[np.ix_(i, i)], self.absorbed[:, i], self.kept[i]
        )

    def combined(self, weights: Array) -> Projection:
        """The same for combinations of the columns, weights (K, L); what is kept of each of these
        is not known without the responses, NaN.
        """
        return Projection(
            weights.T @ self.score,
            weights.T @ self.information @ weights,
            self.absorbed @ weights,
            np.full(weights.shape[1], np.nan),
        )


def project(fit: Fit, parts: Sequence[Array]) -> Projection:
    """Project direction columns (per recording (n_r, K), whitened, noise = 1) off the model."""
    size, sigma = fit.mode.size, sigma_of(fit)
    columns = parts[0].shape[1]
    rows = [
        (lin.jacobian / s, lin.residual / s, lin.columns, part)
        for lin, s, part in zip(fit.linearisation, sigma, parts, strict=True)
    ]
    curvature = fit.density.priors.information(fit.mode)
    noise = fit.density.oscillator.layout.roles("noise")
    curvature[noise] = 0.0
    matrix = np.diag(curvature)
    for jacobian, _, where, _ in rows:
        matrix[np.ix_(where, where)] += jacobian.T @ jacobian
    solve = inverse(matrix)
    absorbed = np.zeros((size, columns))
    left = [part for *_, part in rows]
    for _ in range(2):  # the second pass removes the rounding of the first
        share = np.zeros((size, columns))
        for (jacobian, _, where, _), part in zip(rows, left, strict=True):
            share[where] += jacobian.T @ part
        change = solve @ (share - curvature[:, None] * absorbed)
        absorbed += change
        left = [
            part - jacobian @ change[where]
            for (jacobian, _, where, _), part in zip(rows, left, strict=True)
        ]
    information = absorbed.T @ (curvature[:, None] * absorbed)
    slope = np.nan_to_num(fit.density.priors.gradient(fit.mode))
    slope[noise] = 0.0
    score, norm = -absorbed.T @ slope, np.zeros(columns)  # at the mode J'r balances the priors
    for (_, residual, _, whole), part in zip(rows, left, strict=True):
        information += part.T @ part
        score += part.T @ residual
        norm += np.einsum("nk,nk->k", whole, whole)
    kept = np.sqrt(np.diag(information) / np.maximum(norm, 1e-300))
    return Projection(score, information, absorbed, kept)
