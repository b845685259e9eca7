"""Factors on top of a unit that a file states: said, and doubted where they convert twice."""

from __future__ import annotations

from pathlib import Path

import instrument_files as made
import numpy as np
import pytest
from campaigns import decay, write
from click.testing import CliRunner

from bayesimpact.cli import main
from bayesimpact.data.read import load_campaign

HEAD = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\n'
TABLE = 2.0 * np.sin(30.0 * np.array(made.TIMES))  # mm


def checked(tmp_path: Path, header: str, keys: str) -> tuple[str, str]:
    """What `check` says, and what it warns of."""
    rows = zip(made.TIMES, made.MM, TABLE, strict=True)
    text = "".join(f"{t:.6g},{x:.9g},{y:.9g}\n" for t, x, y in rows)
    write(tmp_path, HEAD + keys, a=f"{header}\n{text}", b=None)
    result = CliRunner().invoke(main, ["check", str(tmp_path)])
    assert result.exit_code == 0, result.output
    return result.stdout, result.stderr


def _input(scale: float, column: str = "table_mm", kind: str = "base_m") -> str:
    return f'input = {{ column = "{column}", kind = "{kind}", scale = {scale} }}\n'


@pytest.mark.parametrize(
    "header", ["time_s,displacement_mm,table_mm", "Time [s],x [mm],table [mm]"]
)
def test_a_scale_comes_on_top_of_the_unit_in_a_name_and_that_is_said(
    tmp_path: Path, header: str
) -> None:
    first, column = ("displacement_mm", "table_mm") if "_mm" in header else ("x", "table")
    said, warned = checked(tmp_path, header, f'column = "{first}"\n' + _input(0.001, column))
    assert f"unit of a, input {column}: mm, times scale = 0.001" in said
    assert f"a: its input, column {column}, is read in mm, and scale = 0.001 multiplies" in warned
    assert "where it was to turn mm into m" in warned
    given = load_campaign(tmp_path).recordings[0].input
    assert given is not None
    np.testing.assert_allclose(given.samples, 1e-6 * TABLE, rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize(
    ("header", "keys", "said", "doubted"),
    [
        ("time_s,displacement_mm,y", "scale = 1.05\n", "a, readings: mm, times scale = 1.05", ""),
        ("time_s,displacement_mm,y", "scale = 0.001\n", "scale = 0.001", "turn mm into m"),
        ("Time [s],Accel [g],y", "scale = 9.81\n", "a, readings: g", "turn g into m/s2"),
        ("Time [s],Tilt [deg],y", "scale = -0.01745\n", "a, readings: deg", "turn deg into rad"),
        ("time_s,displacement_mm,u", _input(4.5, "u", "force_N"), "input u: no unit, so SI", ""),
        ("time_s,displacement_mm,table_mm", _input(2.0), "input table_mm: mm, times scale = 2", ""),
    ],
)  # fmt: skip
def test_only_a_factor_between_units_is_doubted(
    tmp_path: Path, header: str, keys: str, said: str, doubted: str
) -> None:
    told, warned = checked(tmp_path, header, keys)
    assert said in told
    assert doubted in warned and ("multiplies that again" in warned) == bool(doubted)


def test_without_a_factor_nothing_is_said(tmp_path: Path) -> None:
    said, warned = checked(tmp_path, "time_s,displacement_mm,table_mm", _input(1.0))
    assert "unit of" not in said and "multiplies" not in warned
    (recording,) = load_campaign(tmp_path).recordings
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-8)
