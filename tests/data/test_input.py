"""A measured input beside a recording: read, cut, kept, and refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaigns import decay

import bayesimpact as bi
from bayesimpact.data.input import Input
from bayesimpact.errors import InputError

INTERVAL = 2e-3
FORCE = 3.0 * np.sin(np.arange(600) * 0.07) + 0.5
TOML = """name = "rig"
mass_kg = 0.503
stop = false

[[recording]]
file = "a.csv"
"""


def _rows(*columns: np.ndarray) -> str:
    return "\n".join(",".join(f"{x:.12g}" for x in row) for row in zip(*columns, strict=True))


def _load(folder: Path, keys: str, header: str = "time_s,displacement_m,force") -> bi.Campaign:
    (folder / "campaign.toml").write_text(TOML + keys)
    times = np.arange(600) * INTERVAL
    (folder / "a.csv").write_text(header + "\n" + _rows(times, decay(), FORCE) + "\n")
    return bi.load(folder)


def _only(campaign: bi.Campaign) -> tuple[np.ndarray, Input]:
    (recording,) = campaign.recordings
    assert recording.input is not None
    return recording.samples, recording.input


def test_a_column_becomes_the_input(tmp_path: Path) -> None:
    _, given = _only(_load(tmp_path, 'input = { column = "force", kind = "force_N" }'))
    np.testing.assert_allclose(given.samples, FORCE, rtol=1e-11)
    assert not given.free and not given.samples.flags.writeable


@pytest.mark.parametrize(
    ("header", "kind", "factor"),
    [
        ("Time [s],Weg [mm],Kraft [kN]", "force_N", 1e3),
        ("Time [s],Weg [mm],base [mm]", "base_m", 1e-3),
        ("Time [s],Weg [mm],acc [g]", "base_m_s2", 9.80665),
        ("Time [s],Weg [mm],acc [V]", "base_m_s2", 1.0),
        ("Time [s],Winkel [deg],table [deg]", "base_m", np.pi / 180.0),
        ("Time [s],Winkel [deg],driver [rad]", "force_N", 1.0),  # by a spring: the gain is free
    ],
)
def test_units_of_the_file(tmp_path: Path, header: str, kind: str, factor: float) -> None:
    keys = f'column = 2\ninput = {{ column = 3, kind = "{kind}", scale = -2.0, gain = "free" }}'
    _, given = _only(_load(tmp_path, keys, header))
    np.testing.assert_allclose(given.samples, -2.0 * factor * FORCE, rtol=1e-11)
    assert given.free


def test_start_end_exclusion_and_clock_act_on_both(tmp_path: Path) -> None:
    keys = (
        'input = { column = "force", kind = "force_N", remove_mean = true }\n'
        "start_s = 0.1\nend_s = 1.0\nexclude_s = [[0.5, 0.52]]\nclock_ratio = 1.001\n"
    )
    campaign = _load(tmp_path, keys)
    samples, given = _only(campaign)
    part = FORCE[50:501]
    assert samples.size == 451
    np.testing.assert_allclose(given.samples, part - part.mean(), atol=1e-11)
    assert campaign.recordings[0].used is not None
    assert _only(campaign.truncated(0.2))[1].samples.size == 100
    later = campaign.recordings[0].part(7, 31)
    assert later.input is not None
    np.testing.assert_array_equal(later.input.samples, given.samples[7:31])


def test_resampling_acts_on_both(tmp_path: Path) -> None:
    times = np.sort(np.random.default_rng(1).uniform(0.0, 1.2, 900))
    motion, force = 6e-3 * np.cos(40.0 * times), np.sin(9.0 * times)
    (tmp_path / "campaign.toml").write_text(
        TOML + 'resample = true\ninput = { column = "force", kind = "force_N" }'
    )
    text = "time_s,displacement_m,force\n" + _rows(times, motion, force)
    (tmp_path / "a.csv").write_text(text)
    campaign = bi.load(tmp_path)
    samples, given = _only(campaign)
    even = campaign.recordings[0].start + campaign.recordings[0].times
    used = campaign.recordings[0].used
    assert given.samples.size == samples.size
    kept = slice(None) if used is None else used
    np.testing.assert_allclose(given.samples[kept], np.sin(9.0 * even)[kept], atol=1e-3)


@pytest.mark.parametrize(
    ("header", "keys", "words"),
    [
        (
            "Time [s],Weg [mm],driver [rad]",
            'kind = "force_N"',
            'N, kN, mN, or any with gain = "free"',
        ),
        ("Time [s],Weg [mm],table [deg]", 'kind = "base_m"', "a base in deg beside a displacement"),
        ("Time [s],Winkel [deg],table [mm]", 'kind = "base_m"', "a base in mm beside an angle"),
    ],
)
def test_units_that_are_not_those_of_the_motion(
    tmp_path: Path, header: str, keys: str, words: str
) -> None:
    keys = f"column = 2\ninput = {{ column = 3, {keys}"
    with pytest.raises(InputError) as caught:
        _load(tmp_path, keys + " }", header)
    assert words in str(caught.value)
    campaign = _load(tmp_path, keys + ', gain = "free" }', header)
    assert _only(campaign)[1].free
    taken = ("a, input 3: rad, taken as N; its gain is free",)
    assert campaign.scaled == (taken if "force_N" in keys else ())


@pytest.mark.parametrize("kind", ["force_N", "base_m", "base_m_s2"])
def test_saved_and_in_memory(tmp_path: Path, kind: str) -> None:
    entry: dict[str, Any] = {
        "name": "a", "samples": decay(), "unit": "m", "sample_rate_hz": 500.0,
        "input": {"samples": FORCE, "kind": kind, "gain": "free"},
    }  # fmt: skip
    made = bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.503, stop=False)
    again = bi.Campaign.from_arrays(made.recordings, name="rig", mass_kg=0.503, stop=False)
    made.save(tmp_path / "saved")
    for campaign in (made, again, bi.load(tmp_path / "saved")):
        _, given = _only(campaign)
        assert (given.kind, given.free) == (kind, True)
        np.testing.assert_array_equal(given.samples, FORCE)


def test_a_frame_with_an_input() -> None:
    frame = pd.DataFrame({"time_s": np.arange(600) * INTERVAL, "y": decay(), "u": FORCE})
    entry = {"column": "y", "unit": "m", "input": {"column": "u", "kind": "force_N"}}
    made = bi.Campaign.from_dataframe(
        frame, name="rig", mass_kg=0.503, stop=False, recordings=[entry]
    )
    np.testing.assert_array_equal(_only(made)[1].samples, FORCE)


def test_force_of_a_moving_base() -> None:
    times = np.arange(400) * 1e-3
    base = 2e-3 * np.sin(30.0 * times)
    exact = 0.5 * 2e-3 * 900.0 * np.sin(30.0 * times)
    of_place = Input(base, "base_m").force(0.5, 1e-3)
    of_acceleration = Input(-900.0 * base, "base_m_s2").force(0.5, 1e-3)
    np.testing.assert_allclose(of_acceleration, exact, atol=1e-14)
    np.testing.assert_allclose(of_place[10:-10], exact[10:-10], atol=1e-7)


@pytest.mark.parametrize("share", [0.05, 0.15, 0.3])
def test_a_band_limited_input_keeps_its_amplitude(share: float) -> None:
    """Seen through lines between samples, whose own loss is sinc2."""
    angle = 2.0 * np.pi * share * np.arange(400)
    force = Input(np.sin(angle), band_limited=True).force(1.0, 1e-3)
    inner = slice(50, -50)
    basis = np.column_stack([np.sin(angle), np.cos(angle)])[inner]
    found = np.linalg.lstsq(basis, force[inner], rcond=None)[0] * np.sinc(share) ** 2
    np.testing.assert_allclose(found, [1.0, 0.0], atol=3e-3)
    constant = Input(np.full(400, 2.0), band_limited=True).force(1.0, 1e-3)
    np.testing.assert_allclose(constant, 2.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('input = { column = "power", kind = "force_N" }', ("power", "force")),
        ('input = { column = "force", kind = "force" }', ("input, key kind", "force_N")),
        ('input = { column = "force" }', ("key kind", "nothing")),
        ('input = { kind = "force_N" }', ("key column", "nothing")),
        ('input = { column = "force", kind = "force_N", gian = 2 }', ("gian", "gain")),
        ('input = { column = "force", kind = "force_N", scale = 0.0 }', ("key scale", "0")),
        ("input = 3", ("key input", "column")),
    ],
)
def test_refusals(tmp_path: Path, keys: str, words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refusal:
        _load(tmp_path, keys)
    assert all(word in str(refusal.value) for word in words), str(refusal.value)


def test_an_input_that_never_changes_and_a_coarse_base() -> None:
    entry: dict[str, Any] = {
        "name": "a",
        "samples": decay(),
        "unit": "m",
        "sample_rate_hz": 500.0,
    }
    rng = np.random.default_rng(3)
    for given, words in (
        ({"samples": np.ones(600), "kind": "force_N"}, "changes"),
        ({"samples": rng.standard_normal(600), "kind": "base_m"}, "coarsely"),
        ({"samples": np.ones(599), "kind": "force_N"}, "599"),
    ):
        with pytest.raises(InputError, match=words):
            bi.Campaign.from_arrays(
                [{**entry, "input": given}], name="rig", mass_kg=0.5, stop=False
            )


@pytest.mark.parametrize("unit", ["m/s", "m/s2", "mm/s", "g"])
def test_velocities_and_accelerations_beside_an_input(unit: str, tmp_path: Path) -> None:
    entry: dict[str, Any] = {
        "name": "a", "samples": decay(), "unit": unit, "sample_rate_hz": 500.0,
        "input": {"samples": FORCE, "kind": "force_N"},
    }  # fmt: skip
    made = bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False)
    made.save(tmp_path)
    again = bi.load(tmp_path)
    assert made.recordings[0].quantity == again.recordings[0].quantity != "displacement"
    np.testing.assert_array_equal(again.recordings[0].samples, made.recordings[0].samples)


ABSOLUTE = [("m", "base_m"), ("m/s", "base_m"), ("m/s2", "base_m"), ("g", "base_m_s2")]


@pytest.mark.parametrize(("unit", "kind"), ABSOLUTE)
def test_a_probe_that_reads_the_motion_in_space(unit: str, kind: str, tmp_path: Path) -> None:
    base = {"samples": 1e-3 * FORCE, "kind": kind, "absolute": True}
    entry = {"name": "a", "samples": decay(), "unit": unit, "sample_rate_hz": 500.0, "input": base}
    made = bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False)
    made.save(tmp_path)
    copied = bi.Campaign.from_arrays(made.recordings, name="rig", mass_kg=0.5, stop=False)
    for campaign in (made, copied, bi.load(tmp_path)):
        (recording,) = campaign.recordings
        given = _only(campaign)[1]
        assert given.absolute and not recording.is_displacement
        added = given.carried(recording.interval, recording.order)
        angle = np.arange(600) * 0.07
        exact = {0: 3e-3 * np.sin(angle) + 5e-4, 1: 0.105 * np.cos(angle)}.get(recording.order)
        if exact is None:
            exact = -3.675 * np.sin(angle) if kind == "base_m" else 1e-3 * FORCE
        np.testing.assert_allclose(added[10:-10], exact[10:-10], atol=2e-5)


@pytest.mark.parametrize(
    ("unit", "kind", "accepted"),
    [("m/s2", "force_N", "base_m"), ("m", "base_m_s2", "acceleration"), ("m/s", "base_m_s2", "m")],
)
def test_a_motion_in_space_that_the_base_does_not_tell(unit: str, kind: str, accepted: str) -> None:
    base = {"samples": FORCE, "kind": kind, "absolute": True}
    entry = {"name": "a", "samples": decay(), "unit": unit, "sample_rate_hz": 500.0, "input": base}
    with pytest.raises(InputError) as refusal:
        bi.Campaign.from_arrays([entry], name="rig", mass_kg=0.5, stop=False)
    words = str(refusal.value)
    assert "key absolute" in words and kind in words and accepted in words


def test_a_key_absolute_of_another_type(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="key absolute"):
        _load(tmp_path, 'input = { column = "force", kind = "base_m", absolute = "yes" }')
