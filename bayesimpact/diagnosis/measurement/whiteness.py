"""Is a residual white? That it is decides nothing: refitting hides what is missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.inference.fit import Fit

LAGS = 20


def ljung_box(x: NDArray[np.float64]) -> float:
    """p-value of the Ljung-Box portmanteau test of a whitened residual (Ljung and Box 1978)."""
    n = x.size
    centred = x - x.mean()
    power = float(centred @ centred)
    rho = np.array([centred[:-k] @ centred[k:] / power for k in range(1, LAGS + 1)])
    statistic = n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, LAGS + 1)))
    return float(stats.chi2.sf(statistic, LAGS))


def whiteness_p(fit: Fit) -> float:
    """One p-value over all recordings (Fisher's combination of Ljung-Box tests)."""
    return combined([ljung_box(part.residual) for part in fit.linearisation])


def combined(p_values: Sequence[float]) -> float:
    """Fisher's combination of independent p-values."""
    logs = np.log(np.maximum(p_values, 1e-300))
    return float(stats.chi2.sf(-2 * logs.sum(), 2 * len(p_values)))
