"""`bayesimpact next DIR` on diagnoses of a small campaign."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_rig import record

import bayesimpact as bi
from bayesimpact.data.campaign import Campaign
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.inference.identify import Identification
from bayesimpact.model.effects import EFFECTS
from bayesimpact.report.archive import load_results, save_results
from bayesimpact.report.figures.save import SavedFigures

Run = Callable[..., tuple[int, str, str]]
FEW = tuple(e for e in EFFECTS if e.id in ("spring_cubic", "spring_quintic", "quadratic_drag"))


def contents(folder: Path) -> dict[Path, bytes]:
    """Files of a folder, but for the one that holds it while a command runs."""
    files = [p for p in folder.rglob("*") if p.is_file() and not p.name.startswith(".")]
    return {p: p.read_bytes() for p in files}


def short(campaign: Campaign) -> Campaign:
    """Half of every recording: laws that differ at large displacements are told apart no more."""
    return campaign.truncated(1.0)


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without their figures, which take ten times as long as all the rest."""
    monkeypatch.setattr("bayesimpact.report.write.save_all", lambda *_: SavedFigures())


@pytest.fixture(scope="module")
def ambiguous(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("ambiguous")
    campaign = short(record(7, {"spring_cubic": {"stiffness": 4e4}}))
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=FEW, search=False)
    assert found.verdict == "ambiguous"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bayesimpact.report.write.save_all", lambda *_: SavedFigures())
        bi.save(found, out)
    return out


@pytest.mark.usefixtures("coarse_figures")
def test_it_ranks_writes_and_tells(run: Run, ambiguous: Path) -> None:
    old = json.loads((ambiguous / "diagnosis.json").read_text())
    code, out, _ = run("next", ambiguous)
    assert code == 0
    content = json.loads((ambiguous / "next.json").read_text())
    assert content["schema"] == "bayesimpact/next/1" and content["verdict"] == "ambiguous"
    first, again = content["designs"][0], next(d for d in content["designs"] if d["repeats"])
    assert first["chance_to_settle"] >= again["chance_to_settle"]
    named = " + ".join(e["id"] for e in old["effects"])
    ids = [" + ".join(r["effects"]) or "none" for r in content["rivals"]]
    assert ids[0] == named and set(ids[1:]) <= {a["id"] for a in old["alternatives"]}
    assert sum(r["probability"] for r in content["rivals"]) == pytest.approx(1.0)
    assert content["sentence"] in out
    told = json.loads((ambiguous / "diagnosis.json").read_text())
    assert told["summary"] == f"{old['summary']} {content['sentence']}"
    assert set(told) == set(old)
    page = (ambiguous / "report.html").read_text()
    assert "Which recording next" in page and (ambiguous / "figures" / "designs.png").exists()


@pytest.mark.usefixtures("undrawn")
def test_again_it_says_the_same_once(run: Run, ambiguous: Path) -> None:
    run("next", ambiguous, "--quiet")
    before = (ambiguous / "next.json").read_text()
    code, out, err = run("next", ambiguous, "--quiet")
    assert (code, out, err) == (0, "", "")
    assert (ambiguous / "next.json").read_text() == before
    sentence = json.loads(before)["sentence"]
    assert json.loads((ambiguous / "diagnosis.json").read_text())["summary"].count(sentence) == 1


@pytest.mark.usefixtures("undrawn")
def test_a_folder_without_a_diagnosis_is_refused(
    run: Run, small: Identification, ambiguous: Path, tmp_path: Path
) -> None:
    bi.save(small, tmp_path / "fit")
    results = load_results(ambiguous)
    assert results.diagnosis is not None
    without = {k: v for k, v in results.diagnosis.items() if k != "hypotheses"}
    (tmp_path / "old").mkdir()
    save_results(replace(results, diagnosis=without), tmp_path / "old")
    for name, words in (("", "no results"), ("fit", "without a diagnosis"), ("old", "its models")):
        folder = tmp_path / name
        before = contents(folder)
        code, out, err = run("next", folder)
        assert (code, out) == (2, "") and err.count("\n") == 1 and words in err
        assert contents(folder) == before
