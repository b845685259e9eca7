"""An uneven clock is refused, or resampled, alike whatever the file's format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pandas as pd
import pytest
import pyuff
import xarray as xr
from campaigns import write
from click.testing import CliRunner
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

import bayesimpact as bi
from bayesimpact.cli import main
from bayesimpact.data.clock import (
    FEW_STEPS,
    check_mean_rate,
    mean_rate,
    rounded_interval,
    taken_evenly,
)
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError

HEAD = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "{}"\n'


def _stamps() -> np.ndarray:
    """About 2 ms apart, with a gap of 25 intervals; five digits, so that every format holds all."""
    times = np.arange(600) * 2e-3 + np.random.default_rng(0).uniform(-4e-4, 4e-4, 600)
    times[300:] += 0.05
    return np.round(times + 0.001, 4)


TIMES = _stamps()
MM = np.round(-6.0 * np.exp(-0.15 * TIMES) * np.cos(2 * np.pi * 6.4 * TIMES), 6)


def _text(head: str) -> Callable[[Path], None]:
    rows = [f"{t!r},{x!r}" for t, x in zip(TIMES.tolist(), MM.tolist(), strict=True)]
    return lambda path: path.write_text("\n".join([head, *rows]) + "\n") and None


def _hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["time"], file["x_mm"] = TIMES, MM


def _uff(path: Path) -> None:
    said = pyuff.prepare_58(
        func_type=1, rsp_node=4, rsp_dir=3, ref_node=1, ref_dir=0, data=MM, x=TIMES,
        abscissa_spacing=0, abscissa_inc=0.0, abscissa_min=0.0, num_pts=MM.size,
        abscissa_spec_data_type=17, abscissa_axis_units_lab="s", ordinate_spec_data_type=8,
        ordinate_axis_units_lab="mm", id1="laser", ord_data_type=4, binary=0,
        orddenom_spec_data_type=0, z_axis_spec_data_type=0,
    )  # fmt: skip
    pyuff.UFF(str(path)).write_sets(said, "add")


def _tdms(path: Path) -> None:
    with TdmsWriter(str(path)) as writer:
        units = ({"unit_string": "s"}, {"unit_string": "mm"})
        pairs = zip(("time", "laser"), (TIMES, MM), units, strict=True)
        writer.write_segment([ChannelObject("log", *pair) for pair in pairs])


def _excel(path: Path) -> None:
    book = openpyxl.Workbook()
    for row in [("Time [s]", "x [mm]"), *zip(TIMES.tolist(), MM.tolist(), strict=True)]:
        book.active.append(row)
    book.save(path)


def _netcdf(path: Path) -> None:
    time = ("time", TIMES, {"units": "s"})
    data = xr.Dataset({"x": ("time", MM, {"units": "mm"})}, coords={"time": time})
    data.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


def _parquet(path: Path) -> None:
    pd.DataFrame({"Time [s]": TIMES, "x [mm]": MM}).to_parquet(path)


FILES: dict[str, Callable[[Path], None]] = {
    "a.mat": lambda path: savemat(path, {"time": TIMES, "x_mm": MM}),
    "a.h5": _hdf5,
    "a.uff": _uff,
    "a.tdms": _tdms,
    "a.lvm": _text("time_s,x_mm"),
    "a.xlsx": _excel,
    "a.nc": _netcdf,
    "a.parquet": _parquet,
    "a.npz": lambda path: np.savez(path, time=TIMES, x_mm=MM),
    "a.txt": _text("Time [s],x [mm]"),
}


def _read(folder: Path, name: str, keys: str = "resample = true\n") -> Recording:
    return bi.load(write(folder, HEAD.format(name) + keys, a=None, b=None)).recordings[0]


def _assert_alike(mine: Recording, other: Recording) -> None:
    assert mine.interval == pytest.approx(other.interval, rel=1e-12)
    assert mine.start == pytest.approx(other.start, abs=1e-12)
    np.testing.assert_allclose(mine.samples, other.samples, rtol=0, atol=1e-12)
    assert other.used is not None and mine.used is not None
    np.testing.assert_array_equal(mine.used, other.used)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("keys", ["", "start_s = 0.3\nend_s = 1.1\ninvert = true\n"])
def test_every_format_is_resampled_as_a_csv(tmp_path: Path, name: str, keys: str) -> None:
    _text("time_s,displacement_mm")(tmp_path / "a.csv")
    FILES[name](tmp_path / name)
    keys += "resample = true\n"
    _assert_alike(_read(tmp_path, name, keys), _read(tmp_path, "a.csv", keys))
    with pytest.raises(InputError, match="resample = true"):
        _read(tmp_path, name, "")


def _in_memory(times: np.ndarray, samples: np.ndarray) -> Recording:
    entry = {"name": "a", "samples": samples, "unit": "mm", "times_s": times, "resample": True}
    return bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False).recordings[0]


def test_missing_rows_of_an_even_clock_move_no_reading() -> None:
    """Written to its own interval, or finer: what is there keeps its place, the rest is set aside.

    The places are spread nearly as evenly as a slow clock's steps.
    """
    times = np.arange(1200) * 2e-3
    samples = -6.0 * np.exp(-0.15 * times) * np.cos(2 * np.pi * 6.4 * times)
    lost = [180, 511, 512, 823]
    kept = np.setdiff1d(np.arange(times.size), lost)
    for early in (0.0, 0.37e-3):
        read = _in_memory(np.round(times + early, 5)[kept], samples[kept])
        assert read.interval == pytest.approx(2e-3, rel=1e-6)
        assert read.used is not None and list(np.flatnonzero(~read.used)) == lost
        np.testing.assert_allclose(read.samples[kept], 1e-3 * samples[kept], rtol=0, atol=1e-15)


def test_rows_that_are_missing_by_chance_are_not_spread_evenly() -> None:
    """`FEW_STEPS` places of 6,000 keep within `EVENLY` in less than one draw of a hundred."""
    rng, alike = np.random.default_rng(0), 0
    for _ in range(300):
        kept = np.setdiff1d(np.arange(6000), rng.choice(np.arange(1, 5999), FEW_STEPS, False))
        times = 0.01 * kept
        alike += rounded_interval(times, np.diff(times)) is not None
    assert alike < 3


def test_stamps_of_a_slow_clock_lack_no_rows() -> None:
    """Milliseconds of a clock at 995 Hz: every two hundredth step is two."""
    times = np.arange(1200) / 995.0
    samples = -6.0 * np.exp(-0.15 * times) * np.cos(2 * np.pi * 6.4 * times)
    read = _in_memory(np.round(times, 3), samples)
    assert read.used is None and read.interval == pytest.approx(1 / 995.0, rel=1e-4)


@pytest.mark.parametrize(("rate", "digits"), [(120.0, 3), (160.0, 3), (12.5, 2)])
def test_an_even_clock_in_a_coarse_unit_needs_no_key(
    tmp_path: Path, rate: float, digits: int
) -> None:
    """120 Hz in milliseconds: up to 6 % of an interval off; stamps moved by two are refused."""
    times = np.arange(1200) / rate
    samples = -6.0 * np.exp(-0.15 * times) * np.cos(2 * np.pi * rate / 85.0 * times)

    def write(stamps: np.ndarray) -> None:
        rows = (f"{t:.{digits}f},{y:.6f}" for t, y in zip(stamps, samples, strict=True))
        (tmp_path / "a.csv").write_text("\n".join(["time_s,displacement_mm", *rows]) + "\n")

    write(times)
    read = _read(tmp_path, "a.csv", "")
    assert read.used is None and read.interval == pytest.approx(1 / rate, rel=1e-4)
    np.testing.assert_allclose(read.samples, 1e-3 * samples, rtol=0, atol=1e-9)
    moved = times.copy()
    moved[600:] += 2 * 10.0**-digits
    write(moved)
    with pytest.raises(InputError, match="resample = true"):
        _read(tmp_path, "a.csv", "")


@pytest.mark.parametrize("few", [1, 5, 8])
def test_few_readings_before_a_hole_tell_nothing(tmp_path: Path, few: int) -> None:
    """The mass was let go in it; eight readings may tell how it moved before."""
    times = np.concatenate([0.05 * np.arange(few), 2.25 + 0.05 * np.arange(120)])
    later = np.clip(times - 2.0, 0.0, None)
    samples = np.where(times < 2.0, 0.01, 3.0 * np.exp(-0.1 * later) * np.cos(4.5 * later))
    rows = (f"{t:.4f},{y:.5f}" for t, y in zip(times, samples, strict=True))
    (tmp_path / "a.csv").write_text("\n".join(["time_s,angle_rad", *rows]) + "\n")
    read = _read(tmp_path, "a.csv")
    assert read.start == pytest.approx(2.25 if few < 8 else 0.0, abs=0.03)
    (doubt,) = bi.load(tmp_path).doubts
    assert "no readings between" in doubt and "and 2.25 s" in doubt
    assert ("it is read from" in doubt) is (few < 8)


@pytest.mark.parametrize("stamps", ["slipped", "every tenth lost"])
def test_a_clock_that_is_not_even_is_no_rounded_one(tmp_path: Path, stamps: str) -> None:
    if stamps == "slipped":
        times = 2e-3 * np.arange(1200) + 1e-3 * (np.arange(1200) >= 500)
    else:
        times = 1e-2 * np.delete(np.arange(1200), np.s_[9::10])
    samples = -6.0 * np.exp(-0.15 * times) * np.cos(2 * np.pi * 6.4 * times)
    rows = (f"{t:.3f},{y:.6f}" for t, y in zip(times, samples, strict=True))
    (tmp_path / "a.csv").write_text("\n".join(["time_s,displacement_mm", *rows]) + "\n")
    with pytest.raises(InputError, match="resample = true"):
        _read(tmp_path, "a.csv", "")


def test_many_short_gaps_show_a_period_all_the_same(tmp_path: Path) -> None:
    times = np.arange(2000) / 500.0
    times = times[times % 0.2 < 0.15]
    samples = 3.0 * np.exp(-0.1 * times) * np.cos(2 * np.pi * 2.0 * times)
    rows = (f"{t:.4f},{y:.5f}" for t, y in zip(times, samples, strict=True))
    (tmp_path / "a.csv").write_text("\n".join(["time_s,displacement_mm", *rows]) + "\n")
    _read(tmp_path, "a.csv")
    result = CliRunner().invoke(main, ["check", str(tmp_path)])
    assert result.exit_code == 0 and " 0.5" in result.output


def test_samples_in_memory_are_resampled_as_a_csv(tmp_path: Path) -> None:
    _text("time_s,displacement_mm")(tmp_path / "a.csv")
    entry = {"name": "a", "samples": MM, "unit": "mm", "times_s": TIMES, "resample": True}
    made = bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False)
    _assert_alike(made.recordings[0], _read(tmp_path, "a.csv"))


def test_empty_cells_outside_the_window_end_the_even_clock(tmp_path: Path) -> None:
    rows = [f"{t!r},{x!r}" for t, x in zip(TIMES.tolist(), MM.tolist(), strict=True)]
    rows[550:] = [row.split(",")[0] + "," for row in rows[550:]]
    (tmp_path / "a.csv").write_text("Time [s],x [mm]\n" + "\n".join(rows) + "\n")
    recording = _read(tmp_path, "a.csv", "resample = true\nend_s = 1.1\n")
    assert recording.used is not None and 20 <= (~recording.used).sum() <= 26


@pytest.mark.parametrize("name", ["a.mat", "a.txt"])
def test_time_that_runs_backwards_names_its_place(tmp_path: Path, name: str) -> None:
    times = TIMES.copy()
    times[7] = times[5]
    if name == "a.mat":
        savemat(tmp_path / name, {"time": times, "x_mm": MM})
    else:
        rows = [f"{t!r},{x!r}" for t, x in zip(times.tolist(), MM.tolist(), strict=True)]
        (tmp_path / name).write_text("\n".join(["Time [s],x [mm]", *rows]))
    place = "sample 8" if name == "a.mat" else "line 9"
    with pytest.raises(InputError, match=f"{name}, {place}: found time that does not increase"):
        _read(tmp_path, name)


def _log(path: Path, head: str, late: bool) -> None:
    """A decay of 1 Hz read 20 times a second, stamped when a buffer was sent, or as it was read."""
    rng = np.random.default_rng(3)
    even = 0.05 * np.arange(300)
    stamps = 0.05 * np.cumsum(np.maximum(1.0 + 0.4 * rng.standard_normal(300), 0.1))
    taken = even if late else stamps
    mm = 20.0 * np.exp(-0.05 * taken) * np.cos(2 * np.pi * taken) + rng.normal(0.0, 0.05, 300)
    rows = (f"{t:.4f},{x:.4f}" for t, x in zip(stamps, mm, strict=True))
    path.write_text("\n".join([head, *rows]) + "\n")


@pytest.mark.parametrize("head", ["time_s,displacement_mm", "t,laser_mm"])
@pytest.mark.parametrize("late", [True, False])
def test_stamps_of_when_readings_arrived_are_no_clock(
    tmp_path: Path, head: str, late: bool
) -> None:
    _log(tmp_path / "log.csv", head, late)
    result = CliRunner().invoke(main, ["new", str(tmp_path / "c"), str(tmp_path / "log.csv")])
    assert result.exit_code == 0, result.output
    draft = (tmp_path / "c" / "campaign.toml").read_text()
    assert ("sample_rate_hz = " in draft, "resample = true" in draft) == (late, not late)
    read = bi.load(tmp_path / "c").recordings[0]
    t = read.interval * np.arange(read.samples.size)
    fit = 0.02 * np.exp(-0.05 * t) * np.cos(2 * np.pi * t * 0.05 / read.interval)
    as_written = bool(np.abs(read.samples - fit).max() < 3e-4)
    assert as_written is late


def test_readings_that_are_moved_to_stamps_of_a_buffer_are_doubted(tmp_path: Path) -> None:
    for late in (True, False):
        _log(tmp_path / "log.csv", "time_s,displacement_mm", late)
        folder = write(tmp_path, HEAD.format("log.csv") + "resample = true\n", a=None, b=None)
        doubts = " ".join(bi.load(folder).doubts)
        assert ("sample_rate_hz = " in doubts) is late


@pytest.mark.parametrize("caught_up", [False, True])
def test_a_gap_in_such_stamps_is_no_slower_rate(caught_up: bool) -> None:
    """Readings that a probe did not take, and readings that arrived late together."""
    rng = np.random.default_rng(5)
    taken = 0.05 * np.arange(300.0)
    if not caught_up:
        taken[100:] += 3.0
    stamps = taken + 0.01 * rng.standard_normal(300)
    if caught_up:
        held = (stamps > 5.0) & (stamps < 8.0)
        stamps[held] = 8.0 - 1e-3 * np.arange(held.sum())[::-1]
    assert mean_rate(stamps) == pytest.approx(20.0, rel=0.01)
    check_mean_rate("a.csv", stamps, 20.0)


def test_a_rate_that_such_stamps_contradict_is_refused(tmp_path: Path) -> None:
    _log(tmp_path / "log.csv", "time_s,displacement_mm", True)
    keys = HEAD.format("log.csv") + "sample_rate_hz = 25\n"
    with pytest.raises(InputError, match="agrees with the rows on the whole"):
        bi.load(write(tmp_path, keys, a=None, b=None))


def test_an_encoder_that_is_read_when_it_counts_keeps_its_stamps(tmp_path: Path) -> None:
    """Once taken for a triangle wave: its readings follow one another by even steps."""
    fine = np.linspace(0.0, 8.0, 80_001)
    counts = np.floor(200.0 * np.exp(-0.05 * fine) * np.cos(2 * np.pi * fine + 0.5)).astype(int)
    new = np.flatnonzero(np.diff(counts)) + 1
    rows = (f"{t:.6f},{c * 2.5e-3:.4f}" for t, c in zip(fine[new], counts[new], strict=True))
    (tmp_path / "log.csv").write_text("\n".join(["time_s,angle_rad", *rows]) + "\n")
    result = CliRunner().invoke(main, ["new", str(tmp_path), str(tmp_path / "log.csv")])
    assert result.exit_code == 0, result.output
    assert "resample = true" in (tmp_path / "campaign.toml").read_text()
    read = bi.load(tmp_path).recordings[0]
    t = read.start + read.interval * np.arange(read.samples.size)
    off = read.samples - 0.5 * np.exp(-0.05 * t) * np.cos(2 * np.pi * t + 0.5)
    assert read.used is not None and np.abs(off[read.used]).max() < 1.2 * 2.5e-3


def _intervals(rng: np.random.Generator, kind: str, count: int) -> np.ndarray:
    if kind == "jitter":
        return np.maximum(1.0 + rng.uniform(0.02, 0.4) * rng.standard_normal(count), 0.05)
    return 0.02 + rng.exponential(1.0, count)


@pytest.mark.parametrize("kind", ["jitter", "exponential"])
def test_a_clock_that_is_right_is_never_called_late(kind: str) -> None:
    """At 4 to 50 readings a period, of decays read at their stamps none; of others many."""
    rng, told = np.random.default_rng(7), {True: 0, False: 0}
    for draw in range(150):
        per_period, count = (4, 6, 10, 20, 50)[draw % 5], int(rng.integers(60, 400))
        stamps = np.cumsum(_intervals(rng, kind, count))
        stamps *= count / per_period / stamps[-1]
        for late, taken in ((False, stamps), (True, np.arange(count) / per_period)):
            decay = np.exp(-0.1 * taken) * np.cos(2 * np.pi * taken)
            noise = 10.0 ** rng.uniform(-4.0, -1.0) * rng.standard_normal(count)
            told[late] += taken_evenly(stamps, decay + noise)
    assert told[False] == 0
    assert told[True] > (40 if kind == "jitter" else 110)
