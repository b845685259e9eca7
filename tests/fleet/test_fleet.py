"""Whole fleets of small campaigns: table, resumption, failures, cluster, page."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_rig
from click.testing import CliRunner
from coarse_figures import draw_coarsely

from bayesimpact.cli import main
from bayesimpact.fleet import run
from bayesimpact.fleet.compare import compare
from bayesimpact.fleet.plan import Plan, Session, load_plan
from bayesimpact.fleet.table import columns
from bayesimpact.fleet.write import fleet_results

pytestmark = pytest.mark.long

SESSIONS = 7
GROWTH = 1e-5  # m, of the gap from session to session


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven small campaigns, one of which cannot be read."""
    root = tmp_path_factory.mktemp("fleet")
    lines = ['name = "seven weeks"', 'command = "fit"']
    for week in range(SESSIONS):
        rig = replace(small_rig.RIG, g=small_rig.RIG.g + GROWTH * week)
        campaign = small_rig.record(week, rig=rig, releases=small_rig.RELEASES[:2], duration=1.0)
        campaign.save(root / f"week{week}")
        lines += [
            "[[campaign]]", f'folder = "week{week}"', f"date = 2026-05-{1 + 3 * week:02d}",
            f"temperature_c = {20 + week % 3}",
        ]  # fmt: skip
    lines += ["[[campaign]]", 'folder = "lost"', "date = 2026-06-30"]
    (root / "fleet.toml").write_text("\n".join(lines) + "\n")
    return root


@pytest.fixture(scope="module")
def done(folder: Path) -> Path:
    out = folder / "out"
    with pytest.MonkeyPatch.context() as patch:
        draw_coarsely(patch)
        result = CliRunner().invoke(main, ["fleet", str(folder / "fleet.toml"), "--out", str(out)])
    assert result.exit_code == 3, result.output  # one campaign is lost
    assert "lost" in result.output
    return out


def test_the_table_has_a_line_per_campaign(done: Path) -> None:
    with (done / "fleet.csv").open() as stream:
        lines = list(csv.DictReader(stream))
    assert [line["name"] for line in lines] == [*(f"week{w}" for w in range(SESSIONS)), "lost"]
    assert lines[0]["condition.temperature_c"] == "20.0" and lines[-1]["k1"] == ""
    for line in lines[:-1]:
        low, middle, high = (float(line[k]) for k in ("k1_low", "k1", "k1_high"))
        assert low < middle < high
        assert abs(middle - small_rig.RIG.k1) < 5 * (high - low)
    assert "no such file" in lines[-1]["failed"]
    pandas = pytest.importorskip("pandas")
    table = pandas.read_parquet(done / "fleet.parquet")
    assert list(table["k1"][:SESSIONS]) == [float(line["k1"]) for line in lines[:-1]]


def test_a_gap_that_grows_is_told(done: Path) -> None:
    content = json.loads((done / "fleet.json").read_text())
    gap = [t for t in content["trends"] if t["parameter"] == "g" and t["along"] == "date"]
    assert [t["kind"] for t in gap] == ["drift"]
    assert gap[0]["amount"] == pytest.approx(GROWTH / 3, rel=0.2)  # three days a session
    page = (done / "report.html").read_text()
    assert "Not all is constant: g drifts with date." in page
    assert 'href="campaigns/week0/report.html"' in page
    assert (done / "campaigns" / "week0" / "report.html").exists()


@pytest.mark.usefixtures("coarse_figures")
def test_what_is_done_is_not_done_again(
    folder: Path, done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a kill: one row lost, one damaged, one of other work; the table is the same."""
    out = tmp_path / "again"
    shutil.copytree(done, out)
    (out / "rows" / "week1.json").unlink()
    (out / "rows" / "week2.json").write_text('{"identity": ')
    other = json.loads((out / "rows" / "week3.json").read_text())
    other["identity"]["seed"] = 7
    (out / "rows" / "week3.json").write_text(json.dumps(other))
    repeated = []

    original = run.campaign_job
    monkeypatch.setattr(
        run, "campaign_job", lambda c, w: (repeated.append(c.folder.name), original(c, w))[1]
    )
    fleet_results(load_plan(folder / "fleet.toml"), out)
    assert repeated == ["week1", "week2", "week3"]
    assert (out / "fleet.csv").read_bytes() == (done / "fleet.csv").read_bytes()
    assert (out / "fleet.json").read_bytes() == (done / "fleet.json").read_bytes()


def test_a_campaign_that_fails_stops_no_other(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = load_plan(folder / "fleet.toml")
    plan = replace(plan, sessions=plan.sessions[:2])

    def outcome(campaign: object, work: run.Work, out: Path) -> object:
        raise ZeroDivisionError("by chance")

    monkeypatch.setattr(run, "_outcome", outcome)
    found = fleet_results(plan, tmp_path)
    assert found.failed == dict.fromkeys(("week0", "week1"), "ZeroDivisionError: by chance")
    assert not list((tmp_path / "rows").iterdir())  # tried again next time


def test_a_cluster_whose_scheduler_is_another_process(
    folder: Path, done: Path, tmp_path: Path
) -> None:
    """By its address; its worker shares nothing with this process but the package. The rows are the
    same but for rounding: linear algebra on several threads adds in another order.
    """
    told = tmp_path / "scheduler.json"
    dask = [sys.executable, "-P", "-m", "distributed.cli.dask_scheduler"]
    worker = [sys.executable, "-P", "-m", "distributed.cli.dask_worker", "--no-dashboard"]
    started = [
        subprocess.Popen(
            [*command, "--scheduler-file", str(told)], cwd=tmp_path, stderr=subprocess.PIPE
        )
        for command in ([*dask, "--port", "0", "--no-dashboard"], worker)
    ]
    try:
        while not (told.exists() and told.stat().st_size) and started[0].poll() is None:
            time.sleep(0.1)
        address = json.loads(told.read_text())["address"]
        plan = load_plan(folder / "fleet.toml")
        first = replace(plan, sessions=plan.sessions[:1])
        (row,) = run.run_fleet(first, tmp_path, scheduler=address)
    finally:
        for process in reversed(started):
            process.terminate()
            process.communicate()
    other = json.loads((done / "rows" / "week0.json").read_text())["row"]
    assert {**row, "parameters": None} == {**other, "parameters": None}
    assert row["parameters"].keys() == other["parameters"].keys()
    for name, entry in row["parameters"].items():
        width = entry["high"] - entry["low"]
        for key in ("estimate", "low", "high"):
            assert entry[key] == pytest.approx(other["parameters"][name][key], abs=1e-2 * width)


def test_campaigns_with_other_physics_are_told_apart() -> None:
    sessions = tuple(Session(f"s{i}", Path(f"s{i}")) for i in range(5))
    plan = Plan("made up", "diagnose", True, sessions)
    rows = [
        {
            "converged": True,
            "verdict": "named",
            "effects": ["gap_wear"] if i == 3 else ["coulomb_friction"],
            "parameters": {"k1": {"unit": "N/m", "estimate": 1.0 + i, "low": i, "high": 2.0 + i}},
        }
        for i in range(5)
    ]
    rows[4] = {"failed": "lost"}
    found = compare(plan, rows, rng=np.random.default_rng(0))
    assert found.unlike == ("s3",) and found.usual == ("coulomb_friction",)
    table = columns(plan, rows)
    assert table["effects"] == [*["coulomb_friction"] * 3, "gap_wear", None]
    assert table["k1_low"] == [0, 1, 2, 3, None]


def test_bad_input_writes_nothing(tmp_path: Path) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text("name = 3\n")
    result = CliRunner().invoke(main, ["fleet", str(file), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2 and "key name" in result.output
    assert not (tmp_path / "out").exists()
