"""Writes a folder of results: what the commands call."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from bayesimpact.data.files import write_text
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.posterior import Posterior
from bayesimpact.report import archive_arviz
from bayesimpact.report.archive import load_results, save_results
from bayesimpact.report.build import NO_CONTEXT, ReportContext, results_from_posterior
from bayesimpact.report.figures.save import reason, save_all
from bayesimpact.report.html import render, unfinished
from bayesimpact.report.latex import latex_tables
from bayesimpact.report.pdf import print_page
from bayesimpact.report.results import Results

REPORT_FILE = "report.html"
POSTERIOR_FILE = "posterior.nc"
LATEX_FILE = "tables.tex"
PDF_FILE = "report.pdf"


@dataclass(frozen=True, eq=False)
class Written:
    """What a folder holds now: the results, the page, and the reason by what failed to be made."""

    results: Results
    page: Path
    failed: Mapping[str, str]


def write_report(
    results: Results, folder: Path, failed: Mapping[str, str] | None = None
) -> Written:
    """Figures and report.html of the results that a folder holds.

    What cannot be drawn or worded is replaced by its reason; `failed` is what failed before.

    Raises
    ------
    OSError : the folder cannot be written
    """
    drawn = save_all(results, folder)
    without = {**(failed or {}), **drawn.failed}
    page = folder / REPORT_FILE
    try:
        text = render(results, drawn.pictures, without)
    except Exception as error:
        without["report"] = reason(error)
        text = unfinished(results, without)
    write_text(page, text)
    return Written(results, page, without)


def write_results(
    results: Results, folder: Path, failed: Mapping[str, str] | None = None
) -> Written:
    """results.nc, fit.json, figures and report.html into a folder, made if absent."""
    folder.mkdir(parents=True, exist_ok=True)
    save_results(results, folder)
    return write_report(results, folder, failed)


def rewrite_report(folder: Path) -> Written:
    """The report of whatever a folder holds, from its files alone.

    Raises
    ------
    InputError : the folder holds no results
    """
    return write_report(load_results(folder), folder)


def more_files(folder: Path, *, pdf: bool, latex: bool) -> list[Path]:
    """The report of a folder as PDF, its tables for LaTeX; paths of what was asked for."""
    files = []
    if latex:
        files.append(folder / LATEX_FILE)
        write_text(files[-1], latex_tables(load_results(folder)))
    if pdf:
        files.append(folder / PDF_FILE)
        print_page(folder / REPORT_FILE, files[-1])
    return files


def write_posterior(
    posterior: Posterior,
    identification: Identification | None,
    folder: Path,
    *,
    before: Posterior | None = None,
    context: ReportContext = NO_CONTEXT,
    failed: Mapping[str, str] | None = None,
) -> Written:
    """Write the results of sampling, and posterior.nc for ArviZ.

    Parameters as in `build.results_from_posterior`; `failed` as in `write_results`. The results are
    written first: neither the backbone check nor ArviZ can lose them.
    """
    without = dict(failed or {})
    make = partial(
        results_from_posterior, posterior, identification, before=before, context=context
    )
    try:
        results = make()
    except Exception as error:
        without["backbone"] = reason(error)
        results = make(backbone=False)
    folder.mkdir(parents=True, exist_ok=True)
    save_results(results, folder)
    try:
        made = asdict(results.provenance)
        apart = None if before is None or before is posterior else before.arviz_groups(made)
        after = posterior.arviz_groups(made)
        archive_arviz.write_posterior(folder / POSTERIOR_FILE, after, apart)
    except OSError:
        raise
    except Exception as error:
        without[POSTERIOR_FILE] = reason(error)
    return write_report(results, folder, without)
