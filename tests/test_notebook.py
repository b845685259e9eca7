"""What a notebook shows of campaigns, fits, posteriors and diagnoses, and their summaries."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

import bayesimpact as bi
from bayesimpact import errors as bi_errors
from bayesimpact.data.html import HEIGHT, html_table, sketch
from bayesimpact.data.short_repr import short_repr
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.inference.posterior import Posterior
from bayesimpact.report.build import results_from_fit, results_from_posterior
from bayesimpact.report.diagnosis.change_view import change_row
from bayesimpact.report.diagnosis.document import document


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    campaign = small_rig.record(3, {"coulomb_friction": {"force": 0.01}}, duration=1.5)
    effects = (BY_ID["coulomb_friction"], BY_ID["sensor_drift"])
    return diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)


def cells(html: str) -> list[str]:
    return [cell.text or "" for cell in ET.fromstring(html).iter("td")]


def test_a_table_is_escaped() -> None:
    html = html_table("<b>", ["a & b"], [("<script>", 1234.5678, 3)])
    assert cells(html) == ["<script>", "1235", "3"]
    assert "<script>" not in html and "<b>" not in html and "a &amp; b" in html


def test_a_figure_shows_itself(found: Diagnosis) -> None:
    """Without pyplot, that is; see `report.figures.inline`."""
    figure = bi.plot(found.before.density.oscillator.campaign)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_a_campaign_lists_its_recordings(found: Diagnosis) -> None:
    campaign = found.before.density.oscillator.campaign
    shown = cells(campaign._repr_html_())
    assert [r.name for r in campaign.recordings] == shown[::7]
    assert shown[2] == str(campaign.recordings[0].samples.size) and shown[3] == "1000"
    table = campaign.summary()
    assert list(table.index) == shown[::7] and list(table["case"]) == shown[1::7]
    assert table["duration, s"].iloc[0] == pytest.approx(campaign.recordings[0].duration)


def test_readings_are_sketched_from_the_lowest_to_the_highest() -> None:
    """Of every column of pixels; what is not there is left out."""
    samples = np.zeros(160 * 5)
    samples[3], samples[-1], samples[400:405] = 2.0, -1.0, np.nan
    root = ET.fromstring(sketch(samples))
    lines = root[0].attrib["d"].split("M")[1:]
    assert len(lines) == 159 and not any(line.startswith("80.5,") for line in lines)
    high, low = HEIGHT - 1, 1 + (HEIGHT - 2) * 2 / 3
    assert lines[0] == f"0.5,1.0v{low - 1:.1f}" and lines[1] == f"1.5,{low:.1f}v1.0"
    assert lines[-1] == f"159.5,{low:.1f}v{high - low:.1f}"
    assert len(ET.fromstring(sketch(np.full(7, 3.0)))[0].attrib["d"].split("M")) == 8
    table = html_table("", ["a"], [("<b>",), (sketch(samples),)])
    assert "&lt;b&gt;" in table and table.count("<svg") == 1


def test_a_fit_shows_what_recordings_share(found: Diagnosis) -> None:
    said = repr(found.identification)
    assert said.startswith("<Identification of 'small rig'") and said.count("<") == 1, said
    assert said.endswith(" parameters, converged, not searched>")
    shown = cells(bi.Identification.of(found.identification)._repr_html_())
    assert shown[:30:5] == ["c1", "k1", "c2", "g", "k2[1]", "k2[2]"]
    assert float(shown[6]) == pytest.approx(found.before.value("k1"), rel=1e-3)


def test_what_is_found_shows_what_it_leaves_of_every_recording(
    found: Diagnosis, posterior: bi.Posterior
) -> None:
    """Fits and posteriors once showed tables only."""
    recordings = found.before.density.oscillator.campaign.recordings
    for one in (bi.Identification.of(found.identification), posterior):
        html = one._repr_html_()
        assert html.count("<svg") == 2 * len(recordings)
        assert all(str(sketch(x)) in html for x in one.fit.residuals)
        rms = 1e6 * float(np.sqrt(np.mean(one.fit.residuals[0] ** 2)))
        assert f"{rms:.2g}\N{NO-BREAK SPACE}µm rms" in cells(html)
    html = bi.Diagnosis.of(found)._repr_html_()
    assert html.count("<svg") == 3 * len(recordings)
    assert all(str(sketch(x)) in html for x in (*found.before.residuals, *found.after.residuals))


def test_a_diagnosis_shows_effects_and_extended_parameters(found: Diagnosis) -> None:
    html = bi.Diagnosis.of(found)._repr_html_()
    shown = cells(html)
    assert found.verdict == "named" and "named: coulomb_friction" in html
    assert shown[0] == BY_ID["coulomb_friction"].title and shown[2].startswith("probability")
    assert "coulomb_friction.force" in shown


def test_the_summary_of_a_diagnosis_is_that_of_the_extended_model(found: Diagnosis) -> None:
    table = bi.summary(found)
    row = table.loc["coulomb_friction.force"]
    scale = {"N": 1.0, "mN": 1e3}[row.unit]
    low, median, high = found.intervals.quantiles("coulomb_friction.force")
    assert row.estimate == pytest.approx(scale * median)
    assert (row.low, row.high) == pytest.approx((scale * low, scale * high))
    assert row.low < scale * 0.01 < row.high


@pytest.fixture(scope="module")
def posterior(found: Diagnosis) -> bi.Posterior:
    return bi.sample(found, seed=1, target_ess=200.0)


def test_a_posterior_shows_medians(posterior: Posterior) -> None:
    shown = cells(posterior._repr_html_())
    assert shown[0] == "c1"
    assert float(shown[1]) == pytest.approx(np.median(posterior.column("c1")), rel=1e-3)


def test_what_is_returned_has_the_methods(found: Diagnosis, posterior: bi.Posterior) -> None:
    """Each calls the function of its name, and shows the numbers of the report."""
    assert isinstance(posterior, bi.Posterior)
    diagnosis, mode = bi.Diagnosis.of(found), bi.Identification.of(found.identification)
    campaign = mode.fit.density.oscillator.campaign
    for one in (diagnosis, mode, posterior):
        assert one.summary().equals(bi.summary(one))
        assert len(one.plot_recordings().axes) == len(campaign.recordings)
        assert type(one.to_arviz()).__name__ in ("InferenceData", "DataTree")
    shared = [name for name in found.before.names if name.split("[")[0] in ("c1", "k1", "k2")]
    titles = " ".join(axis.get_title(loc="left") for axis in diagnosis.plot_corner().axes)
    told = document(found, seed=0, seconds=0.0, versions={})["parameters"]
    shown = diagnosis._repr_html_()
    for name in shared:
        row = change_row(name, told["before"][name], told["after"][name])
        assert row["before"] in shown and row["after"] in shown
        assert str(row["after"]).partition(" ")[0] in titles


def test_a_notebook_has_the_units_of_the_report(posterior: bi.Posterior, tmp_path: Path) -> None:
    """Once SI with digits of its own."""
    shown = cells(posterior._repr_html_())
    gap = shown.index("g")
    assert shown[gap + 4] == "mm" and 0.5 < float(shown[gap + 1]) < 2.0
    page = bi.save(posterior, tmp_path).read_text(encoding="utf-8")
    assert shown[gap + 1] in page and posterior.names[0] == "c1"


def test_what_remains_unexplained_is_in_no_corner_plot(found: Diagnosis) -> None:
    left = replace(bi.Diagnosis.of(found), remains=found.selection.chosen)
    with pytest.raises(bi_errors.InputError, match="unexplained"):
        left.plot_corner()


def test_results_of_a_folder_show_what_recordings_share(found: Diagnosis) -> None:
    results = results_from_fit(found.identification)
    shown = cells(results._repr_html_())
    assert shown[::5] == ["c1", "k1", "c2", "g", "k2[1]", "k2[2]"]
    assert float(shown[6]) == pytest.approx(found.before.value("k1"), rel=1e-3)


def records(value: Any, seen: dict[int, Any]) -> Iterator[Any]:
    """Every record of the package that can be reached from another, each once."""
    if id(value) in seen or isinstance(value, (str, np.ndarray)):
        return
    seen[id(value)] = value
    inside: list[Any] = []
    if type(value).__module__.startswith("bayesimpact"):
        yield value
        inside = [getattr(value, f.name, None) for f in fields(value)] if is_record(value) else []
    elif isinstance(value, Mapping):
        inside = list(value.values())
    elif isinstance(value, (tuple, list)):
        inside = list(value)
    for one in inside:
        yield from records(one, seen)


def is_record(value: Any) -> bool:
    return is_dataclass(value) and not isinstance(value, type)


def test_no_record_prints_pages(found: Diagnosis, posterior: Posterior) -> None:
    """A selection once printed 223,000 characters: who asks for a part gets a line or two."""
    everything = (found, posterior, results_from_posterior(posterior))
    sizes = {(len(repr(one)), type(one).__name__) for one in records(everything, {})}
    met = {name for _, name in sizes}
    assert {"Selection", "ExaminedModel", "MissingForce", "Chains", "Results", "Layout"} <= met
    assert max(sizes) < (600, "")


def test_a_record_prints_kinds_in_place_of_what_is_long() -> None:
    @dataclass
    class Example:
        values: np.ndarray
        few: tuple[str, ...]
        many: list[int]
        level: float
        nested: Any = None
        hidden: int = field(default=0, repr=False)

        __repr__ = short_repr

    inner = Example(np.zeros(2), (), [], 1.0)
    shown = repr(Example(np.zeros((5, 7)), ("a",), [0] * 50, 1 / 3, inner))
    few = "values=<array (5, 7)>, few=('a'), many=<50 items>, level=0.333333, nested=<Example>"
    assert shown == f"Example({few})"
