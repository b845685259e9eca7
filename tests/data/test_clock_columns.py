"""Which column is the clock: one rule for reading and for a first campaign.toml."""

from __future__ import annotations

from pathlib import Path

import instrument_files as made
import numpy as np
import pytest
from campaigns import decay, write
from click.testing import CliRunner

from bayesimpact.cli import main
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError

ONE = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\n'


def columns(tmp_path: Path, header: str, *values: np.ndarray) -> Path:
    """A file of these columns, and its folder."""
    rows = [",".join(f"{x:.12g}" for x in row) for row in zip(*values, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n")
    return tmp_path


def load(tmp_path: Path, keys: str = ""):  # type: ignore[no-untyped-def]
    (recording,) = load_campaign(write(tmp_path, ONE + keys, a=None, b=None)).recordings
    return recording


@pytest.mark.parametrize("keys", ["", "resample = true\n"])
@pytest.mark.parametrize(
    ("name", "ticks"),
    [
        ("Time Stamp [us]", 1e6),
        ("Time Stamp (µs)", 1e6),
        ("Stamp [ms]", 1e3),  # by its unit, for it never falls
        ("Elapsed Time", 1.0),
        ("Time (s) Run #13", 1.0),
        ("tiempo_s", 1.0),
    ],
)
def test_one_rule_for_reading_and_for_new(
    tmp_path: Path, name: str, ticks: float, keys: str
) -> None:
    columns(tmp_path, f"{name},Acceleration [g]", np.round(made.TIMES * ticks, 9), made.MM)
    recording = load(tmp_path, keys)
    assert recording.interval == pytest.approx(2e-3, rel=1e-6)
    np.testing.assert_allclose(recording.samples, 9.80665 * made.MM, rtol=1e-9)
    (tmp_path / "campaign.toml").unlink()
    result = CliRunner().invoke(main, ["new", str(tmp_path), str(tmp_path / "a.csv")])
    assert "ready for" in result.output
    again = load_campaign(tmp_path).recordings[0]
    assert again.interval == pytest.approx(2e-3, rel=1e-6)


def test_what_falls_is_no_clock(tmp_path: Path) -> None:
    columns(tmp_path, "Reaction time [ms],x [mm],t [s]", made.VOLT, made.MM, made.TIMES)
    np.testing.assert_allclose(load(tmp_path).samples, decay(), rtol=1e-9)


def test_of_two_clocks_reading_asks_and_new_takes_the_one_before(tmp_path: Path) -> None:
    header = "Time A,Pos A [mm],Time B,Pos B [V]"
    columns(tmp_path, header, made.TIMES, made.MM, made.TIMES + 0.025, made.VOLT)
    with pytest.raises(InputError, match=r"2 columns that may be the clock.*Time A, Time B"):
        load(tmp_path)
    (tmp_path / "campaign.toml").unlink()
    CliRunner().invoke(main, ["new", str(tmp_path), str(tmp_path / "a.csv")])
    assert 'time_column = "Time A"' in (tmp_path / "campaign.toml").read_text()
    assert load_campaign(tmp_path).recordings[0].start == 0.0
