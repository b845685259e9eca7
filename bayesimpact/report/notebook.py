"""Figures straight from a posterior, for a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bayesimpact.inference.fit import Z90, Fit
from bayesimpact.inference.posterior import Posterior
from bayesimpact.report.build import results_from_posterior
from bayesimpact.report.digits import digits
from bayesimpact.report.rows import LEARNED

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure

    from bayesimpact.report.figures.corner import NormalLaw


def corner(posterior: Posterior, before: Posterior | None = None) -> Figure:
    """Corner plot of the physical parameters and effects; `before` is drawn beside, where given."""
    from bayesimpact.report.figures.corner import corner_figure
    from bayesimpact.report.figures.inline import inline

    results = results_from_posterior(posterior, backbone=False, before=before)
    assert results.draws is not None
    return inline(corner_figure(results.draws, before=results.before))


def normal_corner(fit: Fit, before: Fit | None = None) -> Figure:
    """Corner plot of the normal laws at the modes of a fit and, where given, of another."""
    from bayesimpact.report.figures.corner import NormalLaw, corner_figure
    from bayesimpact.report.figures.inline import inline

    def law(label: str, one: Fit) -> NormalLaw:
        layout = one.density.oscillator.layout
        columns = [
            int(i)
            for i in layout.roles("physical", "effect")
            if not layout.names[i].startswith(LEARNED)
        ]
        return NormalLaw(
            label,
            tuple(layout.names[i] for i in columns),
            tuple(layout.parameters[i].unit for i in columns),
            one.mode[columns],
            one.covariance[np.ix_(columns, columns)],
        )

    own = law("mode and curvature" if before is None else "with what was added", fit)
    other = None if before is None else law("base model", before)
    shown = {}
    for k, name in enumerate(own.names):
        here = _estimate(own, k)
        beside = (
            [_estimate(other, other.names.index(name))] if other and name in other.names else []
        )
        shown[name] = digits(own.units[k], here["median"], here["ci90"], beside)
    return inline(corner_figure(own, before=other, shown=shown))


def _estimate(law: NormalLaw, k: int) -> dict[str, Any]:
    """Middle and 90 % interval of a parameter of a normal law."""
    mean, half = float(law.mean[k]), Z90 * float(np.sqrt(law.covariance[k, k]))
    return {"median": mean, "ci90": (mean - half, mean + half)}
