"""The commands: exit codes, what is printed where, and what is written."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bad_campaigns import BAD, Bad
from campaigns import TOML, csv, decay, write

from bayesimpact.cli import main
from bayesimpact.errors import SimulationError

Run = Callable[..., tuple[int, str, str]]


def tree(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


@pytest.mark.parametrize("bad", BAD, ids=[b.id for b in BAD])
def test_bad_campaign_is_refused(
    bad: Bad, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    toml = bad.toml.replace(b"rig", b"r\xe4g") if isinstance(bad.toml, bytes) else bad.toml
    write(tmp_path / "campaign", toml, **bad.files)
    before = tree(tmp_path)
    code, out, err = run("check", "campaign", "--out", "results")
    assert (code, out) == (2, "")
    assert err.startswith("bayesimpact: ") and err.count("\n") == 1
    assert "Traceback" not in err
    assert "found " in err and "; accepted: " in err
    for words in bad.words:
        assert words in err
    assert tree(tmp_path) == before


def test_kinds_of_bad_campaign_are_many_and_distinct() -> None:
    assert len({b.id for b in BAD}) == len(BAD) >= 40


@pytest.mark.parametrize("name", ["absent", "a.csv", "empty"])
def test_no_campaign_there(name: str, run: Run, tmp_path: Path) -> None:
    (write(tmp_path) / "empty").mkdir()
    code, out, err = run("check", tmp_path / name)
    assert (code, out) == (2, "")
    assert name in err and "accepted: a folder with campaign.toml, or that file" in err


def test_out_that_is_a_file_is_refused(run: Run, tmp_path: Path) -> None:
    write(tmp_path)
    code, _, err = run("check", tmp_path, "--out", tmp_path / "a.csv")
    assert code == 2 and "a.csv" in err
    code, _, err = run("check", tmp_path, "--out", tmp_path / "a.csv" / "deeper")
    assert code == 2 and "--out" in err and "Traceback" not in err


@pytest.mark.parametrize("arguments", [["nonsense"], ["check"], ["check", ".", "--seed", "-1"]])
def test_wrong_usage_is_bad_input(arguments: list[str], run: Run) -> None:
    code, _, err = run(*arguments)
    assert code == 2 and err.startswith("Usage:")


def noisy(n: int = 600, interval: float = 2e-3, seed: int = 1) -> np.ndarray:
    """A decay with white noise of 5 um."""
    return decay(n, interval) + 5e-6 * np.random.default_rng(seed).standard_normal(n)


def test_check_says_what_was_read_and_what_will_be_estimated(run: Run, tmp_path: Path) -> None:
    toml = TOML.replace("b.csv", "c.csv") + (
        '[measurement]\nnoise_um = 5\nsmoothing = { kind = "savgol", window = 21, polyorder = 2 }\n'
        '[priors]\nk1 = { distribution = "normal", mean = 800, sd = 50 }\n'
        "[beam.1]\nlength_mm = 110\nwidth_mm = 20\nthickness_mm = 5\nyoungs_modulus_mpa = 2.1e5\n"
    )
    write(
        tmp_path, toml, a=csv(noisy()), b=None, c=csv(noisy(1500, 1e-3), interval=1e-3, start=0.25)
    )
    before = tree(tmp_path)
    code, out, err = run("check", tmp_path)
    assert (code, err) == (0, "")
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line.strip()}
    # name, case, samples, Hz, start, length, period; then rest, first and largest in mm
    assert lines["a"][:7] == ["a", "1", "600", "500", "0", "1.198", "0.1563"]
    assert lines["c"][:7] == ["c", "2", "1500", "1000", "0.25", "1.499", "0.1563"]
    assert [float(x) for x in lines["a"][8:10]] == pytest.approx([-6.0, 6.0], rel=0.05)
    assert "will be estimated: 13 parameters" in out
    for words in ("k2[1], k2[2]  N/m", "y0[a], y0[c]  m", "v0[a], v0[c]  m/s", "sigma  m"):
        assert words in out
    assert "k1: normal, mean = 800, sd = 50" in out
    assert "5.00 µm (stated)" in out
    assert "Savitzky-Golay, window 21 samples, order 2" in out
    assert "case 1: 98610 N/m" in out
    assert tree(tmp_path) == before


def test_check_saves_its_plot(run: Run, tmp_path: Path) -> None:
    write(tmp_path / "campaign")
    code, out, _ = run("check", tmp_path / "campaign", "--out", tmp_path / "deep" / "results")
    plot = tmp_path / "deep" / "results" / "check.png"
    assert code == 0 and str(plot) in out
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_check_tells_a_stated_high_pass(run: Run, tmp_path: Path) -> None:
    files = {"a": csv(noisy()), "b": csv(noisy(seed=2))}
    _, plain, _ = run("check", write(tmp_path / "plain", **files))
    _, out, _ = run("check", write(tmp_path / "passed", TOML + "high_pass_hz = 0.35\n", **files))
    assert "high-pass             b 0.35 Hz\n" in out and "high-pass" not in plain


def test_quiet_check_prints_warnings_only(run: Run, tmp_path: Path) -> None:
    files = {"a": csv(noisy()), "b": csv(noisy(seed=2))}
    assert run("check", write(tmp_path, **files), "--quiet") == (0, "", "")
    toml = TOML + '[measurement]\nsmoothing = { kind = "savgol", window = 20, polyorder = 2 }\n'
    code, out, err = run("check", write(tmp_path, toml, **files), "--quiet")
    assert (code, out) == (0, "")
    assert err.startswith("warning: smoothing window 20 is even and taken as 19")


@pytest.mark.parametrize(("stated", "warned"), [(5.0, False), (20.0, True), (1.0, True)])
def test_stated_noise_is_compared_with_the_recordings(
    stated: float, warned: bool, run: Run, tmp_path: Path
) -> None:
    toml = f"{TOML}[measurement]\nnoise_um = {stated}\n"
    code, out, err = run("check", write(tmp_path, toml, a=csv(noisy()), b=csv(noisy(seed=2))))
    (line,) = (line for line in out.splitlines() if "raw noise" in line)
    # 1,200 samples fix the level to 2 %, part of them spent on the polynomials.
    assert float(line.split()[2]) == pytest.approx(5.0, rel=0.15) and line.split()[3] == "µm,"
    assert "relative uncertainty  none stated\n" in out
    assert code == 0 and ("noise is stated as" in err) == warned


def test_recording_that_starts_before_the_release(run: Run, tmp_path: Path) -> None:
    held = 0.8 * np.concatenate([np.full(300, -6e-3 * 0.7), decay()])
    code, out, err = run("check", write(tmp_path, b=csv(held, start=1.0)))
    assert (code, err) == (0, "")  # it is set aside, and so nothing is left to be warned of
    assert "b: recording_held: " in out and "exclude_s = [[0.9992, 1.5988]]" in out
    kept = 'faults = "keep"\n' + TOML
    code, _, err = run("check", write(tmp_path, kept, b=csv(held, start=1.0)))
    assert "b: the largest excursion comes 0.6 s" in err and "set start_s = 1.6" in err
    assert "a:" not in err


def test_first_and_largest_are_counted_from_one_rest(run: Run, tmp_path: Path) -> None:
    """Once told of a probe that reads 418 mm at rest: first 478.8, largest 71.25."""
    code, out, _ = run("check", write(tmp_path, a=csv(0.4 + decay()), b=csv(decay())))
    rows = {line.split()[0]: line.split() for line in out.splitlines() if line.strip()}
    names = rows["recording"]
    assert names[-5:] == ["rest", "mm", "first", "largest", "decay"]
    far, near = ([float(x) for x in rows[name][7:10]] for name in ("a", "b"))
    assert code == 0 and far[0] == pytest.approx(400.0 + near[0], abs=0.1)
    assert far[1:] == pytest.approx(near[1:], abs=1e-3)
    assert near[2] == pytest.approx(-near[1]) == pytest.approx(6.0, rel=0.05)


@pytest.mark.parametrize("stop", [True, False])
def test_few_samples_per_period_speak_of_contacts_where_there_are_any(
    stop: bool, run: Run, tmp_path: Path
) -> None:
    few = csv(decay(120, 1e-2), interval=1e-2)  # 16 per period
    toml = TOML if stop else TOML.replace("mass_kg", "stop = false\nmass_kg")
    code, out, err = run("check", write(tmp_path, toml, a=few, b=few))
    assert code == 0 and "a: only 16 samples per period: " in err
    assert ("contact" in out + err) is stop


@pytest.mark.parametrize(
    ("raised", "code", "words"),
    [(KeyboardInterrupt(), 130, "interrupted"), (SimulationError("code 4"), 1, "code 4")],
)
def test_other_ends(
    raised: BaseException,
    code: int,
    words: str,
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(path: Path, folders: object) -> None:
        raise raised

    monkeypatch.setattr("bayesimpact.data.read.load_campaign", fail)
    got, out, err = run("check", tmp_path)
    assert (got, out) == (code, "")
    assert words in err and "Traceback" not in err


def test_every_command_takes_the_common_options() -> None:
    for command in main.commands.values():
        options = {o for parameter in command.params for o in parameter.opts}
        assert {"--seed", "--quiet"} <= options, command.name


def test_no_help_text_is_cut(run: Run) -> None:
    """Click cuts the line on a command to the width of the terminal: six ended in dots."""
    _, out, _ = run("--help")
    listed = " ".join(out.split("Commands:")[1].split())
    assert "..." not in listed.replace("FILE...", "")
    assert "what the base model leaves out of CAMPAIGN." in listed
    assert '\n  eval "$(_BAYESIMPACT_COMPLETE=bash_source bayesimpact)"' in out


def test_a_seed_without_effect_says_so(run: Run) -> None:
    for name in main.commands:
        _, out, _ = run(name, "--help")
        assert ("No effect here" in out) == (name in ("check", "new", "report", "effects")), name


def test_version(run: Run) -> None:
    from importlib.metadata import version

    code, out, _ = run("--version")
    assert code == 0 and version("bayesimpact") in out


def test_help_loads_nothing_heavy() -> None:
    script = (
        "import json, sys\n"
        "from bayesimpact.cli import main\n"
        "try:\n    main(['--help'])\n"
        "except SystemExit as end:\n    print(json.dumps([end.code, sorted(sys.modules)]))\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    code, modules = json.loads(result.stdout.splitlines()[-1])
    assert code == 0
    assert not {"numpy", "numba", "scipy", "pydantic", "matplotlib", "arviz"} & set(modules)
    assert "check" in result.stdout
