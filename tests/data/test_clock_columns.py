"""Which column is the clock: one rule for reading and for a first campaign.toml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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


TICKS = np.round(made.TIMES * 1e6)


@pytest.mark.parametrize(("unit", "size"), [("us", 1e-6), ("ms", 1e-3), ("s", 1.0), ("min", 60.0)])
def test_the_unit_of_a_clock_can_be_stated(tmp_path: Path, unit: str, size: float) -> None:
    columns(tmp_path, "Time,x [mm]", made.TIMES / size, made.MM)
    recording = load(tmp_path, f'time_unit = "{unit}"\nstart_s = 0.2\n')
    assert recording.interval == pytest.approx(2e-3, rel=1e-6)
    assert recording.start == pytest.approx(0.2)
    np.testing.assert_allclose(recording.samples, decay()[100:], rtol=1e-9)


@pytest.mark.parametrize(
    ("header", "keys", "words"),
    [
        ("Time [ms],x [mm]", 'time_unit = "us"\n', 'accepted: time_unit = "ms", or no time_unit'),
        ("time_s,displacement_mm", 'time_unit = "us"\n', 'accepted: time_unit = "s", or no'),
        ("Time,x [mm]", 'time_unit = "h"\n', "accepted: s, ms, us, ns, min, in quotes"),
        ("y [V],x [mm]", 'sample_rate_hz = 500\ntime_unit = "us"\n', "found no column of times"),
    ],
)
def test_units_of_a_clock_that_are_refused(
    tmp_path: Path, header: str, keys: str, words: str
) -> None:
    columns(tmp_path, header, made.TIMES, made.MM)
    with pytest.raises(InputError) as caught:
        load(tmp_path, keys)
    assert "time_unit" in str(caught.value) and words in str(caught.value)


def warned(tmp_path: Path, keys: str = "") -> str:
    write(tmp_path, ONE + keys, a=None, b=None)
    result = CliRunner().invoke(main, ["check", str(tmp_path), "--quiet"])
    assert result.exit_code == 0, result.output
    return result.stderr


def test_check_warns_of_a_clock_that_makes_the_motion_slower_than_any_rig(tmp_path: Path) -> None:
    columns(tmp_path, "Time Stamp,x [mm]", TICKS, made.MM)  # a counter of microseconds
    said = warned(tmp_path)
    assert 'state the unit in campaign.toml, time_unit = "us" (a period of 0.156' in said
    assert "a pendulum 6.07e+09 m long" in said
    assert "its clock" not in warned(tmp_path, 'time_unit = "us"\n')
    assert "its clock" not in warned(tmp_path, 'time_unit = "s"\n')  # it is said, and believed
    columns(tmp_path, "Time,x [mm]", TICKS / 1e3, made.MM)
    assert 'time_unit = "ms" (a period of 0.156' in warned(tmp_path)
    assert "its clock" not in warned(tmp_path, "clock_ratio = 0.001\n")
    columns(tmp_path, "Time [s],x [mm]", TICKS / 1e3, made.MM)
    assert "its clock" not in warned(tmp_path)  # the file itself says s


@pytest.mark.parametrize(("period", "doubted"), [(19.0, False), (21.0, True)])
def test_a_pendulum_of_a_hundred_metres_is_the_slowest(
    tmp_path: Path, period: float, doubted: bool
) -> None:
    columns(tmp_path, "Time,x [mm]", made.TIMES * 6.4 * period, made.MM)
    assert ("its clock" in warned(tmp_path)) == doubted


def test_a_rate_that_is_stated_comes_before_a_clock_that_is_guessed(tmp_path: Path) -> None:
    columns(tmp_path, "Time Stamp,x [mm]", TICKS, made.MM)
    assert load(tmp_path, "sample_rate_hz = 500\n").interval == pytest.approx(2e-3)
    columns(tmp_path, "Time,x [mm]", made.TIMES, made.MM)
    with pytest.raises(InputError, match="sample_rate_hz = 400, and a clock at 500 Hz"):
        load(tmp_path, "sample_rate_hz = 400\n")


def test_a_clock_of_another_name_in_a_plain_table_is_named_with_the_keys_that_read_it(
    tmp_path: Path,
) -> None:
    columns(tmp_path, "Time Stamp,laser", TICKS, made.MM)
    keys = 'column = "laser"\nunit = "mm"\n'
    with pytest.raises(InputError, match='or time_column = "Time Stamp" and time_unit there'):
        load(tmp_path, keys)
    recording = load(tmp_path, keys + 'time_column = "Time Stamp"\ntime_unit = "us"\n')
    assert recording.interval == pytest.approx(2e-3, rel=1e-6)


def clocked(tmp_path: Path, stamps: list[str], keys: str = "") -> Any:
    rows = [f"{stamp},{x:.9g}" for stamp, x in zip(stamps, made.MM, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["Timestamp,x [mm]", *rows]) + "\n")
    return load(tmp_path, keys)


@pytest.mark.parametrize("before", ["", "2024-05-01T"])
def test_times_of_day_are_a_clock(tmp_path: Path, before: str) -> None:
    """A minute ends on the way."""
    seconds = 59.5 + np.array(made.TIMES)
    stamps = [f"{before}16:{4 + int(s // 60):02d}:{s % 60:06.3f}" for s in seconds]
    read = clocked(tmp_path, stamps)
    assert read.interval == pytest.approx(2e-3, rel=1e-6)
    assert read.start == pytest.approx(16 * 3600 + 4 * 60 + 59.5)
    np.testing.assert_allclose(read.samples, decay(), rtol=1e-7)


def test_a_stated_rate_stands_beside_stamps_of_batches(tmp_path: Path) -> None:
    stamps = [f"16:04:{10 + 0.03 * (i // 15):06.3f}" for i in range(len(made.TIMES))]
    with pytest.raises(InputError, match="the same time twice"):
        clocked(tmp_path, stamps)
    assert clocked(tmp_path, stamps, "sample_rate_hz = 500\n").interval == 2e-3
    with pytest.raises(InputError, match="rows a second by the time column"):
        clocked(tmp_path, stamps, "sample_rate_hz = 50\n")


def test_a_unit_in_the_name_of_a_column_that_is_asked_for(tmp_path: Path) -> None:
    rows = [f"{t:.6g},{x:.9g}" for t, x in zip(made.TIMES, made.MM, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["time_s,distance_mm", *rows]) + "\n")
    read = load(tmp_path, 'column = "distance_mm"\n')
    np.testing.assert_allclose(read.samples, decay(), rtol=1e-7)


def test_a_time_of_day_stands_beside_a_clock_with_a_unit(tmp_path: Path) -> None:
    rows = [
        f"16:04:{10 + t:06.3f},{t:.6g},{x:.9g}" for t, x in zip(made.TIMES, made.MM, strict=True)
    ]
    (tmp_path / "a.csv").write_text("\n".join(["Time of day,Time [s],x [mm]", *rows]) + "\n")
    assert load(tmp_path).start == 0.0
