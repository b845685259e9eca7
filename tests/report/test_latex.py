"""Tables for a paper, and the printed report."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from browser import chromium
from click.testing import CliRunner
from diagnosed import LIMITS, diagnosed, estimate
from synthetic import make_results

from bayesimpact.cli import main
from bayesimpact.errors import BayesimpactError, InputError
from bayesimpact.report.archive import save_results
from bayesimpact.report.latex import escaped, latex_tables, symbol
from bayesimpact.report.pdf import print_page

STIFF = {
    "before": {"k2[a_1]": estimate(5358.17, 0.5, "N/m"), "sigma": estimate(5e-6, 1e-8, "m")},
    "after": {"k2[a_1]": estimate(5349.0, 0.8, "N/m"), "sigma": estimate(5e-6, 1e-8, "m")},
}


def test_special_characters() -> None:
    assert escaped("50 % of a_b & {c} #1 \\ $") == (
        r"50 \% of a\_b \& \{c\} \#1 \textbackslash{} \$"
    )
    assert escaped("3.34 × 10⁻⁴ µN s²/m²") == r"3.34 $\times$ 10$^{-4}$ $\mu$N s$^{2}$/m$^{2}$"
    assert symbol("k2[a_1]") == r"$k_{2}$[a\_1]" and symbol("g") == "$g$"
    assert symbol("gap_wear.step") == "a gap that grows at every impact: step"


def test_tables_hold_the_numbers_of_the_report() -> None:
    text = latex_tables(make_results(1, 1)).replace("~", " ")
    assert r"$k_{1}$ & 808.556 & 808.551 to 808.561 & N/m \\" in text
    assert r"$g$ & 1.10000 & 1.09994 to 1.10006 & mm \\" in text
    assert "rig $<$1$>$ \\& others" in text
    told = latex_tables(diagnosed(parameters=STIFF, limits=LIMITS)).replace("~", " ")
    row = r"$k_{2}$[a\_1] & 5358.2 & 5357.7 to 5358.7 & 5349.0 & 5348.2 to 5349.8 & N/m &"
    assert row + r" $-$0.17 \% \\" in told and "(dry friction)" in told
    assert r"relaxation of the obstacle & stiffness & 95.0 N/m \\" in told
    assert "sigma" not in told
    bare = latex_tables(diagnosed(verdict="adequate", limits=[]))
    assert bare.count(r"\begin{table}") == 1


@pytest.mark.parametrize("row", ["braces", "columns"])
def test_tables_are_sound_latex(row: str) -> None:
    text = latex_tables(diagnosed(parameters=STIFF, limits=LIMITS))
    plain = re.sub(r"\\.", "", text)
    if row == "braces":
        assert plain.count("{") == plain.count("}") and plain.count("$") % 2 == 0
        return
    for table in re.findall(r"\\begin{tabular}{(\w+)}(.*?)\\end{tabular}", text, re.S):
        for line in table[1].splitlines():
            if line.endswith(r"\\"):
                assert len(re.findall(r"(?<!\\)&", line)) == len(table[0]) - 1, line


def test_command_writes_tables_and_pdf(tmp_path: Path) -> None:
    if chromium() is None:
        pytest.skip("no Chromium is installed")
    save_results(make_results(1, 1, n=200, sampled=False), tmp_path)
    done = CliRunner().invoke(main, ["report", str(tmp_path), "--pdf", "--latex"])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")
    assert "booktabs" in (tmp_path / "tables.tex").read_text()
    assert "report.pdf" in done.output and "tables.tex" in done.output


def test_without_a_browser_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(InputError, match="chromium"):
        print_page(tmp_path / "report.html", tmp_path / "report.pdf")
    monkeypatch.setattr(shutil, "which", lambda name: "/bin/false")
    monkeypatch.setattr(
        subprocess, "run", lambda command, **_: subprocess.CompletedProcess(command, 1)
    )
    with pytest.raises(BayesimpactError, match="did not print"):
        print_page(tmp_path / "report.html", tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []
