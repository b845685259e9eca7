"""Every example runs and prints the numbers of the paper."""

from __future__ import annotations

import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
SCRIPTS = sorted(p.stem for p in EXAMPLES.glob("*.py") if "__main__" in p.read_text())

Run = Callable[[str], dict[str, float]]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs one example with short settings and returns its numbers."""

    def inner(name: str) -> dict[str, float]:
        monkeypatch.syspath_prepend(str(EXAMPLES))
        script = runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="example")
        assert (script["__doc__"] or "").strip().endswith((".", "?"))
        numbers = script["main"](["--quick", "--out", str(tmp_path)])
        printed = capsys.readouterr().out
        figures = [Path(line[8:]) for line in printed.splitlines() if line.startswith("figure: ")]
        assert figures
        for figure in figures:
            assert figure.parent == tmp_path
            assert figure.read_bytes().startswith(b"\x89PNG")
            assert figure.stat().st_size > 10_000
        assert len(printed.splitlines()) > len(figures)
        return numbers

    return inner


def test_every_example_is_tested() -> None:
    text = Path(__file__).read_text()
    assert [name for name in SCRIPTS if f'run("{name}")' not in text] == []


def test_as_a_script(tmp_path: Path) -> None:
    """From any folder, with the default folder for the figures."""
    command = [sys.executable, str(EXAMPLES / "table1_beam_stiffness.py")]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "5276.2" in result.stdout
    assert (tmp_path / "figures-of-examples" / "table1_beam_stiffness.png").is_file()


def test_table_1(run: Run) -> None:
    numbers = run("table1_beam_stiffness")
    # Published with one decimal; case 1 rounds to 5276.2 from the published geometry.
    assert numbers["1"] == pytest.approx(5276.3, abs=0.11)
    assert numbers["2"] == pytest.approx(4622.0, abs=0.06)
    assert numbers["3"] == pytest.approx(3000.8, abs=0.06)


def test_table_2(run: Run) -> None:
    """Seven parameters within 3.3 standard deviations: all would be in 99.3 % of campaigns."""
    numbers = run("table2_identification")
    for name, true in {"c1": 0.148, "k1": 808.556, "c2": 2.085, "g": 1.1e-3}.items():
        assert numbers[name] == pytest.approx(true, rel=1e-3)
        assert abs(numbers[f"z {name}"]) < 3.3
    for case, true in {"1": 5350.156, "2": 4776.275, "3": 2959.249}.items():
        assert numbers[f"k2[{case}]"] == pytest.approx(true, rel=1e-3)
        assert abs(numbers[f"z k2[{case}]"]) < 3.3


def test_figs_5_and_7(run: Run) -> None:
    numbers = run("figs5_and_7_backbones")
    assert numbers["lower_frequency_hz"] == pytest.approx(6.39, abs=0.015)
    assert numbers["k1"] == pytest.approx(808.556, rel=1e-3)
    assert numbers["g"] == pytest.approx(1.1e-3, abs=5e-5)
    # The stiffer the beam, the lower the upper backbone and the further it reaches.
    amplitudes = [numbers[f"amplitude_at_9_hz[{case}]"] for case in "123"]
    assert amplitudes == sorted(amplitudes)
    highest = [numbers[f"highest_frequency_hz[{case}]"] for case in "123"]
    assert highest == sorted(highest, reverse=True)


def test_fig_6(run: Run) -> None:
    numbers = run("fig6_damping_ratio")
    assert numbers["c1"] == pytest.approx(0.148, rel=0.05)
    assert abs(numbers["damping_ratio"] - 3.669e-3) < 4 * numbers["standard_error"]


def test_figs_9_to_11(run: Run) -> None:
    numbers = run("figs9_to_11_identified_motion")
    assert len(numbers) == 9
    # 5 um of noise over 6,000 samples: 1 % for each rms.
    assert all(rms == pytest.approx(5e-6, rel=0.04) for rms in numbers.values())


def test_figs_12_and_13(run: Run) -> None:
    numbers = run("figs12_and_13_simulated_backbones")
    assert numbers["frequency_rms"] < 1e-3
    assert numbers["damping_rms"] < 1e-4


def test_fig_14(run: Run) -> None:
    numbers = run("fig14_stiffness_from_release")
    assert len(numbers) == 4
    for published, found in numbers.items():
        assert found == pytest.approx(float(published), rel=3e-3)


def test_fig_15(run: Run) -> None:
    """What the paper reads from its maps."""
    numbers = run("fig15_estimation_accuracy")
    assert numbers["k1 = 100, release 20 mm"] > 0.8
    assert numbers["k1 = 100, release 40 mm"] == pytest.approx(0.9, abs=0.02)
    assert numbers["k1 = 20, release 20 mm"] < numbers["k1 = 100, release 20 mm"]
    light = numbers["mass 0.2 kg, k2 = 100"] - numbers["mass 0.2 kg, k2 = 20"]
    heavy = numbers["mass 1 kg, k2 = 100"] - numbers["mass 1 kg, k2 = 20"]
    assert light > 0.15
    assert abs(heavy) < 0.05
    assert numbers["c2 = 4"] < numbers["c1 = 1"] < numbers["c1 = c2 = 0"]
