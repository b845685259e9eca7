"""Figures of a diagnosis: which there are, what they say, and that files hold all they need."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coarse_figures import draw_coarsely
from diagnosed import LIMITS, MODELS, diagnosed, diagnosis_figures, made_up_arrays
from matplotlib.collections import PathCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from synthetic import all_figures

from bayesimpact.report.archive import load_results, save_results
from bayesimpact.report.captions import caption
from bayesimpact.report.diagnosis.limit_view import not_found
from bayesimpact.report.diagnosis.view import diagnosis_view
from bayesimpact.report.figures.improvement import shifts
from bayesimpact.report.figures.ranking import FREE_FORCE, MOST, ranked
from bayesimpact.report.figures.save import png
from bayesimpact.report.figures.style import AFTER, BLACK
from bayesimpact.report.results import EffectSummary
from bayesimpact.report.write import rewrite_report

NAMES = {"force_map", "likelihood_gain", "ranking", "limits", "improvement", "shifts", "bands"}


def words(figure: Figure) -> str:
    """All text of a figure, laid out."""
    figure.draw_without_rendering()
    found = [text.get_text() for text in figure.findobj(Text)]
    return " | ".join(found)


def test_every_figure_of_a_sampled_diagnosis() -> None:
    figures = diagnosis_figures(diagnosed())
    assert set(figures) == NAMES
    assert all(caption(name, diagnosed()) != name.replace("_", " ") for name in figures)


def test_without_draws_the_corner_shows_gaussians() -> None:
    results = diagnosed(sampled=False)
    results = replace(results, before_backbone=None)
    figures = all_figures(results)
    assert set(figures) >= NAMES - {"bands"} | {"corner"}
    assert {"base model", "with what was added"} <= set(words(figures["corner"]).split(" | "))
    assert caption("corner", results).startswith("Gaussian")


def test_nothing_is_drawn_from_nothing() -> None:
    results = replace(diagnosed(), diagnosis_arrays={}, before_backbone=None)
    bare = {"verdict": "adequate", "limits": [], "evidence": {}}
    assert diagnosis_figures(replace(results, diagnosis=bare)) == {}
    assert not NAMES & set(all_figures(replace(results, diagnosis=None)))


def test_force_map_is_in_millinewtons_and_marks_contact() -> None:
    text = words(diagnosis_figures(diagnosed())["force_map"])
    for expected in ("force (mN)", "velocity (mm/s)", "displacement (mm)", "contact",
                     "conservative part", "dissipative part", "still unexplained"):  # fmt: skip
        assert expected in text, expected


def test_force_map_colours_only_where_the_mass_has_been() -> None:
    figure = diagnosis_figures(diagnosed())["force_map"]
    mesh = figure.axes[0].collections[0]
    seen = np.ma.filled(mesh.get_array().astype(float), np.nan).reshape(-1, 240)
    assert np.isnan(seen[0, 0]) and np.isfinite(seen[seen.shape[0] // 2]).all()
    assert np.nanmax(np.abs(seen)) == pytest.approx(2.0 + 0.26, rel=0.06)  # a + b v in mN


def test_ranking_keeps_the_base_model_in_sight() -> None:
    models = ranked({"models": MODELS})
    assert len(models) == MOST and models[0] == (("coulomb_friction",), 0.0)
    assert models[-1] == ((), 800.0)
    assert [m[1] for m in models] == sorted(m[1] for m in models)
    text = words(diagnosis_figures(diagnosed())["ranking"])
    assert "base model" in text and "decisive" in text
    assert "0.95" in text and "0.047" in text  # 3 nats apart


def test_ranking_marks_the_chosen_model_even_where_it_is_not_the_best() -> None:
    effects = [{"id": "obstacle_mass"}, {"id": "smoothing"}]
    figure = diagnosis_figures(diagnosed(effects=effects))["ranking"]
    (dots,) = [c for c in figure.axes[0].collections if isinstance(c, PathCollection)]
    colours = [to_hex(c).upper() for c in dots.get_facecolors()]
    assert colours.index(AFTER) == 1 and colours.count(AFTER) == 1
    assert colours[-1] == BLACK  # the base model


def test_ranking_calls_effects_as_the_report_does() -> None:
    (axis, *_) = diagnosis_figures(diagnosed())["ranking"].axes
    labels = [label.get_text() for label in axis.get_yticklabels()]
    both = "quadratic drag\n+ cubic stiffness of the suspension"
    assert labels[:3] == ["dry friction", "mass of the obstacle", both]
    assert "sensor cubic" not in words(diagnosis_figures(diagnosed())["ranking"])
    places = axis.get_yticks()
    assert places[2] - places[1] == pytest.approx(1.3)  # further apart: it has two lines
    assert axis.get_ylim()[0] == pytest.approx(places[-1] + 0.6)


@pytest.mark.parametrize(("odds", "row"), [(900.0, 0), (790.0, 2)])
def test_a_free_force_stands_among_the_models_where_the_verdict_is_unknown(odds, row) -> None:
    evidence = {"models": MODELS, "decisive": 5.5, "free_force_log_odds": odds}
    told = diagnosed(verdict="unknown", effects=[], evidence=evidence)
    models = ranked(evidence, force=True)
    assert models[row] == ((FREE_FORCE,), max(odds, 800.0) - odds)
    figure = diagnosis_figures(told)["ranking"]
    (dots,) = [c for c in figure.axes[0].collections if isinstance(c, PathCollection)]
    assert [to_hex(c).upper() for c in dots.get_facecolors()].index(AFTER) == row
    assert FREE_FORCE in words(figure)
    assert "the best of the catalogue" in words(diagnosis_figures(told)["force_map"])
    assert FREE_FORCE not in words(diagnosis_figures(diagnosed(evidence=evidence))["ranking"])


def test_captions_say_what_holds_for_this_diagnosis_only() -> None:
    results = diagnosed()
    assert "dashed line is the stop" in caption("force_map", results)
    assert "predicted from the others" in caption("improvement", results)
    free = replace(results, diagnosis_arrays={})
    assert "stop" not in caption("force_map", free).replace("towards the stop", "")
    assert "predicted" not in caption("improvement", free)
    assert "Impacts" in caption("likelihood_gain", results) and "Impacts" not in caption(
        "likelihood_gain", free
    )
    assert "Nothing is missing" in caption("force_map", diagnosed(verdict="adequate"))
    large = diagnosed(fit={"before": {"reduced_chi2": 8510.0}})
    assert "rough guide" in caption("force_map", large)
    assert "rough guide" not in caption("force_map", results)


def test_the_caption_of_the_models_says_what_is_blue() -> None:
    assert "the model that was chosen" in caption("ranking", diagnosed())
    unknown = {"verdict": "unknown", "effects": []}
    assert "None was chosen" in caption("ranking", diagnosed(**unknown, evidence={}))
    free = {"free_force_log_odds": 900.0}
    assert "one free force" in caption("ranking", diagnosed(**unknown, evidence=free))


def test_recordings_are_captioned_by_their_case() -> None:
    assert caption("fit_case_2", diagnosed()).startswith("Case 2: recordings")
    assert caption("fit", diagnosed()).startswith("Recordings")


def test_what_the_model_has_is_not_ruled_out() -> None:
    results = diagnosed(verdict="unknown", effects=[])
    listed = {limit["id"] for limit in not_found(results)}
    known = next(iter(listed))
    acting = (EffectSummary(known, "", ""),)
    assert {x["id"] for x in not_found(replace(results, effects=acting))} == listed - {known}


def test_one_wide_interval_does_not_hide_the_other_shifts() -> None:
    def estimate(low: float, middle: float, high: float) -> dict[str, Any]:
        return {"unit": "N/m", "median": middle, "ci90": [low, high]}

    before = {"c1": estimate(0.13, 0.134, 0.138), "k1": estimate(806.0, 807.0, 808.0)}
    near = {"c1": estimate(0.13, 0.135, 0.14), "k1": estimate(800.0, 808.0, 816.0)}
    wide = {**near, "c1": estimate(2.0, 18.0, 52.0)}
    scales = {}
    for name, after in (("near", near), ("wide", wide)):
        told = diagnosed(parameters={"before": before, "after": after})
        scales[name] = diagnosis_figures(told)["shifts"].axes[0].get_xscale()
    assert scales == {"near": "linear", "wide": "symlog"}


def test_limits_are_told_in_their_units() -> None:
    text = words(diagnosis_figures(diagnosed())["limits"]).replace("\N{NO-BREAK SPACE}", " ")
    assert "100 µN" in text and "95.0 N/m" in text and "detection limit" in text


def test_limits_stand_in_one_order_under_one_name_in_table_and_figure() -> None:
    """The table had the scan's order and titles, the figure its own order and ids."""
    results = diagnosed(limits=LIMITS[::-1])
    view = diagnosis_view(results)
    assert view is not None
    titles = [limit["title"] for limit in view["limits"]]
    assert titles == ["quadratic drag", "relaxation of the obstacle"]
    axis = diagnosis_figures(results)["limits"].axes[0]
    assert [label.get_text() for label in axis.get_yticklabels()] == titles


def test_shifts_are_in_deviations_of_the_base_model() -> None:
    sd = 2.0
    old = {"unit": "N/m", "median": 100.0, "ci90": [100 - 1.6448536 * sd, 100 + 1.6448536 * sd]}
    new = {"unit": "N/m", "median": 90.0, "ci90": [88.0, 92.0]}
    tables = {"before": {"k1": old, "c1": old, "sigma": old}, "after": {"k1": new, "sigma": new}}
    ((name, before, after),), unit = shifts(tables)
    assert (
        unit == "its standard deviations"
        and name == "k1"
        and before == pytest.approx([-1.6448536, 0, 1.6448536])
    )
    assert after == pytest.approx([-6, -5, -4])
    wide = tables | {"after": {"k1": new | {"ci90": [88.0, 3000.0]}}}
    ((_, _, after),), unit = shifts(wide)
    assert unit == "%" and after == pytest.approx([-12, -10, 2900])


@pytest.mark.parametrize(("count", "cases"), [(1, 1), (2, 1), (50, 5)])
def test_any_number_of_recordings(count: int, cases: int) -> None:
    for figure in diagnosis_figures(diagnosed(count, cases)).values():
        assert png(figure).startswith(b"\x89PNG")


@pytest.mark.long
def test_report_is_drawn_again_from_stored_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw_coarsely(monkeypatch, pixels=True)  # the same to the pixel
    results = diagnosed(2, 1)
    save_results(results, tmp_path)
    loaded = load_results(tmp_path)
    for name, array in made_up_arrays(2, 1).items():
        assert np.array_equal(loaded.diagnosis_arrays[name], array, equal_nan=True), name
    rewrite_report(tmp_path)
    assert {f.stem for f in (tmp_path / "figures").glob("*.png")} >= NAMES
    first = {f.name: f.read_bytes() for f in (tmp_path / "figures").glob("*.png")}
    rewrite_report(tmp_path)
    assert first == {f.name: f.read_bytes() for f in (tmp_path / "figures").glob("*.png")}
