"""Figures: what is on them, at every number of recordings; files; nobody's style is changed."""

from __future__ import annotations

import gc
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from diagnosed import diagnosed, diagnosis_figures
from matplotlib.figure import Figure
from synthetic import all_figures, make_results

from bayesimpact.report.digits import Digits
from bayesimpact.report.figures.backbone import backbone_figures, deviation
from bayesimpact.report.figures.corner import NormalLaw, corner_figure
from bayesimpact.report.figures.recordings import (
    MOST,
    close_up,
    recording_figures,
    shown_recordings,
)
from bayesimpact.report.figures.save import (
    file_name,
    png,
    save_all,
    save_drawn,
    save_figures,
)
from bayesimpact.report.figures.style import polyline, scaled, symbol
from bayesimpact.report.html import png_size
from bayesimpact.report.results import Draws, Results


def titles(figure: Figure) -> list[str]:
    return [axis.get_title(loc="left") for axis in figure.axes]


def axis_labels(figure: Figure) -> set[str]:
    found = {axis.get_xlabel() for axis in figure.axes} | {
        axis.get_ylabel() for axis in figure.axes
    }
    return {text.replace("\n", " ") for text in found} - {""}


def test_all_figures() -> None:
    figures = all_figures(make_results(3, 2))
    assert list(figures) == [
        "fit_case_1", "fit_case_2", "corner", "backbone", "damping", "search", "traces",
    ]  # fmt: skip
    assert list(all_figures(make_results(1, stop=False, sampled=False))) == ["fit", "search"]


def test_axes_carry_units() -> None:
    figures = all_figures(make_results(2, 1))
    for name in ("fit_case_1", "backbone", "damping", "corner"):
        for text in axis_labels(figures[name]):
            assert text.endswith(")") and "(" in text, f"{name}: {text}"
    assert "displacement (mm)" in axis_labels(figures["fit_case_1"])
    assert "residual (µm)" in axis_labels(figures["fit_case_1"])
    assert "frequency (Hz)" in axis_labels(figures["backbone"])


def test_angles_are_in_rad() -> None:
    results = make_results(1, stop=False)
    turned = tuple(replace(r, quantity="angle") for r in results.recordings)
    results = replace(results, quantity="angle", recordings=turned)
    labels = axis_labels(all_figures(results)["fit"])
    assert "angle (rad)" in labels and not any("m)" in text.replace("µrad", "") for text in labels)


def test_stop_is_drawn_where_the_probe_reads_it() -> None:
    results = make_results(1, 1)
    motion = recording_figures(results)["fit_case_1"].axes[0]
    levels = [line.get_ydata()[0] for line in motion.lines if len(line.get_ydata()) == 2]
    assert levels == [pytest.approx(1e3 * (1.1e-3 + 9.5e-6))]


def test_every_recording_is_shown_once_up_to_the_limit() -> None:
    results = make_results(MOST, 3, n=200)
    shown = [t for f in recording_figures(results).values() for t in titles(f) if "case" in t]
    assert sorted(shown) == sorted(f"{r.name}, case {r.case}" for r in results.recordings)
    assert set(recording_figures(results)) == {
        f"fit_case_{c}_{p}" for c in (1, 2, 3) for p in (1, 2)
    }


def test_fifty_recordings_show_the_worst_of_every_case() -> None:
    results = make_results(50, 5, n=100)
    worst = replace(results.recordings[48], reduced_chi2=9.0)
    results = replace(results, recordings=(*results.recordings[:48], worst, results.recordings[49]))
    shown = shown_recordings(results)
    assert len(shown) == MOST and worst in shown
    assert {r.case for r in shown} == set(results.cases)
    assert len({r.name for r in shown}) == MOST


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 9])
def test_nothing_overlaps(count: int) -> None:
    """Titles and labels keep clear of one another, of other panels and of the edge."""
    results = make_results(count, 3 if count > 1 else 1, n=300)
    told = diagnosis_figures(diagnosed(count, 3 if count > 1 else 1))
    for figure in (all_figures(results) | told).values():
        png(figure)
        boxes = []
        for axis in figure.axes:
            texts = [axis.xaxis.label, axis.yaxis.label, axis.title, axis._left_title]
            if axis.xaxis.get_tick_params()["labelbottom"]:
                low, high = axis.get_xlim()
                ticks = zip(axis.get_xticks(), axis.get_xticklabels(), strict=True)
                texts += [text for place, text in ticks if low <= place <= high]
            boxes += [(t.get_text(), t.get_window_extent()) for t in texts if t.get_text().strip()]
        width, height = figure.bbox.size
        panels = [("a panel", axis.get_window_extent()) for axis in figure.axes]
        for i, (text, box) in enumerate(boxes):
            assert box.x0 > -1 and box.y0 > -1 and box.x1 < width + 1 and box.y1 < height + 1, text
            for other, second in boxes[i + 1 :] + panels:
                apart = (
                    box.x1 <= second.x0 + 1 or second.x1 <= box.x0 + 1
                    or box.y1 <= second.y0 + 1 or second.y1 <= box.y0 + 1
                )  # fmt: skip
                assert apart, f"{text!r} on {other!r}"


def test_deviation_is_in_half_widths() -> None:
    band = np.array([[1.0, 2.0, 4.0]] * 4)
    assert deviation(np.array([2.0, 4.0, 1.0, 0.0]), band).tolist() == [0.0, 1.0, -1.0, -2.0]
    flat = deviation(np.array([2.0, 3.0, np.nan]), np.full((3, 3), 2.0))
    assert flat[0] == 0.0 and np.isnan(flat[1:]).all()


def two_posteriors() -> tuple[Draws, Draws]:
    rng = np.random.default_rng(0)
    after = Draws("after", ("k1", "drag.coefficient"), ("N/m", "N s2/m2"),
                  rng.standard_normal((500, 2)) * [3e-3, 1e-5] + [808.5, 2e-4])  # fmt: skip
    before = Draws("before", ("k1",), ("N/m",), rng.standard_normal((500, 1)) * 2e-3 + 808.9)
    return after, before


def test_corner_of_two_posteriors_shows_both() -> None:
    after, before = two_posteriors()
    figure = corner_figure(after, before=before)
    first = figure.axes[0]
    low, high = first.get_xlim()
    axis = scaled("k1", "N/m", np.concatenate([after.values[:, 0], before.values[:, 0]]))
    for values in (after.values[:, 0], before.values[:, 0]):
        middle = float(np.median(values) - np.median(after.values[:, 0])) * axis.scale
        assert low < middle < high
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["before", "after"]


def test_corner_marks_a_near_truth_and_leaves_a_far_one_out() -> None:
    after, _ = two_posteriors()
    near = corner_figure(after, truths={"k1": 808.51}, truth_label="Table 2")
    axis, middle = scaled("k1", "N/m", after.values[:, 0]), np.median(after.values[:, 0])
    low, high = near.axes[0].get_xlim()
    assert low < float(808.51 - middle) * axis.scale < high
    far = corner_figure(after, truths={"k1": 900.0})
    low, high = far.axes[0].get_xlim()
    assert not low < float(900.0 - middle) * axis.scale < high


def test_corner_tells_the_numbers_it_is_given() -> None:
    after, _ = two_posteriors()
    figure = corner_figure(after, estimates={"k1": (808.5006, 808.496, 808.505)})
    assert "808.501 ± 0.005 N/m" in figure.axes[0].get_title(loc="left").replace("\xa0", " ")
    coarse = {"k1": Digits(1.0, "N/m", 2)}  # as the widest of several intervals allows
    figure = corner_figure(after, estimates={"k1": (808.5, 808.496, 808.504)}, shown=coarse)
    assert "808.50 ± 0.004 N/m" in figure.axes[0].get_title(loc="left").replace("\xa0", " ")


def test_corner_of_normal_laws_is_drawn_in_closed_form() -> None:
    covariance = np.array([[4.0, 1.5], [1.5, 1.0]])
    law = NormalLaw("posterior", ("k1", "c1"), ("N/m", "N s/m"), np.array([10.0, 5.0]), covariance)
    figure = corner_figure(law)
    marginal = next(a for a in figure.axes if a.get_subplotspec().get_geometry()[2] == 0)
    x, density = marginal.lines[0].get_data()
    shape = np.exp(-0.5 * ((x - 10.0) / 2.0) ** 2)
    assert np.allclose(density / density.max(), shape)
    pair = next(a for a in figure.axes if a.get_subplotspec().get_geometry()[2] == 2)
    x, y = pair.lines[1].get_data()  # two standard deviations
    off = np.stack([x - 10.0, y - 5.0])
    distance = np.einsum("in,ij,jn->n", off, np.linalg.inv(covariance), off)
    assert np.allclose(distance, 4.0)


def test_close_up_holds_the_deepest_impact_and_residuals_have_one_scale() -> None:
    results = make_results(2, 1)
    recording = results.recordings[0]
    start, end, words = close_up(results, recording)
    deepest = recording.times[np.argmax(recording.predicted)]
    assert start < deepest < end < start + 0.2 and words == "deepest impact"
    flat = replace(recording, predicted=np.minimum(recording.predicted, 1e-3))
    assert close_up(results, flat)[2] == "first cycles"
    free = make_results(1, stop=False)
    assert close_up(free, free.recordings[0])[2] == "first cycles"
    figure = recording_figures(results)["fit_case_1"]
    residuals = [a.get_ylim() for a in figure.axes if "residual" in a.get_ylabel()]
    assert len(residuals) == 2 and len(set(residuals)) == 1


def test_corner_of_one_parameter_and_of_a_constant() -> None:
    rng = np.random.default_rng(1)
    one = Draws("posterior", ("k1",), ("N/m",), rng.standard_normal((300, 1)))
    assert len(corner_figure(one).axes) == 1
    values = np.column_stack([rng.standard_normal(300), np.full(300, 2.0)])
    png(corner_figure(Draws("posterior", ("k1", "c1"), ("N/m", "N s/m"), values)))


def test_axis_reads_from_the_last_digits() -> None:
    values = 808.5552 + 2.8e-3 * np.random.default_rng(2).standard_normal(1000)
    axis = scaled("k1", "N/m", values)
    assert axis.label.startswith("$k_1$ \N{MINUS SIGN} 808.55") and axis.label.endswith("(mN/m)")
    assert np.allclose(axis(values), (values - axis.offset) * 1e3)
    wide = scaled("k2[1]", "N/m", values * np.linspace(0.5, 2, 1000))
    assert wide.offset == 0.0 and wide.label == "$k_2$[1] (N/m)"


def test_traces_are_counted_from_the_median_as_the_table_tells_it() -> None:
    """Table and posterior had 4776.6, the traces 4776.5: their own middle, coarser."""
    results = make_results(2, 1)
    assert results.sampler is not None
    row = results.rows[0]
    titles = [a.get_title(loc="left") for a in all_figures(results)["traces"].axes]
    assert results.sampler.trace_names[0] == row.name == "c1"
    assert titles[0].startswith(f"$c_1$ − {results.digits(row).value(row.median)} N")
    own = scaled("c1", row.unit, results.sampler.traces[..., 0].ravel())
    assert not titles[0].startswith(own.quantity)


def test_symbols() -> None:
    assert symbol("k2[beam 1]") == "$k_2$[beam 1]"
    assert symbol("sigma") == r"$\sigma$"
    assert symbol("coulomb_friction.force") == "force"


def test_thinned_line_keeps_every_peak() -> None:
    rng = np.random.default_rng(5)
    x, y = np.arange(60_001.0), rng.standard_normal(60_001)
    y[31_234], y[60_000] = 50.0, -50.0
    short_x, short_y = polyline(x, y, 500)
    assert short_x.size < 1200
    assert short_y.max() == 50.0 and short_y.min() == -50.0
    assert np.all(np.diff(short_x) >= 0)
    assert np.array_equal(y[short_x.astype(int)], short_y)
    assert polyline(x[:900], y[:900], 500)[1].size == 900


def test_files(tmp_path: Path) -> None:
    results = replace(make_results(1, 1, n=200), draws=None, backbone=None, sampler=None)
    pictures = save_figures(all_figures(results), tmp_path / "figures")
    assert sorted(f.name for f in (tmp_path / "figures").iterdir()) == [
        "fit_case_1.pdf", "fit_case_1.png", "search.pdf", "search.png",
    ]  # fmt: skip
    for name, data in pictures.items():
        assert (tmp_path / "figures" / f"{name}.png").read_bytes() == data
        assert data.startswith(b"\x89PNG") and png_size(data)[0] == 1500
        assert (tmp_path / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    assert file_name('fit_case_1/2 "ß"').startswith("fit_case_1_2__ß_-")
    assert file_name("fit_case_a b") != file_name("fit_case_a_b") == "fit_case_a_b"
    assert len(f".{file_name('ß' * 300)}.png.12345678.png".encode()) < 255


@pytest.mark.long
@pytest.mark.usefixtures("coarse_figures")
def test_all_are_saved_in_the_order_of_the_page(tmp_path: Path) -> None:
    told = replace(diagnosed(1, 1), sampler=None, backbone=None)
    pictures = save_all(told, tmp_path).pictures
    assert list(pictures) == list(all_figures(told))
    assert {f.stem for f in (tmp_path / "figures").iterdir()} == set(pictures)


@pytest.mark.long
def test_every_file_is_drawn_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[str] = []
    draw = Figure.draw

    def counted(figure: Figure, renderer: Any) -> None:
        drawn.append(type(renderer).__name__)
        draw(figure, renderer)

    results = make_results(1, 1, n=200)
    figures = {**recording_figures(results), **backbone_figures(results)}
    monkeypatch.setattr(Figure, "draw", counted)
    for name in ("fit_case_1", "backbone"):  # placed by hand, and by a layout engine
        drawn.clear()
        save_figures({name: figures[name]}, tmp_path)
        assert drawn == ["RendererAgg", "MixedModeRenderer"]


@pytest.mark.parametrize("enabled", [True, False])
def test_the_collector_is_held_back_while_a_figure_is_drawn(enabled: bool, tmp_path: Path) -> None:
    seen: list[bool] = []

    def looks_and_fails(results: Results) -> dict[str, Figure]:
        seen.append(gc.isenabled())
        raise OSError("full")

    (gc.enable if enabled else gc.disable)()
    try:
        with pytest.raises(OSError, match="full"):
            save_drawn(looks_and_fails, make_results(1, 1, n=200, sampled=False), tmp_path)
        assert (seen, gc.isenabled()) == ([False], enabled)
    finally:
        gc.enable()


def test_style_stays_inside(tmp_path: Path) -> None:
    results: Results = make_results(1, 1, n=200)
    with matplotlib.rc_context({"font.size": 17.0, "axes.linewidth": 3.0}):
        before = dict(matplotlib.rcParams)
        figures = all_figures(results)
        save_figures({"search": figures["search"]}, tmp_path)
        assert dict(matplotlib.rcParams) == before


def test_names_with_dollar_signs_are_shown_as_they_are(tmp_path: Path) -> None:
    """Two of them would begin and end mathematics: none of these is valid there."""
    name = r"$\frac$ a_{b $x$"
    plain = make_results(2, 1, n=200)
    first = replace(plain.recordings[0], name=name, case="$^$")
    draws = plain.draws
    assert draws is not None
    rows = tuple(
        replace(r, name=r.name.replace("[run_0]", f"[{name}]").replace("k2[1]", "k2[$^$]"))
        for r in plain.rows
    )
    names = tuple(n.replace("k2[1]", "k2[$^$]") for n in draws.names)
    results = replace(
        plain, recordings=(first, plain.recordings[1]), rows=rows, draws=replace(draws, names=names)
    )
    figures = all_figures(results)
    assert set(figures) >= {"fit_case_$^$", "corner"}
    for drawn in ("fit_case_$^$", "corner"):
        png(figures[drawn])
    assert f"{name}, case $^$".replace("$", r"\$") in titles(figures["fit_case_$^$"])


def test_a_figure_that_fails_leaves_its_reason_and_the_others(tmp_path: Path) -> None:
    results = make_results(1, 1, n=200, sampled=False)

    def broken_figure(results: Results) -> dict[str, Figure]:
        raise KeyError("g")

    def half(results: Results) -> dict[str, Figure]:
        bad, good = Figure(), Figure()
        bad.text(0, 0, r"$\frac$")
        return {"bad_one": bad, "good": good}

    assert dict(save_drawn(broken_figure, results, tmp_path).failed) == {
        "broken figure": "KeyError: 'g'"
    }
    made = save_drawn(half, results, tmp_path)
    assert list(made.pictures) == ["good"] and list(made.failed) == ["bad one"]
    assert made.failed["bad one"].startswith("ValueError") and "\n" not in made.failed["bad one"]


def test_a_full_disk_is_no_failed_figure(tmp_path: Path) -> None:
    def full(results: Results) -> dict[str, Figure]:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="space"):
        save_drawn(full, make_results(1, 1, n=200, sampled=False), tmp_path)


@pytest.mark.parametrize("sd", [0.9, 1.4, 2.3, 3.7, 5.0, 8.1])
def test_every_axis_of_a_corner_plot_tells_its_scale(sd: float) -> None:
    rng = np.random.default_rng(2)
    values = np.array([808.5, 0.148]) + rng.standard_normal((500, 2)) * [sd * 1e-3, sd * 1e-6]
    figure = corner_figure(Draws("posterior", ("k1", "c1"), ("N/m", "N s/m"), values))
    below = [axis for axis in figure.axes if axis.get_xlabel()]
    assert len(below) == 2 and all(len(axis.get_xticks()) > 1 for axis in below)
    assert len(below[0].get_yticks()) > 1
