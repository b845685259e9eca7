"""Reports of several channels of one motion: one state, rest readings each in its own unit."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from channel_rigs import channels
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.report.archive import load_results
from bayesimpact.report.tables import release_columns, release_views
from bayesimpact.workflow import diagnose_campaign, fit_campaign

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("coarse_figures", "catalogue_alone")]


def number(text: str) -> float:
    return float(text.partition(" ")[0].replace("\N{MINUS SIGN}", "-"))


def test_a_report_shows_the_state_that_channels_share(tmp_path: Path) -> None:
    made = fit_campaign(channels(0), tmp_path)
    assert made.converged and not made.failed
    results = load_results(tmp_path)
    assert [r.state for r in results.recordings] == ["", "", "", "a", "b", "c"]
    rows = {row["name"]: row for row in release_views(results)}
    assert len(rows) == 6
    known = json.loads((tmp_path / "fit.json").read_text())["parameters"]
    assert release_columns(results)["y0"][1] == "mm" and release_columns(results)["offset"][1] == ""
    for name in "abc":
        assert rows[f"{name}_acc"]["y0"] == rows[name]["y0"]
        assert number(rows[name]["y0"]) == pytest.approx(
            1e3 * known[f"y0[{name}]"]["mode"], abs=0.01
        )
        probe, second = rows[name]["offset"], rows[f"{name}_acc"]["offset"]
        assert re.search(r" [mµ]m$", probe) and second.endswith("mm/s²")
        offset = known[f"offset[{name}_acc]"]["mode"]  # m/s2
        assert number(second) == pytest.approx(1e3 * offset, abs=0.06)


def test_a_report_shows_a_gain_where_it_is_free(tmp_path: Path) -> None:
    campaign = channels(0)
    freed = tuple(replace(r, free_gain=r.name == "b_acc") for r in campaign.recordings)
    made = fit_campaign(replace(campaign, recordings=freed), tmp_path)
    assert made.converged and not made.failed
    gains = {row["name"]: row["gain"] for row in release_views(load_results(tmp_path))}
    assert number(gains.pop("b_acc")) == pytest.approx(1.0, abs=5e-4)
    assert set(gains.values()) == {"1, known"}
    page = (tmp_path / "report.html").read_text()
    assert "gain of the probe" in page


def test_what_both_channels_feel_is_named(tmp_path: Path) -> None:
    campaign: Campaign = channels(1, {"spring_cubic": {"stiffness": 3e6}})
    read = tuple(  # accelerometers read too much, and say that they may
        replace(r, samples=1.03 * r.samples, free_gain=True) if r.order else r
        for r in campaign.recordings
    )
    campaign = replace(campaign, recordings=read)
    names = ("spring_cubic", "quadratic_drag", "contact_hardening", "sensor_cubic", "sensor_drift")
    effects = tuple(BY_ID[name] for name in names)
    made = diagnose_campaign(campaign, tmp_path, quick=True, effects=effects)
    assert made.diagnosis is not None and not made.failed
    assert made.diagnosis["verdict"] == "named"
    (effect,) = made.diagnosis["effects"]
    assert effect["id"] == "spring_cubic"
    low, high = effect["parameters"]["spring_cubic.stiffness"]["ci90"]
    assert low - (high - low) < 3e6 < high + (high - low)
