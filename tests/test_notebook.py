"""What a notebook shows of campaigns, fits, posteriors and diagnoses, and their summaries."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

import bayesimpact as bi
from bayesimpact.data.html import html_table, resolved
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.loop import Diagnosis


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


def test_a_number_has_two_digits_of_its_uncertainty() -> None:
    assert resolved(0.14800996, 1.1e-5) == "0.14801"
    assert resolved(5350.38, 0.28) == "5350.38"
    assert resolved(5350.38, 280.0) == "5350"
    assert resolved(0.0, 1.0) == "0" and resolved(float("nan"), 1.0) == "nan"


def test_a_figure_shows_itself(found: Diagnosis) -> None:
    """Without pyplot, that is; see `report.figures.inline`."""
    figure = bi.plot(found.before.target.oscillator.campaign)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_a_campaign_lists_its_recordings(found: Diagnosis) -> None:
    campaign = found.before.target.oscillator.campaign
    shown = cells(campaign._repr_html_())
    assert [r.name for r in campaign.recordings] == shown[::6]
    assert shown[2] == str(campaign.recordings[0].samples.size) and shown[3] == "1000"


def test_a_fit_shows_what_recordings_share(found: Diagnosis) -> None:
    shown = cells(found.identification._repr_html_())
    assert shown[::4] == ["c1", "k1", "c2", "g", "k2[1]", "k2[2]"]
    assert float(shown[5]) == pytest.approx(found.before.value("k1"), rel=1e-3)


def test_a_diagnosis_shows_effects_and_extended_parameters(found: Diagnosis) -> None:
    html = found._repr_html_()
    shown = cells(html)
    assert found.verdict == "named" and "named: coulomb_friction" in html
    assert shown[0] == BY_ID["coulomb_friction"].title and shown[1].startswith("probability")
    assert "coulomb_friction.force" in shown


def test_the_summary_of_a_diagnosis_is_that_of_the_extended_model(found: Diagnosis) -> None:
    table = bi.summary(found)
    row = table.loc["coulomb_friction.force"]
    scale = {"N": 1.0, "mN": 1e3}[row.unit]
    low, median, high = found.intervals.quantiles("coulomb_friction.force")
    assert row.estimate == pytest.approx(scale * median)
    assert (row.low, row.high) == pytest.approx((scale * low, scale * high))
    assert row.low < scale * 0.01 < row.high


def test_a_posterior_shows_medians(found: Diagnosis) -> None:
    posterior = bi.sample(found, seed=1, target_ess=200.0)
    shown = cells(posterior._repr_html_())
    assert shown[0] == "c1"
    assert float(shown[1]) == pytest.approx(np.median(posterior.column("c1")), rel=1e-3)
