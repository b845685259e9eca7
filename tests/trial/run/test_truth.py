"""The truth of the bundled concealed campaign: shut while it is diagnosed, opened by the demo."""

from __future__ import annotations

import ast
import json
import shutil
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import bayesimpact
from bayesimpact import workflow
from bayesimpact.cli import main
from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError
from bayesimpact.trial.bundle import CONCEALED_EFFECTS, PAPER_RIG, concealed_truth
from bayesimpact.trial.bundle import main as make_bundle
from bayesimpact.trial.rig.files import TRUTH_FILE
from bayesimpact.trial.run.truth import compared, open_truth

pytestmark = pytest.mark.long

PACKAGE = Path(bayesimpact.__file__).parent
SECONDS = 1.2
_opened: list[str] | None = None


@pytest.fixture(scope="module")
def concealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two of the bundled recordings, their first seconds, without the truth."""
    folder = tmp_path_factory.mktemp("concealed")
    keep = ("case1_a", "case1_b")
    for name in keep:
        shutil.copy(bundled_campaign("concealed") / f"{name}.csv", folder)
    entries = [f'[[recording]]\nfile = "{n}.csv"\ncase = "1"\nend_s = {SECONDS}\n' for n in keep]
    text = 'name = "part"\nmass_kg = 0.503\n' + "".join(entries)
    (folder / "campaign.toml").write_text(text)
    return folder


@pytest.fixture
def opened() -> Iterator[list[str]]:
    """Paths that are opened meanwhile, in this process, in order."""
    global _opened
    if not hasattr(sys, "_bayesimpact_audited"):
        sys.addaudithook(_listen)
        sys._bayesimpact_audited = True  # type: ignore[attr-defined]
    _opened = []
    yield _opened
    _opened = None


def _listen(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and _opened is not None:
        _opened.append(str(arguments[0]))


def diagnosed(folder: Path, out: Path) -> dict[str, Any]:
    """diagnosis.json of a quick diagnosis, without what differs between any two runs."""
    workflow.diagnose_campaign(load_campaign(folder), out, quick=True)
    content: dict[str, Any] = json.loads((out / workflow.DIAGNOSIS_FILE).read_text())
    del content["seconds"]
    return content


@pytest.mark.usefixtures("coarse_figures")
def test_a_diagnosis_is_the_same_with_the_truth_absent_or_poisoned(
    concealed: Path, tmp_path: Path, opened: list[str]
) -> None:
    absent = diagnosed(concealed, tmp_path / "absent")
    poisoned = shutil.copytree(concealed, tmp_path / "with truth")
    poison = {"effects": ["coulomb_friction"], "parameters": {"k2[1]": 1.0}}
    (poisoned / TRUTH_FILE).write_text(json.dumps(poison))
    opened.clear()
    assert diagnosed(poisoned, tmp_path / "poisoned") == absent
    assert any(name.endswith("case1_a.csv") for name in opened)  # the ear is open
    assert not any(name.endswith(TRUTH_FILE) for name in opened)


def test_one_place_knows_the_files_name() -> None:
    holders = {
        str(file.relative_to(PACKAGE))
        for file in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and "truth.json" in str(node.value)
    }
    assert holders == {"trial/rig/files.py"}


def test_only_the_demo_opens_it_and_the_bundle_writes_it() -> None:
    users: dict[str, set[str]] = {}
    named = set()
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and "TRUTH_FILE" in [a.name for a in node.names]:
                named.add(str(file.relative_to(PACKAGE)))
            if isinstance(node, ast.ImportFrom) and node.module == "bayesimpact.trial.run.truth":
                names = users.setdefault(str(file.relative_to(PACKAGE)), set())
                names |= {alias.name for alias in node.names}
    assert named == {"trial/bundle.py", "trial/run/truth.py"}
    assert users == {"cli.py": {"compared", "open_truth"}}
    syntax = ast.parse((PACKAGE / "cli.py").read_text(encoding="utf-8"))
    callers = [
        function.name
        for function in ast.walk(syntax)
        if isinstance(function, ast.FunctionDef)
        and any(isinstance(n, ast.Name) and n.id == "open_truth" for n in ast.walk(function))
    ]
    assert callers == ["demo"]


@pytest.fixture
def run_demo(
    concealed: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Callable[..., int]:
    """The demo on small campaigns, its first part left out, its second one quick."""
    hiding = shutil.copytree(concealed, tmp_path / "hiding")
    (hiding / TRUTH_FILE).write_text(json.dumps(concealed_truth()))
    folders = {"paper": concealed, "concealed": hiding}
    monkeypatch.setattr("bayesimpact.data.bundled.bundled_campaign", folders.__getitem__)
    results = SimpleNamespace(headline="It fits.", verdict="adequate")
    first = SimpleNamespace(results=results, converged=True, diagnosis=None, failed=())
    monkeypatch.setattr(workflow, "sample_campaign", lambda *a, **k: first)
    quick = partial(workflow.diagnose_campaign, quick=True)
    monkeypatch.setattr(workflow, "diagnose_campaign", quick)

    def run(*arguments: object) -> int:
        with pytest.raises(SystemExit) as ended:
            main(["demo", "--out", str(tmp_path / "out"), *map(str, arguments)])
        return int(ended.value.code or 0)

    return run


@pytest.mark.usefixtures("coarse_figures")
def test_the_demo_opens_the_truth_last(
    run_demo: Callable[..., int],
    tmp_path: Path,
    opened: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run_demo() == 0
    names = [Path(name).name for name in opened]
    assert names.count(TRUTH_FILE) == 1
    assert names.index(TRUTH_FILE) > max(i for i, n in enumerate(names) if "report.html" in n)
    told = capsys.readouterr().out
    answer, _, truth = told.partition("What was hidden, opened now:")
    assert "It fits." in answer and str(tmp_path / "out" / "concealed" / "report.html") in answer
    assert "contact_damping_speed + gap_wear" in truth and "hidden" not in answer
    assert "5350.156 N/m" in truth
    assert (tmp_path / "out" / "concealed" / "diagnosis.json").is_file()


@pytest.mark.usefixtures("coarse_figures")
def test_a_quiet_demo_does_not_open_it(
    run_demo: Callable[..., int], opened: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    second = SimpleNamespace(converged=False, diagnosis={}, failed=())
    monkeypatch.setattr(workflow, "diagnose_campaign", lambda *a, **k: second)
    assert run_demo("--quiet") == 3  # the second part did not converge
    assert not any(name.endswith(TRUTH_FILE) for name in opened)


def test_the_bundled_truth_is_the_rigs() -> None:
    truth = open_truth(bundled_campaign("concealed"))
    assert truth == concealed_truth()
    assert truth["effects"] == list(CONCEALED_EFFECTS)
    assert truth["parameters"]["k2[1]"] == PAPER_RIG.k2["1"]


def test_concealed_folder_is_made_again_bit_for_bit(tmp_path: Path) -> None:
    make_bundle(["concealed", "--out", str(tmp_path)])
    made, stored = (
        {file.name: file.read_bytes() for file in folder.iterdir()}
        for folder in (tmp_path, bundled_campaign("concealed"))
    )
    assert made == stored


@pytest.mark.parametrize("text", [None, "{not json", '{"effects": []}', "[]"])
def test_a_bad_truth_is_refused(text: str | None, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / TRUTH_FILE).write_text(text)
    with pytest.raises(InputError, match=TRUTH_FILE):
        open_truth(tmp_path)


def test_comparison_is_in_standard_deviations() -> None:
    def side(median: float) -> dict[str, Any]:
        half = 1.6448536 * 0.5
        return {"k2[1]": {"unit": "N/m", "median": median, "ci90": [median - half, median + half]}}

    narrow = {"g": {"unit": "m", "median": 1.10183e-3, "ci90": [1.10177e-3, 1.10189e-3]}}
    wide = {"g": {"unit": "m", "median": 1.0999e-3, "ci90": [1.0994e-3, 1.1004e-3]}}
    wear = {"gap_wear.step": {"unit": "m", "median": 9e-8, "ci90": [8e-8, 1e-7]}}
    diagnosis = {
        "verdict": "named",
        "effects": [{"id": "gap_wear"}],
        "parameters": {"before": side(5360.0) | narrow, "after": side(5350.5) | wide | wear},
        "fit": {"before": {"rms_m": 5.1e-6}},
        "noise": {"sigma_m": 5e-6},
    }
    truth = {
        "effects": ["gap_wear"],
        "parameters": {"k2[1]": 5350.0, "g": 1.1e-3, "gap_wear.step": 8e-8},
    }
    lines = compared(diagnosis, truth)
    assert lines[:3] == [
        "base fit: what it leaves is 1.020 times the noise", "hidden: gap_wear",
        "answer: gap_wear (named)",
    ]  # fmt: skip
    (stiffness,) = (line for line in lines if line.startswith("k2[1]"))
    assert stiffness.split("  ")[0] == "k2[1]"
    for cell in ("5360.0 ± 0.8", "+20.0", "5350.5 ± 0.8", "+1.0", "5350 N/m"):
        assert cell in stiffness, cell
    (gap,) = (line for line in lines if line.startswith("g "))
    # as many digits as the report has, which the wider of the two intervals allows
    assert "1.1018 ± 0.0001" in gap and "1.0999 ± 0.0005" in gap, gap
    (step,) = (line for line in lines if line.startswith("gap_wear.step"))
    assert "0.090 ± 0.010" in step and "+1.6" in step and "0.08 µm" in step
