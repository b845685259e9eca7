"""The explorer: its data are the recordings' own, and it works in a real browser."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Tab, browser, chromium
from coarse_figures import draw_coarsely
from diagnosed import diagnosed
from synthetic import make_results, row

from bayesimpact.report.archive import save_results
from bayesimpact.report.cycles import Cycle, contact_onsets, cycles
from bayesimpact.report.diagnosis.force_in_time import force_in_time
from bayesimpact.report.explorer import MOST_SAMPLES, explorer_data, explorer_words, scripts
from bayesimpact.report.figures.force_map import force_unit
from bayesimpact.report.figures.recordings import close_up
from bayesimpact.report.html import render
from bayesimpact.report.results import Array, Results
from bayesimpact.report.write import rewrite_report


def compared(count: int = 3, cases: int = 2, n: int = 600) -> Results:
    """A diagnosis whose base model is off by 20 um after the third touch of the first recording."""
    results = diagnosed(count, cases)
    if n != 600:
        results = replace(results, recordings=make_results(count, cases, n=n).recordings)
    before = [r.predicted.copy() for r in results.recordings]
    third = contact_onsets(results.recordings[0].predicted, 1.1095e-3)[2]
    before[0][third : third + 100] += 20e-6
    arrays = dict(results.diagnosis_arrays) | {"before_predicted": np.concatenate(before)}
    return replace(results, diagnosis_arrays=arrays)


def floats(text: str) -> Array:
    return np.frombuffer(base64.b64decode(text), "<f4").astype(float)


def integers(packed: dict) -> Array:
    return packed["scale"] * np.frombuffer(base64.b64decode(packed["data"]), "<i2")


def test_data_are_those_of_the_recordings() -> None:
    results = compared()
    content = json.loads(explorer_data(results))
    assert content["models"] == ["base model", "with what was added"]
    before = np.split(results.diagnosis_arrays["before_predicted"], 3)
    for r, item, old in zip(results.recordings, content["recordings"], before, strict=True):
        assert item["name"] == r.name and item["interval"] == r.interval
        assert np.allclose(floats(item["samples"]), 1e3 * r.samples, rtol=0, atol=1e-6)
        for packed, model in zip(item["residuals"], (old, r.predicted), strict=True):
            # half of one of 32767 steps up to the largest, here below 40 um
            assert np.max(np.abs(integers(packed) - 1e6 * (r.samples - model))) < 40 / 32767
        assert item["level"] == pytest.approx(1.1095)
        assert item["impacts"] == contact_onsets(r.predicted, 1.1095e-3).tolist()
    assert (
        content["recordings"][0]["best"]
        == contact_onsets(results.recordings[0].predicted, 1.1095e-3)[2]
    )
    assert content["first"] == 0 and "<" not in explorer_data(results)


def gaining(results: Results) -> list[Cycle]:
    """Those in which the extended model gains, the most first."""
    return sorted((c for c in cycles(results) if c.gain > 0), key=lambda c: -c.gain)


def test_the_cycle_that_tells_most_is_where_the_base_model_is_off() -> None:
    results = compared()
    best = gaining(results)[0]
    assert (best.recording, best.number) == (0, 3)
    part, r = slice(best.first, best.last), results.recordings[0]
    old = results.diagnosis_arrays["before_predicted"][: r.samples.size]
    gain = ((r.samples - old)[part] ** 2 - r.residual[part] ** 2).sum() / (2 * r.noise_rms**2)
    assert best.gain == pytest.approx(gain)
    inside = r.predicted[best.first : best.leave]
    assert (inside >= 1.1095e-3).all() and r.predicted[best.leave] < 1.1095e-3
    assert cycles(replace(results, diagnosis_arrays={})) == []


def test_what_is_set_aside_gains_nothing_in_a_cycle() -> None:
    results = compared()
    best = gaining(results)[0]
    first, *rest = results.recordings
    aside = replace(first, excluded=((best.first, best.last),))
    again = gaining(replace(results, recordings=(aside, *rest)))
    assert (best.recording, best.number) not in [(c.recording, c.number) for c in again]


def test_force_in_time_is_the_map_along_the_motion() -> None:
    results = compared()
    arrays = results.diagnosis_arrays
    found = force_in_time(results, 1, results.recordings[1].predicted)
    assert found is not None
    k = 123
    y = results.recordings[1].predicted - 9.5e-6
    v = (y[k + 1] - y[k - 1]) / 2e-3
    a, b, a_sd, b_sd = (
        np.interp(y[k], arrays["force_y"], arrays[f"force_{key}"])
        for key in ("a", "b", "a_sd", "b_sd")
    )
    assert found[0][k] == pytest.approx(a + b * v)
    assert found[1][k] == pytest.approx(np.hypot(a_sd, b_sd * v))
    packed = json.loads(explorer_data(results))["recordings"][1]["force"]
    unit = force_unit(results, arrays)
    assert integers(packed)[k] == pytest.approx(unit.scale * found[0][k], abs=packed["scale"])
    assert force_in_time(make_results(), 0, y) is None


def test_what_is_not_finite_is_left_out() -> None:
    results = compared()
    broken = results.recordings[0].predicted.copy()
    broken[50:60] = np.nan
    first = replace(results.recordings[0], predicted=broken, noise_rms=float("nan"))
    results = replace(results, recordings=(first, *results.recordings[1:]))
    item = json.loads(explorer_data(results))["recordings"][0]
    values = integers(item["residuals"][1]) / item["residuals"][1]["scale"]
    assert (values[50:60] == -32768).all() and (
        np.abs(np.delete(values, range(50, 60))) < 32768
    ).all()
    assert item["noise"] is None
    assert all(c.recording != 0 for c in gaining(results))
    close_up(results, first)


def test_a_recording_may_have_a_gap_of_its_own() -> None:
    results = compared()
    own = row("gap_per_recording.g[run_1]", 2e-3, 1e-8, "m", "effect")
    results = replace(results, rows=(*results.rows, own))
    levels = [item["level"] for item in json.loads(explorer_data(results))["recordings"]]
    assert levels == [pytest.approx(1.1095), pytest.approx(2.0095), pytest.approx(1.1095)]


def test_long_campaigns_keep_their_size() -> None:
    results = make_results(40, 4, n=6000)
    content = json.loads(explorer_data(results))
    sizes = [floats(item["samples"]).size for item in content["recordings"]]
    assert 0.99 * 12 * 6000 <= sum(sizes) <= MOST_SAMPLES
    assert "12 of 40 recordings" in explorer_words(results)
    long = make_results(1, 1, n=MOST_SAMPLES + 50)
    assert f"first {MOST_SAMPLES} samples" in explorer_words(long)
    assert explorer_words(make_results()) == explorer_words(diagnosed()) == ""


def test_a_force_from_a_large_misfit_is_called_rough() -> None:
    """Spikes of 250 mN stood under a friction of 20 mN, as if they were as well known."""
    large = diagnosed(fit={"before": {"reduced_chi2": 8510.0}})
    assert "rough guide" in explorer_words(large)
    assert explorer_words(replace(large, diagnosis_arrays={})) == ""


def test_scripts_are_the_same_in_every_page_and_hold_no_address() -> None:
    pages = [render(results, {}) for results in (make_results(), compared())]
    blocks = [re.findall(r"<script>(.*?)</script>", page, re.S) for page in pages]
    assert blocks[0] == blocks[1] == list(scripts())
    assert "Permission is hereby granted" in scripts()[0] and "Leon Sorokin" in scripts()[0]
    for word in ("http", "fetch(", "XMLHttpRequest", "WebSocket", "import(", "eval(", "</"):
        assert word not in "".join(scripts()), word


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report written again from its files; of its figures, this page shows the explorer's."""
    folder = tmp_path_factory.mktemp("explorer")
    save_results(compared(), folder)
    with pytest.MonkeyPatch.context() as patch:
        draw_coarsely(patch, pixels=True)
        return rewrite_report(folder).page


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    path = chromium()
    if path is None:
        pytest.skip("no Chromium is installed")
    with browser(path) as opened:
        yield opened


SHOWN = "document.querySelector('[data-part=shown]').textContent"
PART = "document.querySelector('[data-part={}]')"


def shown(tab: Tab) -> tuple[float, float]:
    """Ends of the stretch of time that is shown."""
    found = re.search(r"Shown: ([\d.]+) to ([\d.]+) s", tab.run(SHOWN))
    assert found is not None
    return float(found[1]), float(found[2])


def height_of_residuals(tab: Tab) -> float:
    """Share of the second panel's height that its line takes."""
    return tab.run("""(() => {
        const c = document.querySelectorAll('#explore canvas')[1];
        const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        const of = [[0, 114, 178], [194, 87, 10]].map(([r, g, b]) => {
            const rows = [];
            for (let i = 0; i < p.length; i += 4) {
                const near = Math.abs(p[i] - r) + Math.abs(p[i + 1] - g) + Math.abs(p[i + 2] - b);
                if (p[i + 3] > 200 && near < 30) rows.push(Math.floor(i / 4 / c.width));
            }
            return rows.length ? (rows[rows.length - 1] - rows[0]) / c.height : 0;
        });
        return Math.max(...of);
    })()""")


@pytest.mark.long
def test_choose_zoom_and_switch_in_a_browser(tab: Tab, report: Path) -> None:
    results = compared()
    tab.open(report, 1280)
    assert shown(tab) == pytest.approx((0.0, 0.599), abs=1e-3)
    assert tab.run("document.querySelectorAll('#explore canvas').length") == 3
    tab.drag("#explore .u-over", 0.25, 0.5)
    assert shown(tab) == pytest.approx((0.15, 0.3), abs=0.01)
    tab.run(PART.format("best") + ".click()")
    third = contact_onsets(results.recordings[0].predicted, 1.1095e-3)[2] * 1e-3
    start, end = shown(tab)
    assert start < third < end < start + 0.2
    tab.run(PART.format("previous") + ".click()")
    assert shown(tab)[1] < end
    tab.run(PART.format("whole") + ".click()")
    assert shown(tab) == pytest.approx((0.0, 0.599), abs=1e-3)
    labels = (
        "[...document.querySelectorAll('#explore .u-legend th')].map(e => e.textContent).join()"
    )
    assert "recorded \N{MINUS SIGN} with what was added" in tab.run(labels)
    assert height_of_residuals(tab) > 0.4
    tab.run("document.querySelector('input[value=\"0\"]').click()")
    assert "recorded \N{MINUS SIGN} base model" in tab.run(labels)
    assert height_of_residuals(tab) > 0.4
    choose = "(s => { s.value = '1'; s.dispatchEvent(new Event('change')); })"
    tab.run(f"{choose}({PART.format('recording')})")
    assert tab.run(PART.format("recording") + ".selectedOptions[0].textContent") == "run_1, case 2"
    assert tab.run(PART.format("best") + ".disabled") is True
    assert tab.errors == []


@pytest.mark.long
def test_values_under_the_pointer_are_the_recordings(tab: Tab, report: Path) -> None:
    tab.open(report, 1280)
    tab.drag("#explore .u-over", 0.5, 0.5)
    values = tab.run(
        "[...document.querySelectorAll('#explore .u-legend')].map("
        "l => [...l.querySelectorAll('.u-value')].map(e => e.textContent))"
    )
    time, recorded, model = (float(v.replace("\N{MINUS SIGN}", "-")) for v in values[0][:3])
    r = compared().recordings[0]
    k = round(time / r.interval)
    assert 0 < k < r.samples.size - 1
    assert recorded == pytest.approx(1e3 * r.samples[k], abs=1e-3)
    assert model == pytest.approx(1e3 * r.predicted[k], abs=1e-3)
    residual = float(values[1][1].replace("\N{MINUS SIGN}", "-"))
    assert residual == pytest.approx(1e6 * r.residual[k], abs=0.02)
    assert tab.errors == []


@pytest.mark.long
@pytest.mark.parametrize("width", [390, 768, 1280])
def test_no_sideways_scroll_and_no_requests(tab: Tab, report: Path, width: int) -> None:
    tab.requests.clear()
    tab.open(report, width)
    assert tab.run("document.documentElement.scrollWidth") <= width
    assert tab.run("document.querySelector('#explore').getBoundingClientRect().width") > 0.7 * width
    outside = [r for r in tab.requests if not r.startswith(("file:", "data:"))]
    assert outside == [] and tab.errors == []


@pytest.mark.long
def test_prints_on_a4_without_the_explorer(tab: Tab, report: Path) -> None:
    tab.open(report, 1280)
    data = tab.pdf()
    assert data.startswith(b"%PDF")
    boxes = set(re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)", data))
    assert {(round(float(w)), round(float(h))) for w, h in boxes} == {(595, 842)}
    tab.call("Emulation.setEmulatedMedia", media="print")
    hidden = tab.run("getComputedStyle(document.querySelector('#explore')).display")
    tab.call("Emulation.setEmulatedMedia", media="")
    assert hidden == "none"
