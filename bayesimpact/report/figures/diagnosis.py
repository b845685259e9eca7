"""Who draws the figures of a diagnosis, from `Results.diagnosis` and `Results.diagnosis_arrays`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from bayesimpact.report.figures.bands import band_figures
from bayesimpact.report.figures.designs import design_figures
from bayesimpact.report.figures.force_map import force_figures
from bayesimpact.report.figures.formula import formula_figures
from bayesimpact.report.figures.gaussian import gaussian_figures
from bayesimpact.report.figures.improvement import improvement_figures
from bayesimpact.report.figures.likelihood_gain import likelihood_gain_figures
from bayesimpact.report.figures.ranking import ranking_figures
from bayesimpact.report.figures.story import story_figures
from bayesimpact.report.results import Results

Drawer = Callable[[Results], Mapping[str, Figure]]

DRAWERS: tuple[Drawer, ...] = (
    story_figures,
    force_figures,
    formula_figures,
    likelihood_gain_figures,
    ranking_figures,
    improvement_figures,
    band_figures,
    gaussian_figures,
    design_figures,
)
"""Functions from results to figures by name; each returns {} when its arrays are not there."""
