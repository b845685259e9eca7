"""Figures straight from a posterior, for a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayesimpact.inference.posterior import Posterior
from bayesimpact.report.build import results_from_posterior

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def corner(posterior: Posterior, before: Posterior | None = None) -> Figure:
    """Corner plot of the physical parameters and effects; `before` is drawn beside, where given."""
    from bayesimpact.report.figures.corner import corner_figure
    from bayesimpact.report.figures.inline import inline

    results = results_from_posterior(posterior, backbone=False, before=before)
    assert results.draws is not None
    return inline(corner_figure(results.draws, before=results.before))
