"""Commands on a small campaign: what they write and how they end."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coarse_figures import draw_coarsely
from small_rig import RELEASES, RIG, record

from bayesimpact.cli import main
from bayesimpact.data.read import load_campaign
from bayesimpact.model.effects import EFFECTS, UNTRIED
from bayesimpact.model.experiment import simulate
from bayesimpact.model.own_effects import load_effects
from bayesimpact.trial.rig.files import write_campaign

Run = Callable[..., tuple[int, str, str]]
EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "own_effect.py"
REAL = Path(
    os.environ.get(
        "BAYESIMPACT_RECORDINGS", Path(__file__).resolve().parents[2] / "shared" / "recordings"
    )
)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign")
    write_campaign(folder, record(seed=3, duration=1.0))
    return folder


@pytest.fixture(scope="module")
def sampled(campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sampled")
    with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as ended:
        draw_coarsely(patch)
        main(["sample", str(campaign), "--out", str(out), "--quiet"])
    assert ended.value.code in (0, None)
    return out


@pytest.mark.usefixtures("coarse_figures")
def test_fit_writes_the_mode_near_the_truth(run: Run, campaign: Path, tmp_path: Path) -> None:
    code, out, _ = run("fit", campaign, "--out", tmp_path)
    assert code == 0
    assert (tmp_path / "report.html").exists() and "report.html" in out
    rows = json.loads((tmp_path / "fit.json").read_text())["parameters"]
    for name, true in {"k1": RIG.k1, "g": RIG.g, "k2[1]": RIG.k2["1"]}.items():
        assert abs(rows[name]["mode"] - true) < 4.5 * rows[name]["sd"]


def test_sample_leaves_what_the_contract_names(sampled: Path) -> None:
    names = {p.name for p in sampled.iterdir()}
    assert {"posterior.nc", "report.html", "figures", "fit.json"} <= names


@pytest.mark.long
@pytest.mark.usefixtures("coarse_figures")
def test_resume_gives_the_same_posterior(run: Run, campaign: Path, sampled: Path) -> None:
    before = (sampled / "fit.json").read_text()
    code, _, _ = run("sample", campaign, "--out", sampled, "--resume", "--quiet")
    assert code == 0

    def medians(text: str) -> dict[str, float]:
        return {name: row["median"] for name, row in json.loads(text)["parameters"].items()}

    assert medians((sampled / "fit.json").read_text()) == medians(before)


@pytest.mark.usefixtures("coarse_figures")
def test_report_is_written_again_from_the_files(run: Run, sampled: Path) -> None:
    page = sampled / "report.html"
    page.unlink()
    code, _, _ = run("report", sampled)
    assert code == 0 and page.stat().st_size > 10_000


def test_report_of_an_empty_folder_is_refused(run: Run, tmp_path: Path) -> None:
    code, out, err = run("report", tmp_path)
    assert (code, out) == (2, "") and str(tmp_path) in err and list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("coarse_figures")
def test_diagnose_finds_nothing_where_nothing_is(run: Run, campaign: Path, tmp_path: Path) -> None:
    code, out, _ = run("diagnose", campaign, "--out", tmp_path, "--quick")
    content = json.loads((tmp_path / "diagnosis.json").read_text())
    assert code == 0 and content["schema"] == "bayesimpact/diagnosis/2"
    assert content["verdict"] == "adequate" and content["effects"] == []
    assert content["location"] is None and out.startswith("adequate")
    assert {row["id"] for row in content["limits"]} >= {"coulomb_friction", "spring_cubic"}


def test_effects_lists_the_whole_catalogue(run: Run) -> None:
    code, out, _ = run("effects")
    assert code == 0
    assert all(f"\n{e.id}\n" in f"\n{out}" for e in EFFECTS)
    assert out.count("not looked for") == len(UNTRIED)
    assert run("effects", "--quiet") == (0, "", "")  # as its help says: warnings and errors only


def test_effects_of_ones_own_are_checked(run: Run, tmp_path: Path) -> None:
    code, out, _ = run("effects", "--check", EXAMPLE)
    assert code == 0 and out.count("magnetic_detent") == out.count("passed") == 6
    wrong = tmp_path / "wrong.py"
    wrong.write_text(EXAMPLE.read_text().replace('"conserves"', '"dissipates"'))
    code, out, _ = run("effects", "--quiet", "--check", wrong)
    assert code == 2 and len(out.splitlines()) == 1 and "sign of the energy" in out


def test_a_faulty_effect_is_refused_before_any_work(
    run: Run, campaign: Path, tmp_path: Path
) -> None:
    wrong = tmp_path / "wrong.py"
    wrong.write_text(EXAMPLE.read_text().replace('regime="free"', 'regime="sky"'))
    for command in (
        ("effects", "--check"),
        ("diagnose", campaign, "--out", tmp_path / "out", "--effects"),
    ):
        code, out, err = run(*command, wrong)
        assert code == 2 and out == "" and len(err.splitlines()) == 1
        assert "wrong.py, line" in err and "found 'sky'; accepted: free, contact" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.long
@pytest.mark.usefixtures("coarse_figures")
def test_an_effect_of_ones_own_is_named(run: Run, campaign: Path, tmp_path: Path) -> None:
    """A magnet that the catalogue does not know, played by the simulator with noise on top."""
    (magnet,) = load_effects(EXAMPLE)
    rng, kept = np.random.default_rng(5), load_campaign(campaign)
    made = []
    for old, release in zip(kept.recordings, RELEASES, strict=True):
        rig: dict[str, float] = {
            name: getattr(RIG, name) for name in ("mass", "c1", "k1", "c2", "g")
        }
        start = {"k2": RIG.k2[release.case], "y0": release.y0, "v0": release.v0}
        clean = simulate(
            effects=[(magnet, {"stiffness": 3.0, "width": 1.6e-3})],
            interval=old.interval, n=old.samples.size, **rig, **start,
        )  # fmt: skip
        noise = 2e-6 * rng.standard_normal(old.samples.size)
        made.append(replace(old, samples=clean.samples + noise))
    write_campaign(tmp_path, replace(kept, recordings=tuple(made)))
    options = ("--quick", "--quiet", "--effects", EXAMPLE)
    code, _, _ = run("diagnose", tmp_path, "--out", tmp_path / "out", *options)
    content = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert code == 0 and content["verdict"] == "named"
    (found,) = content["effects"]
    assert found["id"] == "magnetic_detent" and "A magnet" in found["statement"]
    low, high = found["parameters"]["magnetic_detent.stiffness"]["ci90"]
    assert low < 3.0 < high or abs(0.5 * (low + high) - 3.0) < 2 * (high - low)
    assert "magnetic detent" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.usefixtures("coarse_figures")
@pytest.mark.parametrize("name", ["pendulum", "ship_roll"])
def test_a_linear_oscillator_is_told_not_to_fit(run: Run, name: str, tmp_path: Path) -> None:
    if not (REAL / name).exists():
        pytest.skip("the real recordings are not here")
    code, out, _ = run("fit", REAL / name, "--out", tmp_path)
    assert code in (0, 3)
    assert "does not" in out and "times" in out
