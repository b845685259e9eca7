"""Headers of texts: names in quotes, units inside a name, names and units in comments."""

from __future__ import annotations

from pathlib import Path

import instrument_files as made
import numpy as np
import pytest
from campaigns import decay, write

from bayesimpact.data.fields import fields
from bayesimpact.data.read import load_campaign
from bayesimpact.data.readers.channel import name_and_unit
from bayesimpact.data.readers.formats import read_channels
from bayesimpact.data.readers.text import _cells
from bayesimpact.errors import InputError

ONE = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\n'


def channels(tmp_path: Path) -> list[str]:
    """Names and units that the file's columns are read with."""
    return [c.label for c in read_channels(tmp_path / "a.csv", (tmp_path / "a.csv").read_bytes())]


def read(tmp_path: Path, keys: str = "") -> np.ndarray:
    (recording,) = load_campaign(write(tmp_path, ONE + keys, a=None, b=None)).recordings
    assert recording.interval == pytest.approx(2e-3, rel=1e-6)
    return recording.samples


@pytest.mark.parametrize(
    ("line", "separator", "found"),
    [
        ("a,b", ",", ["a", "b"]),
        ('"Time","Angle, Ch 1+2 (rad)",B', ",", ["Time", "Angle, Ch 1+2 (rad)", "B"]),
        ('"a ""x"", b", c', ",", ["a x, b", "c"]),
        ('1;"2;3"', ";", ["1", "2;3"]),
        ('"Time (s)" "x (mm)"\t3', None, ["Time (s)", "x (mm)", "3"]),
        ('probe 5" [mm],probe 6" [mm]', ",", ["probe 5 [mm]", "probe 6 [mm]"]),  # inches
        ('"a,b,c', ",", ["a", "b", "c"]),  # damage
        ('"' + "a" * 200_000 + '",b', ",", ["a" * 200_000, "b"]),  # more than the library reads
    ],
)
def test_fields_are_those_of_csv(line: str, separator: str | None, found: list[str]) -> None:
    assert fields(line, separator) == found


@pytest.mark.parametrize(
    ("label", "found"),
    [
        ("Angle, Ch 1+2 (rad) Run #13", ("Angle, Ch 1+2 Run #13", "rad")),
        ("Position [mm] #2", ("Position #2", "mm")),
        ("Distance (centimeter)", ("Distance", "cm")),
        ("a [Gal]", ("a", "cm/s2")),
        ("Speed (tip) (mm/s) left", ("Speed (tip) left", "mm/s")),
        ("Position (left) of the tip", ("Position (left) of the tip", "")),
        ("f(m)ax", ("f(m)ax", "")),
    ],
)
def test_a_unit_may_be_followed_by_words(label: str, found: tuple[str, str]) -> None:
    assert name_and_unit(label) == found


def test_names_in_quotes_hold_separators(tmp_path: Path) -> None:
    head = '"Time (s)","Angle, Ch 1+2 (rad) Run #13"'
    made.text(head)(tmp_path / "a.csv")
    assert channels(tmp_path) == ["Time [s]", "Angle, Ch 1+2 Run #13 [rad]"]
    np.testing.assert_allclose(read(tmp_path), made.MM, rtol=1e-11)
    asked = 'column = "Angle, Ch 1+2 (rad) Run #13"\n'  # as the file has it
    np.testing.assert_allclose(read(tmp_path, asked), made.MM, rtol=1e-11)
    made.text('time_s,"laser, left tip"')(tmp_path / "a.csv")  # a file of this package's own kind
    keys = 'column = "laser, left tip"\nunit = "mm"\n'
    np.testing.assert_allclose(read(tmp_path, keys), decay(), rtol=1e-11)


def test_decimal_commas_in_quotes(tmp_path: Path) -> None:
    rows = [
        f'"{t:.6f}","{x:.12g}"'.replace(".", ",") for t, x in zip(made.TIMES, made.MM, strict=True)
    ]
    (tmp_path / "a.csv").write_text("\n".join(['"t [s]","x, tip [mm]"', *rows]) + "\n")
    np.testing.assert_allclose(read(tmp_path), decay(), rtol=1e-10)


@pytest.mark.parametrize("mark", ["#", "# ", "% ", ""])
@pytest.mark.parametrize(
    ("units", "found"),
    [
        ("[s]\t[au]\t[s]\t[au]", ["Time A [s]", "Pos A [au]", "Time B [s]", "Pos B [au]"]),
        ("s\tau\ts\tau", ["Time A [s]", "Pos A [au]", "Time B [s]", "Pos B [au]"]),
        ("(ms)\t(mm)\t(s)\t(-)", ["Time A [ms]", "Pos A [mm]", "Time B [s]", "Pos B"]),
    ],
)
def test_names_and_units_in_rows_of_their_own(
    tmp_path: Path, mark: str, units: str, found: list[str]
) -> None:
    rows = [
        f"{t:.3f}\t{x:.4f}\t{t + 0.025:.3f}\t450" for t, x in zip(made.TIMES, made.MM, strict=True)
    ]
    head = [
        "Creator: eventBuffer",
        "Creation time: Mon Mar  7 10:03:51 2022",
        "Time A\tPos A\tTime B\tPos B",
    ]
    lines = [mark + line for line in [*head, units]]
    (tmp_path / "a.csv").write_text("\n".join([*lines, *rows]) + "\n")
    assert channels(tmp_path) == found


def test_names_of_two_rows_without_units_are_those_of_the_last(tmp_path: Path) -> None:
    made.text("# first,release", "# t,laser")(tmp_path / "a.csv")
    assert channels(tmp_path) == ["t", "laser"]


@pytest.mark.parametrize(
    ("head", "keys"),
    [(["# time_s,displacement_mm"], ""), (["# by laser", "# t,laser"], 'unit = "mm"\n')],
)
def test_a_header_in_a_comment_is_one(tmp_path: Path, head: list[str], keys: str) -> None:
    made.text(*head)(tmp_path / "a.csv")
    np.testing.assert_allclose(read(tmp_path, keys), decay(), rtol=1e-11)


def test_a_comment_above_numbers_is_no_header(tmp_path: Path) -> None:
    made.text("# made by hand")(tmp_path / "a.csv")
    with pytest.raises(InputError, match="in place of the header row"):
        read(tmp_path, 'unit = "mm"\n')


@pytest.mark.parametrize(("cells", "read"), [
    (('0.001', '"1,234"'), ["0.001", "1,234"]),  # thousands beside decimal points
    (('"0,001"', '"1,234"'), ["0.001", "1.234"]),
    (('1', '"knock, loud"'), ["1", "knock, loud"]),
])  # fmt: skip
def test_a_comma_in_quotes_is_a_decimal_one_only_where_numbers_have_no_point(
    cells: tuple[str, ...], read: list[str]
) -> None:
    rows, _ = _cells(["a,b", *[",".join(cells)] * 4], 0)
    assert rows[-1] == read
