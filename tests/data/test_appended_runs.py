"""Texts to which a logger appended one recording after the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from campaigns import write
from click.testing import CliRunner

import bayesimpact as bi
from bayesimpact.cli import main
from bayesimpact.errors import InputError

HEAD = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "log.csv"\n'


def _log(path: Path, head: str, sizes: tuple[int, ...] = (120, 150), back: float = 1.0) -> None:
    """Decays of 1 Hz read 20 times a second; the clock falls back by this share of the first."""
    rows = [head] if head else []
    for i, size in enumerate(sizes):
        t = 0.05 * np.arange(size) + (1.0 - back) * 0.05 * sizes[0] * (i > 0)
        y = (20.0 - 5.0 * i) * np.exp(-0.1 * t) * np.cos(2 * np.pi * t)
        rows += [f"{a:.2f},{b:.4f}" for a, b in zip(t, y, strict=True)]
    path.write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize("head", ["", "Time [s],x [mm]", "time_s,displacement_mm"])
def test_each_run_is_a_block(tmp_path: Path, head: str) -> None:
    _log(tmp_path / "log.csv", head)
    said = [] if head else ["--unit", "mm"]
    result = CliRunner().invoke(main, ["new", str(tmp_path), str(tmp_path / "log.csv"), *said])
    assert result.exit_code == 0, result.output
    draft = (tmp_path / "campaign.toml").read_text()
    assert 'block = "run 1"  # ASSUMED: the first of several; others: run 2' in draft
    first = bi.load(tmp_path).recordings[0]
    assert (first.samples.size, first.samples[0]) == (120, pytest.approx(0.02))
    (tmp_path / "campaign.toml").write_text(draft.replace('"run 1"', '"run 2"'))
    second = bi.load(tmp_path).recordings[0]
    assert (second.samples.size, second.samples[0]) == (150, pytest.approx(0.015))
    assert second.interval == pytest.approx(0.05)


def test_a_file_of_several_runs_needs_a_block(tmp_path: Path) -> None:
    _log(tmp_path / "log.csv", "Time [s],x [mm]")
    with pytest.raises(InputError, match=r"x \[mm\] \(block run 1\), x \[mm\] \(block run 2\)"):
        bi.load(write(tmp_path, HEAD, a=None, b=None))


@pytest.mark.parametrize(("sizes", "back"), [((120, 150), 0.3), ((120, 5), 1.0)])
def test_a_clock_that_slips_back_begins_no_run(
    tmp_path: Path, sizes: tuple[int, int], back: float
) -> None:
    _log(tmp_path / "log.csv", "Time [s],x [mm]", sizes, back)
    with pytest.raises(InputError, match=r"line 122: found time running backwards"):
        bi.load(write(tmp_path, HEAD, a=None, b=None))
