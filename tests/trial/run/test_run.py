"""The run of trials: seals, resumption, failures, clusters; draws and diagnoses are stand-ins."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Mapping
from pathlib import Path

import pytest
from click.testing import CliRunner

from bayesimpact.cli import main
from bayesimpact.cluster import executor
from bayesimpact.data.files import UNFINISHED
from bayesimpact.data.lock import locked
from bayesimpact.data.strict_json import strict
from bayesimpact.errors import InputError
from bayesimpact.trial.draw.settings import Settings, settings_from
from bayesimpact.trial.run import trials as run
from bayesimpact.trial.run.blind import open_seal, seal, sealed_text
from bayesimpact.trial.run.trials import answer_job, run_trials
from bayesimpact.trial.score.summary import summarise
from bayesimpact.trial.score.table import summary_text

pytestmark = pytest.mark.long

CONTROLS = Settings(kinds=("control",), rig_kinds=("small",), noises=("white",))
SEEDS = range(3, 6)


def quick_draw(settings: Settings, seed: int) -> dict:
    """A truth without anything planted, and a campaign of two files."""
    truth = {"seed": seed, "kind": "control", "rig_kind": "small", "noise_kind": "white"}
    truth |= {"planted": [], "parameters": {}, "noise_rms_m": 1.0}
    files = {"campaign.toml": f"name = '{seed}'\n", "a.csv": "time_s,displacement_m\n"}
    return {"truth": sealed_text(truth), "files": files}


def quiet_answer(files: Mapping[str, str], search: bool, report: bool = False) -> dict:
    """What a diagnosis that finds nothing would say; it is shown a campaign and no truth."""
    assert set(files) == {"campaign.toml", "a.csv"} and not search
    nothing = {"value": None, "se": None}
    return {
        "answer": {
            "verdict": "adequate",
            "effects": [],
            "alternatives": [],
            "location": None,
            "fit": {"before": {"rms_m": 1.0}, "held_out_gain": nothing},
            "parameters": {"before": {}, "after": {}},
            "seconds": 0.0,
        }
    }


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> Settings:
    monkeypatch.setattr(run, "draw_job", quick_draw)
    monkeypatch.setattr(run, "answer_job", quiet_answer)
    return Settings(kinds=("control",), rig_kinds=("small",), noises=("white",), search=False)


def tree(folder: Path) -> dict[str, str]:
    return {
        str(f.relative_to(folder)): f.read_text() for f in sorted(folder.rglob("*")) if f.is_file()
    }


def test_truths_are_sealed_before_the_first_diagnosis(
    quick: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []

    def answer(files: Mapping[str, str], search: bool, report: bool) -> dict:
        order.append("diagnosed")
        return quiet_answer(files, search)

    monkeypatch.setattr(run, "answer_job", answer)
    results = run_trials(quick, SEEDS, tmp_path, sealed=order.append)
    assert order[1:] == ["diagnosed"] * 3
    text = (tmp_path / "seals.txt").read_text()
    assert hashlib.sha256(text.encode()).hexdigest() == order[0]
    for line in text.splitlines():  # as `sha256sum -c seals.txt` would check them
        digest, name = line.split("  ")
        assert hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() == digest
    assert [r["seed"] for r in results] == list(SEEDS)
    assert all(r["score"]["outcome"] == "quiet" and r["seal"] in text for r in results)
    assert not list((tmp_path / "campaigns").iterdir())


def test_a_killed_run_goes_on(
    quick: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    run_trials(quick, SEEDS, whole)
    shown = []

    def interrupted(files: Mapping[str, str], search: bool, report: bool) -> dict:
        shown.append(files["campaign.toml"])
        if len(shown) == 2:
            raise KeyboardInterrupt
        return quiet_answer(files, search)

    monkeypatch.setattr(run, "answer_job", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_trials(quick, SEEDS, killed)
    finished = (killed / "trials" / "3.json").stat().st_mtime_ns
    assert not (killed / "trials" / "4.json").exists()
    (killed / "trials" / f"{UNFINISHED}4.json").write_text("half a fi")
    drawn: list[int] = []
    monkeypatch.setattr(run, "draw_job", lambda s, seed: drawn.append(seed) or quick_draw(s, seed))
    steps: list[tuple[str, int]] = []
    run_trials(quick, SEEDS, killed, step=lambda *step: steps.append(step))
    assert drawn == [] and len(shown) == 4
    assert steps == [("drawing", 3), ("diagnosing", 1), ("diagnosing", 1), ("diagnosing", 1)]
    assert (killed / "trials" / "3.json").stat().st_mtime_ns == finished
    assert {k: v for k, v in tree(killed).items() if UNFINISHED not in k} == tree(whole)


@pytest.mark.parametrize("victim", ["_log", "_finish"])
def test_a_kill_while_a_trial_is_put_away(
    victim: str, quick: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between its result and its line in the log, or between its campaign and its result."""
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    run_trials(quick, SEEDS, whole)

    def dies(store: run.Store, *told: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(run.Store, victim, dies)
        run_trials(quick, SEEDS, killed)
    run_trials(quick, SEEDS, killed)
    assert tree(killed) == tree(whole) and not list((killed / "campaigns").iterdir())


def test_what_goes_wrong_in_one_trial_is_recorded(
    quick: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def drawn(settings: Settings, seed: int) -> dict:
        return {"failed": "Traceback: no rig"} if seed == 3 else quick_draw(settings, seed)

    monkeypatch.setattr(run, "draw_job", drawn)
    answers = iter([{"failed": "Traceback: no mode"}, {"answer": {}}])
    monkeypatch.setattr(run, "answer_job", lambda files, *how: next(answers))
    results = run_trials(quick, SEEDS, tmp_path)
    assert [r["stage"] for r in results] == ["drawing", "diagnosing", "scoring"]
    assert "KeyError" in results[2]["failed"] and not any("score" in r for r in results)


def test_jobs_catch_their_own_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: object, **named: object) -> None:
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(run, "draw", broken)
    monkeypatch.setattr(run, "answer", broken)
    for found in (run.draw_job(CONTROLS, 1), run.answer_job({}, False, True)):
        assert "ZeroDivisionError: on purpose" in found["failed"] and "Traceback" in found["failed"]


def test_a_diagnosis_is_timed_by_the_processor(
    quick: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever else the machine does: sleeping costs nothing, computing does."""

    def busy(files: Mapping[str, str], search: bool, report: bool) -> dict:
        time.sleep(0.3)
        end = time.process_time() + 0.2
        while time.process_time() < end:
            pass
        return {}

    monkeypatch.setattr(run, "answer", busy)
    assert 0.1 < answer_job({}, False, False)["processor_s"] < 0.29
    results = run_trials(quick, SEEDS, tmp_path)
    found = [{**r, "processor_s": 3.0 + i} for i, r in enumerate(results)]
    assert summarise(found)["processor_seconds"]["largest"] == 2.0 + len(found)
    assert "seconds of the processor" in summary_text(summarise(found))


def test_a_changed_truth_is_refused(quick: Settings, tmp_path: Path) -> None:
    run_trials(quick, SEEDS, tmp_path)
    file = tmp_path / "sealed" / "4.json"
    file.write_text(file.read_text().replace('"control"', '"single"'))
    with pytest.raises(InputError, match=r"4\.json"):
        run_trials(quick, SEEDS, tmp_path)
    text = sealed_text({"kind": "control"})
    assert open_seal(text, seal(text)) == {"kind": "control"}
    with pytest.raises(InputError, match="SHA-256"):
        open_seal(text + " ", seal(text))


def test_another_run_in_the_same_folder_is_refused(quick: Settings, tmp_path: Path) -> None:
    run_trials(quick, range(3, 4), tmp_path)
    with pytest.raises(InputError, match="other settings"):
        run_trials(CONTROLS, SEEDS, tmp_path)


def double(x: int) -> tuple[int, str]:
    """A job; tells how many threads its process may use."""
    return 2 * x, os.environ["NUMBA_NUM_THREADS"]


def test_a_local_cluster() -> None:
    with executor(2, None) as spread:
        found = dict(spread(double, ((str(i), (i,)) for i in range(11))))
    assert found == {str(i): (2 * i, "1") for i in range(11)}


def test_a_scheduler_by_its_address() -> None:
    import distributed

    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
        ) as cluster,
        executor(1, cluster.scheduler_address) as spread,
    ):
        assert dict(spread(pow, ((i, (i, 2)) for i in range(5)))) == {i: i * i for i in range(5)}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("kinds", ("control", "triple")),
        ("effects", ("detent",)),
        ("outside", ()),
        ("rig_kinds", ("paper", "huge")),
        ("noises", ("pink",)),
        ("strength", (2.0, 1.0)),
        ("strength", (0.0, 1.0)),
    ],
)
def test_wrong_settings(name: str, value: tuple) -> None:
    with pytest.raises(InputError, match=f"trial, {name}"):
        Settings(**{name: value})


def test_settings_survive_their_document() -> None:
    settings = Settings(kinds=("pair",), strength=(1.0, 2.0), search=False)
    assert settings_from(json.loads(json.dumps(settings.document()))) == settings


def test_what_json_does_not_have() -> None:
    import numpy as np

    found = strict({"a": float("nan"), "b": (np.float64(1), np.int64(2)), "c": np.array([np.inf])})
    assert json.loads(json.dumps(found, allow_nan=False)) == {"a": None, "b": [1.0, 2], "c": [None]}


def test_two_runs_in_one_folder_are_refused(quick: Settings, tmp_path: Path) -> None:
    arguments = ["trial", "--number", "1", "--out", str(tmp_path), "--quiet"]
    with locked(tmp_path):
        result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2 and "another run at work" in result.output
    assert not (tmp_path / "settings.json").exists()
