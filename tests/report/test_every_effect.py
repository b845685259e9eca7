"""A report is made whatever effect a diagnosis names: no parameter that an effect takes away or
brings along is missing anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import coarse_figures
import numpy as np
import pytest
from diagnosed import DIAGNOSIS, LIMITS, MODELS, estimate, made_up_arrays
from effect_rigs import BY_ID, with_effect
from matplotlib.figure import Figure

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification
from bayesimpact.report.archive import load_results
from bayesimpact.report.build import ReportContext, results_from_fit
from bayesimpact.report.figures import gaussian, save
from bayesimpact.report.figures.corner import NormalLaw, corner_figure
from bayesimpact.report.figures.gaussian import gaussian_figures
from bayesimpact.report.figures.improvement import improvement_figures
from bayesimpact.report.write import Written, write_results

VERDICTS = ("named", "ambiguous", "unknown")


def few_pairs(after: NormalLaw, *, before: NormalLaw, **told: Any) -> Figure:
    """The corner plot of two parameters: the first of the base model and the last added one."""
    assert len(after.names) == after.mean.size

    def some(law: NormalLaw) -> NormalLaw:
        ends = [0, len(law.names) - 1]
        names, units = (tuple(text[i] for i in ends) for text in (law.names, law.units))
        return replace(law, names=names, units=units, mean=law.mean[ends],
                       covariance=law.covariance[np.ix_(ends, ends)])  # fmt: skip

    return corner_figure(some(after), before=some(before), **told)


MOTIONS: dict[str, bytes] = {}


def saved(name: str, figure: Figure, folder: Path) -> bytes:
    """A figure's file; recorded motions, which look alike whatever the effect, from the first."""
    if not name.startswith("fit"):
        return coarse_figures.saved(name, figure, folder)
    if name not in MOTIONS:
        MOTIONS[name] = coarse_figures.saved(name, figure, folder)
    return MOTIONS[name]


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """What shows parameters is drawn, coarsely."""
    coarse_figures.draw_coarsely(monkeypatch, pixels=True)
    monkeypatch.setattr(save, "_saved", saved)
    monkeypatch.setattr(save, "DIAGNOSIS", (improvement_figures, gaussian_figures))
    monkeypatch.setattr(gaussian, "corner_figure", few_pairs)


def extended(small: Identification, effect_id: str) -> Fit:
    """The small rig's fit with an effect at its null beside it, and made-up uncertainties."""
    fit = with_effect(small, effect_id)
    known = dict(zip(small.fit.names, small.fit.sd, strict=True))
    sd = [known.get(n, 0.01 * abs(m) + 1e-9) for n, m in zip(fit.names, fit.mode, strict=True)]
    return replace(fit, covariance=np.diag(np.square(sd)))


def table(fit: Fit) -> dict[str, Any]:
    units = [p.unit for p in fit.density.oscillator.layout.parameters]
    rows = zip(fit.names, fit.mode, fit.sd, units, strict=True)
    return {name: estimate(float(mode), float(sd), unit) for name, mode, sd, unit in rows}


def written(small: Identification, fit: Fit, folder: Path, verdict: str = "named") -> Written:
    """The report of a diagnosis that ends with this fit."""
    ids = [e.id for e in fit.density.oscillator.effects]
    own = {name: row for name, row in table(fit).items() if "." in name}
    content = {
        **DIAGNOSIS,
        "verdict": verdict,
        "effects": [
            {**DIAGNOSIS["effects"][0], "id": i, "family": BY_ID[i].family,
             "parameters": {n: row for n, row in own.items() if n.startswith(f"{i}.")}}
            for i in ids
        ],
        "parameters": {"before": table(small.fit), "after": table(fit)},
        "limits": LIMITS,
        "evidence": {"models": [{"effects": ids, "log_odds": 900.0}, *MODELS], "decisive": 5.5},
    }  # fmt: skip
    arrays = made_up_arrays(3, 2)
    arrays |= {"before_mode": small.fit.mode, "before_covariance": small.fit.covariance}
    final = replace(small, fit=fit, search=None)
    context = ReportContext(diagnosis=content, arrays=arrays)
    return write_results(results_from_fit(final, context), folder)


@pytest.mark.parametrize(
    "effect_id",
    [i if n % 4 == 0 else pytest.param(i, marks=pytest.mark.long) for n, i in enumerate(BY_ID)],
)
def test_report_of_every_effect(small: Identification, effect_id: str, tmp_path: Path) -> None:
    made = written(small, extended(small, effect_id), tmp_path)
    assert dict(made.failed) == {}
    page = made.page.read_text()
    assert effect_id in page and page.count("<img") >= 4
    names = [row.name for row in load_results(tmp_path).rows]
    assert names == [row.name for row in made.results.rows]


@pytest.fixture
def pair(small: Identification) -> Iterator[Fit]:
    """Two effects that take c2 and g away together."""
    from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer

    effects = tuple(BY_ID[i] for i in ("contact_damping_per_case", "gap_per_recording"))
    scales = campaign_scales(small.fit)
    density = extend(small.fit, effects, scales)
    mode = transfer(small.fit, density.oscillator.layout, effects, scales, {})
    covariance = np.diag(np.square(1e-3 * np.abs(mode) + 1e-9))
    yield replace(small.fit, density=density, mode=mode, covariance=covariance)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_report_of_every_verdict(
    small: Identification, pair: Fit, verdict: str, tmp_path: Path
) -> None:
    assert {"c2", "g"}.isdisjoint(pair.names)
    assert dict(written(small, pair, tmp_path, verdict).failed) == {}


def test_report_of_a_fit_without_stiffness(small: Identification, tmp_path: Path) -> None:
    fit = extended(small, "coulomb_friction")
    mode, covariance = fit.mode.copy(), fit.covariance.copy()
    k1 = fit.names.index("k1")
    mode[k1], covariance[k1, k1] = 0.0, 0.0
    assert (
        dict(written(small, replace(fit, mode=mode, covariance=covariance), tmp_path).failed) == {}
    )
