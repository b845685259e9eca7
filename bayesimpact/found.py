"""What `bi.fit`, `bi.sample` and `bi.diagnose` return: what was found, and what to do with it.

The methods call functions that stand by themselves too (`bi.summary`, `bi.save`, `bi.corner`,
`bi.plot`). They are not in the classes of `inference` and `diagnosis`, which know no report.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from bayesimpact.data.html import html_table, sketch
from bayesimpact.diagnosis import loop
from bayesimpact.diagnosis.intervals import Intervals, intervals
from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.errors import InputError
from bayesimpact.inference import identify, posterior
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.randomness import Random
from bayesimpact.model.units import quantity, readable

if TYPE_CHECKING:
    from pandas import DataFrame

    from bayesimpact.report.notebook import Figure
    from bayesimpact.report.results import Results

Found = identify.Identification | posterior.Posterior | loop.Diagnosis


def summary(found: Found | Results) -> DataFrame:
    """Estimates of every parameter in lab units, as a DataFrame indexed by name.

    Columns: estimate (median; mode of a fit), low and high (90 %), unit, meaning. Of a diagnosis:
    of the extended model, with the intervals of its report.
    """
    import pandas

    from bayesimpact.report.results import Results

    wider = found.intervals if isinstance(found, loop.Diagnosis) else None
    if isinstance(found, loop.Diagnosis):
        found = replace(found.identification, fit=found.after)
    results = found if isinstance(found, Results) else _results(found)
    rows = {}
    for row in results.rows:
        shown = readable(row.unit, abs(row.median))
        known = wider.quantiles(row.name) if wider and row.name in wider.names else None
        low, median, high = known or (row.ci90[0], row.median, row.ci90[1])
        values = (shown.scale * x for x in (median, low, high))
        rows[row.name] = (*values, shown.unit, row.meaning)
    columns = ["estimate", "low", "high", "unit", "meaning"]
    return pandas.DataFrame.from_dict(rows, orient="index", columns=columns)


def save(found: Found, folder: Path | str) -> Path:
    """Write results, figures and report.html into a folder, made if absent; path of the page.

    The report is that of the commands (of a diagnosis: that of `diagnose --quick`).
    """
    from bayesimpact.report.write import REPORT_FILE, write_results

    out = Path(folder)
    if isinstance(found, loop.Diagnosis):
        from bayesimpact.report.build import versions
        from bayesimpact.report.diagnosis.document import document
        from bayesimpact.workflow import write_diagnosis

        content = document(found, seed=0, seconds=float("nan"), versions=versions())
        write_diagnosis(found, content, None, None, out, 0, "")
    else:
        write_results(_results(found), out)
    return out / REPORT_FILE


def _results(found: identify.Identification | posterior.Posterior) -> Results:
    from bayesimpact.report.build import results_from_fit, results_from_posterior

    if isinstance(found, posterior.Posterior):
        return results_from_posterior(found)
    return results_from_fit(found)


class _Shown:
    """What all of them offer."""

    @classmethod
    def of(cls, found: Any) -> Self:
        """The same with the methods below."""
        return cls(**{f.name: getattr(found, f.name) for f in fields(found)})

    def summary(self) -> DataFrame:
        """Estimates in lab units (of a diagnosis: of the extended model): `bi.summary`."""
        return summary(cast(Found, self))

    def save(self, folder: Path | str) -> Path:
        """Results, figures and report.html into a folder: `bi.save`."""
        return save(cast(Found, self), folder)

    def plot_recordings(self) -> Figure:
        """The recordings: `bi.plot` of the campaign."""
        from bayesimpact.report.check_figure import plot

        found: Any = self
        fit = found.after if isinstance(found, loop.Diagnosis) else found.fit
        return plot(fit.density.oscillator.campaign)

    def _repr_html_(self) -> str:
        """Parameters that all recordings share, in the units and digits of the report; recordings
        and residuals as small pictures.
        """
        found: Any = self
        return (
            f"<div>{html_table(repr(self), *_table(found))}{_left({'residual': found.fit})}</div>"
        )


class Identification(_Shown, identify.Identification):
    """The mode of the base model and how it was found, as `bi.fit` returns it."""

    def plot_corner(self) -> Figure:
        """Marginals and pairs of the normal law that has the posterior's curvature at the mode."""
        from bayesimpact.report.notebook import normal_corner

        return normal_corner(self.fit)


class Posterior(_Shown, posterior.Posterior):
    """Draws from the posterior of a model, as `bi.sample` returns them."""

    def plot_corner(self, before: posterior.Posterior | None = None) -> Figure:
        """Marginals and pairs, beside those of another posterior where given: `bi.corner`."""
        from bayesimpact.report.notebook import corner

        return corner(self, before)


class Diagnosis(_Shown, loop.Diagnosis):
    """What the base model leaves out, as `bi.diagnose` returns it."""

    def plot_corner(self) -> Figure:
        """Both models' normal laws at their modes, as in the report.

        Raises
        ------
        InputError : something remains unexplained, of which the curvature knows nothing
        """
        from bayesimpact.report.notebook import normal_corner

        if self.remains is not None:
            found = "a diagnosis that leaves something unexplained"
            raise InputError("plot_corner", found, "the intervals of `summary()` carry it")
        before = None if self.before is self.after else self.before
        return normal_corner(self.after, before)

    def to_arviz(
        self, *, lab_units: bool = False, seed: int | None = None, rng: Random = None
    ) -> Any:
        """Draws of the normal law at the extended model's mode, as `Identification.to_arviz`."""
        extended = replace(self.identification, fit=self.after)
        return extended.to_arviz(lab_units=lab_units, seed=seed, rng=rng)

    def _repr_html_(self) -> str:
        """Effects with their probabilities, and parameters before and after as in the report."""
        found: list[tuple[str, ...]] = [
            (e.title, "", f"probability {self.selection.probability(e.id):.3g}")
            for e in self.effects
        ]
        found += _changes(self)
        columns = ("", "base model, median (90 %)", "with what was added, median (90 %)")
        fits = {"residual of the base model": self.before, "with what was added": self.after}
        if self.before is self.after:
            fits = {"residual": self.before}
        return f"<div>{html_table(repr(self), columns, found)}{_left(fits)}</div>"


def _table(
    found: identify.Identification | posterior.Posterior,
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Columns and rows of a notebook's table."""
    from bayesimpact.report.build import results_from_fit, results_from_posterior

    if isinstance(found, posterior.Posterior):
        results = results_from_posterior(found, backbone=False)
    else:
        results = results_from_fit(found)
    return results.table


def _left(fits: Mapping[str, Fit]) -> str:
    """Every recording, and what fits leave of it, as small pictures with their size."""
    first = next(iter(fits.values()))
    rows = []
    for r, recording in enumerate(first.density.oscillator.campaign.recordings):
        cells: list[str] = [recording.name, sketch(recording.samples)]
        for fit in fits.values():
            left = fit.residuals[r]
            rms = quantity(float(np.sqrt(np.mean(left**2))), recording.unit, 2)
            cells += sketch(left), f"{rms} rms"
        rows.append(cells)
    columns = ("recording", "readings", *(head for name in fits for head in (name, "")))
    return html_table("", columns, rows)


def _changes(found: loop.Diagnosis) -> Iterable[tuple[str, ...]]:
    """Name, estimate before and estimate after."""
    from bayesimpact.report.diagnosis.change_view import estimate

    layout, base = found.after.density.oscillator.layout, intervals(found.before)
    for i in layout.roles("physical", "effect"):
        name, unit = layout.names[i], layout.parameters[i].unit
        if name.startswith(LEARNED):
            continue
        new = _estimate(found.intervals, name, unit)
        old = _estimate(base, name, unit) if name in base.names else None
        before = "" if old is None else estimate(old, like=new)
        yield name, before, estimate(new, like=old)


def _estimate(known: Intervals, name: str, unit: str) -> dict[str, Any]:
    low, median, high = known.quantiles(name)
    return {"unit": unit, "median": median, "ci90": (low, high)}
