"""Writes a folder of results: what the commands call."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bayesimpact.inference.identify import Identification
from bayesimpact.inference.posterior import Posterior
from bayesimpact.report import archive_arviz
from bayesimpact.report.archive import load_results, save_results, write_text
from bayesimpact.report.build import results_from_fit, results_from_posterior
from bayesimpact.report.figures.shares import save_all
from bayesimpact.report.groups import inference_groups
from bayesimpact.report.html import render
from bayesimpact.report.results import Array, Results

REPORT_FILE = "report.html"
POSTERIOR_FILE = "posterior.nc"
LATEX_FILE = "tables.tex"


def write_report(results: Results, folder: Path) -> Path:
    """Figures and report.html of the results that a folder holds; path of the page."""
    pictures = save_all(results, folder)
    page = folder / REPORT_FILE
    write_text(page, render(results, pictures))
    return page


def write_results(results: Results, folder: Path) -> Results:
    """results.nc, fit.json, figures and report.html into a folder, made if absent."""
    folder.mkdir(parents=True, exist_ok=True)
    save_results(results, folder)
    write_report(results, folder)
    return results


def rewrite_report(folder: Path) -> Path:
    """The report of whatever a folder holds, from its files alone; path of the page.

    Raises
    ------
    InputError : the folder holds no results
    """
    return write_report(load_results(folder), folder)


def write_latex(folder: Path) -> Path:
    """The tables of the results that a folder holds, for LaTeX; path of the file."""
    from bayesimpact.report.latex import latex_tables

    path = folder / LATEX_FILE
    write_text(path, latex_tables(load_results(folder)))
    return path


def write_fit(
    identification: Identification,
    folder: Path,
    *,
    seed: int = 0,
    command: str = "",
    seconds: float = float("nan"),
    references: Mapping[str, Mapping[str, float]] | None = None,
    diagnosis: Mapping[str, Any] | None = None,
    diagnosis_arrays: Mapping[str, Array] | None = None,
) -> Results:
    """Write the results of a fit; parameters as in `build.results_from_fit`."""
    results = results_from_fit(
        identification,
        seed=seed,
        command=command,
        seconds=seconds,
        references=references,
        diagnosis=diagnosis,
        diagnosis_arrays=diagnosis_arrays,
    )
    return write_results(results, folder)


def write_posterior(
    posterior: Posterior,
    identification: Identification | None,
    folder: Path,
    *,
    before: Posterior | None = None,
    command: str = "",
    seconds: float = float("nan"),
    references: Mapping[str, Mapping[str, float]] | None = None,
    diagnosis: Mapping[str, Any] | None = None,
    diagnosis_arrays: Mapping[str, Array] | None = None,
) -> Results:
    """Write the results of sampling, and posterior.nc for ArviZ.

    Parameters as in `build.results_from_posterior`.
    """
    results = results_from_posterior(
        posterior,
        identification,
        before=before,
        command=command,
        seconds=seconds,
        references=references,
        diagnosis=diagnosis,
        diagnosis_arrays=diagnosis_arrays,
    )
    folder.mkdir(parents=True, exist_ok=True)
    archive_arviz.write_posterior(
        folder / POSTERIOR_FILE,
        inference_groups(posterior, results.provenance),
        None
        if before is None or before is posterior
        else inference_groups(before, results.provenance),
    )
    return write_results(results, folder)
