"""What `bayesimpact new` makes of files that say little: response, clock, unit, obstacle."""

from __future__ import annotations

from pathlib import Path

import instrument_files as made
import numpy as np
import pytest
from campaigns import csv
from click.testing import CliRunner
from small_rig import record

from bayesimpact.cli import main
from bayesimpact.data.one_sided import shortened
from bayesimpact.data.read import load_campaign
from bayesimpact.data.readers.guess import named_quantity

WAVE = made.MM
SIDE = 0.2 * np.sin(9.0 * np.array(made.TIMES))


def drafted(tmp_path: Path, header: str, *columns: np.ndarray, said: tuple[str, ...] = ()) -> str:
    """campaign.toml of one file with these columns, comments of the file's channels left out."""
    rows = [",".join(f"{x:.12g}" for x in row) for row in zip(*columns, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows] if header else rows) + "\n")
    result = CliRunner().invoke(main, ["new", str(tmp_path), str(tmp_path / "a.csv"), *said])
    assert result.exit_code == 0, result.output
    lines = (tmp_path / "campaign.toml").read_text().splitlines()
    return "\n".join(line for line in lines if not line.startswith("#   "))


@pytest.mark.parametrize(
    ("header", "columns", "column", "others"),
    [
        ("Time (s),Acceleration x (m/s^2),Acceleration y (m/s^2)", (SIDE, WAVE),
         "Acceleration y", "Acceleration x [m/s2]"),
        ("Time [s],x [mm],y [um]", (WAVE, 99 * WAVE), "x", "y [um]"),  # as lengths, not as numbers
        ("Time [s],Ch 1 [rad],Ch 3 [rad]", (WAVE, 1.5 * WAVE), "Ch 1", "Ch 3 [rad]"),  # a driver
        ("Time [s],Ch 1 [rad],Ch 3 [rad]", (WAVE, 3.0 * WAVE), "Ch 3", "Ch 1 [rad]"),
        ("Time [s],Load,Angle,Temperature", (99 * WAVE, WAVE, 99 * WAVE), "Angle", ""),
        ("t [s],Pos A [au],Time B,Pos B [au]", (WAVE, 1 + made.TIMES, SIDE), "Pos A [au]",
         "Pos B [au]"),
        ("frame,t [s],x", (made.TIMES, WAVE), "x", ""),  # a count never falls
        ("t [s],frame,x", (np.arange(600.0), WAVE), "x", ""),
    ],
)  # fmt: skip
def test_the_channel_that_shows_the_motion(
    tmp_path: Path, header: str, columns: tuple[np.ndarray, ...], column: str, others: str
) -> None:
    first = np.arange(600.0) if header.startswith("frame") else np.array(made.TIMES)
    text = drafted(tmp_path, header, first, *columns)
    assert f'column = "{column}"' in text
    assert text.partition("; others: ")[2].partition("\n")[0] == others


@pytest.mark.parametrize("header", ["", "1st,2nd"])
def test_a_first_column_that_never_falls_is_the_clock_however_uneven(
    tmp_path: Path, header: str
) -> None:
    times = np.cumsum(np.random.default_rng(0).uniform(1e-3, 3e-3, 600))
    wave = np.cos(40.0 * times)
    text = drafted(tmp_path, header, times, wave, said=("--unit", "deg"))
    named = ('"1st"', '"2nd"') if header else ("1", "2")
    assert f"time_column = {named[0]}  # ASSUMED: it rises, in s" in text
    assert f"column = {named[1]}" in text and "inertia" in text
    assert "resample = true  # ASSUMED: its times are not evenly spaced" in text
    assert load_campaign(tmp_path).recordings[0].quantity == "angle"


def test_a_file_of_ones_own_kind_with_an_uneven_clock_is_resampled(tmp_path: Path) -> None:
    times = np.cumsum(np.random.default_rng(0).uniform(1e-3, 3e-3, 600))
    text = drafted(tmp_path, "time_s,displacement_mm", times, np.cos(40.0 * times))
    assert "resample = true" in text
    assert load_campaign(tmp_path).recordings[0].samples.size > 500


def test_the_unit_of_a_counter_is_needed(tmp_path: Path) -> None:
    text = drafted(tmp_path, "Time Stamp,x [mm]", np.round(made.TIMES * 1e6), WAVE)
    assert 'time_column = "Time Stamp"\n# time_unit = "us"  # NEEDED: read in s a period' in text
    assert "would last 1.563e+05 s; s, ms, us, ns, min" in text


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("Angle", ['quantity = "angle"  # ASSUMED: by its name', '# unit = "rad"', "; rad, deg"]),
        (
            "Acceleration",
            ['quantity = "acceleration"', '# unit = "m/s2"', "; m/s2, cm/s2, mm/s2, g"],
        ),
        ("Position", ['# unit = "mm"', "; m, cm, mm, um, rad, deg\n"]),  # may be an angle's
        ("Voltage (V)", ['# unit = "mm"', "its unit is V", "# scale = 1.0", "one V is"]),
        ("laser", ['# unit = "mm"', "the file gives no unit; m, cm, mm"]),
    ],
)
def test_a_name_says_which_units_there_are(tmp_path: Path, name: str, lines: list[str]) -> None:
    text = drafted(tmp_path, f"Time [s],{name}", made.TIMES, WAVE)
    assert [line for line in lines if line not in text] == []
    assert ("quantity" in text) == ("quantity" in lines[0])
    assert ("inertia" in text) == (name == "Angle")


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("Acceleration x", "acceleration"),
        ("Winkel", "angle"),
        ("Angular Velocity, Ch 1", "angular_velocity"),
        ("Gyro z", "angular_velocity"),
        ("Position", "displacement"),
        ("Angular position", "angle"),
        ("speedometer", None),
        ("x", None),
    ],
)
def test_quantities_by_name(name: str, quantity: str | None) -> None:
    assert named_quantity(name) == quantity


RELEASES = record(seed=3, duration=1.0).recordings


@pytest.mark.parametrize(
    ("samples", "said"),
    [
        (RELEASES[0].samples, "stop = true  # ASSUMED: half cycles to one side are"),
        (-RELEASES[0].samples, "stop = true  # ASSUMED: half cycles to one side are"),
        (None, "stop = false  # ASSUMED: half cycles to either side last alike"),
        (made.MM[:200] * 1e-3, "stop = true  # ASSUMED: the readings do not tell"),
    ],
)
def test_a_stop_is_what_readings_show(
    tmp_path: Path, samples: np.ndarray | None, said: str
) -> None:
    interval = 1e-3 if samples is not None and samples.size > 900 else 2e-3
    (tmp_path / "a.csv").write_text(csv(samples, interval=interval))
    CliRunner().invoke(main, ["new", str(tmp_path), str(tmp_path / "a.csv")])
    text = (tmp_path / "campaign.toml").read_text()
    assert said in text and ("case = " in text) == ("true  #" in said)


def test_of_a_velocity_readings_do_not_tell_and_a_case_says_that_there_is_a_stop(
    tmp_path: Path,
) -> None:
    text = drafted(tmp_path, "Time [s],v [mm/s]", made.TIMES, WAVE)
    assert "stop = true  # ASSUMED: the readings do not tell" in text
    (tmp_path / "campaign.toml").unlink()
    text = drafted(tmp_path, "Time [s],x [mm]", made.TIMES, WAVE, said=("--case", "soft"))
    assert "stop = true\n" in text and 'case = "soft"' in text


@pytest.mark.parametrize("ratio", [0.25, 0.5, 0.8])
def test_half_cycles_of_an_obstacle_without_a_gap(ratio: float) -> None:
    t = np.arange(4000) * 2.0 * np.pi * (1.0 + ratio) / 2.0 / 200.0
    phase = np.mod(t, np.pi * (1.0 + ratio))  # sin for pi, then a faster, smaller half cycle
    x = np.where(phase < np.pi, np.sin(phase), -ratio * np.sin((phase - np.pi) / ratio))
    x = x * np.exp(-0.01 * t) + 1e-3 * np.random.default_rng(1).standard_normal(t.size)
    share = shortened(x)
    # the median halves the time, and so what is to be seen of the difference
    assert share is not None and share == pytest.approx((1.0 - ratio) / 2.0, abs=0.03)
    still = shortened(
        np.exp(-0.01 * t) * np.sin(t) + 1e-2 * np.random.default_rng(1).standard_normal(t.size)
    )
    assert still is not None and still < 0.03


@pytest.mark.parametrize("per_period", [10, 15, 20])
def test_half_cycles_of_few_samples_without_an_obstacle_last_alike(per_period: int) -> None:
    """Taken for the median of the readings, rest was 7 % of the amplitude off, and half cycles of
    one such decay in fifteen 5 % shorter to one side.
    """
    rng, found = np.random.default_rng(0), list[float]()
    for _ in range(100):
        n = np.arange(int(per_period * rng.uniform(6, 15)))
        angle = 2 * np.pi * n / (per_period * rng.uniform(0.97, 1.03)) + rng.uniform(0, 6.28)
        x = np.exp(-rng.uniform(0, 0.2) * n / per_period) * np.cos(angle)
        found.append(shortened(x + 0.003 * rng.standard_normal(n.size)) or 0.0)
    assert max(found) < 0.03


@pytest.mark.parametrize("over", [4.0, 8.0])
@pytest.mark.parametrize("per_period", [8, 20])
def test_noise_that_moves_half_cycles_is_no_obstacle(per_period: int, over: float) -> None:
    """One such decay in five was called shorter to one side by a twentieth and more."""
    rng, found = np.random.default_rng(3), list[float]()
    for _ in range(100):
        n = np.arange(int(per_period * rng.uniform(6, 15)))
        angle = 2 * np.pi * n / (per_period * rng.uniform(0.97, 1.03)) + rng.uniform(0, 6.28)
        x = np.exp(-rng.uniform(0, 0.2) * n / per_period) * np.cos(angle)
        found.append(shortened(x + rng.standard_normal(n.size) / over) or 0.0)
    assert sum(share > 0.05 for share in found) <= 2
