"""Campaigns that are accepted, in every variant."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numpy as np
import pytest
from campaigns import TOML, csv, decay, write

from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError

ONE = 'name = "rig"\nmass_kg = 0.5\nstop = false\n[[recording]]\nfile = "a.csv"\n'


def test_reads_what_the_files_say(tmp_path: Path) -> None:
    campaign = load_campaign(write(tmp_path))
    assert (campaign.name, campaign.mass, campaign.stop) == ("rig", 0.503, True)
    assert [(r.name, r.case) for r in campaign.recordings] == [("a", "1"), ("b", "2")]
    assert campaign.cases == ("1", "2")
    assert campaign.folder == tmp_path
    recording = campaign.recordings[0]
    assert recording.interval == pytest.approx(2e-3, rel=1e-12)
    assert (recording.start, recording.quantity, recording.unit) == (0.0, "displacement", "m")
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-11)
    with pytest.raises(ValueError, match="read-only"):
        recording.samples[0] = 0.0


def test_folder_file_and_text_path_are_the_same_campaign(tmp_path: Path) -> None:
    write(tmp_path)
    hashes = {
        load_campaign(p).sha256 for p in (tmp_path, tmp_path / "campaign.toml", str(tmp_path))
    }
    expected = b"".join((tmp_path / n).read_bytes() for n in ("campaign.toml", "a.csv", "b.csv"))
    assert hashes == {hashlib.sha256(expected).hexdigest()}


def test_hash_follows_every_file(tmp_path: Path) -> None:
    first = load_campaign(write(tmp_path)).sha256
    assert load_campaign(write(tmp_path, b=csv() + "# end\n")).sha256 != first
    assert load_campaign(write(tmp_path, TOML + "# end\n")).sha256 != first


def test_campaign_file_from_windows(tmp_path: Path) -> None:
    toml = b"\xef\xbb\xbf" + TOML.replace("\n", "\r\n").encode()
    assert load_campaign(write(tmp_path, toml)).cases == ("1", "2")


def test_integers_stand_for_numbers(tmp_path: Path) -> None:
    assert load_campaign(write(tmp_path, TOML.replace("0.503", "2"))).mass == 2.0


@pytest.mark.parametrize(
    ("header", "scale", "time_scale", "unit"),
    [
        ("time_s,displacement_m", 1.0, 1.0, "m"),
        ("time_s,displacement_cm", 1e2, 1.0, "m"),
        ("time_s,displacement_mm", 1e3, 1.0, "m"),
        ("time_ms,displacement_um", 1e6, 1e3, "m"),
        ("time_s,angle_rad", 1.0, 1.0, "rad"),
        ("time_ms,angle_deg", 180 / np.pi, 1e3, "rad"),
    ],
)
def test_units_become_si(
    tmp_path: Path, header: str, scale: float, time_scale: float, unit: str
) -> None:
    text = csv(header=header, scale=scale, time_scale=time_scale, start=0.1)
    (recording,) = load_campaign(write(tmp_path, ONE, a=text)).recordings
    assert recording.unit == unit
    assert recording.interval == pytest.approx(2e-3, rel=1e-9)
    assert recording.start == pytest.approx(0.1, rel=1e-9)
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-9)


BODY = csv(separator="|", header="time_s|displacement_m")
VARIANTS = {
    "byte order mark": b"\xef\xbb\xbf" + csv().encode(),
    "windows line ends": csv().replace("\n", "\r\n"),
    "old macintosh line ends": csv().replace("\n", "\r"),
    "no last line end": csv().rstrip("\n"),
    "empty lines at both ends": "\n\n" + csv() + "\n\n",
    "empty line below the header": csv().replace("\n", "\n\n", 1),
    "comments everywhere": "# first\n" + csv().replace("\n", "\n  # inside\n", 3) + "# last\n",
    "semicolons": BODY.replace("|", ";"),
    "tabs": BODY.replace("|", "\t"),
    "blanks": BODY.replace("|", "   "),
    "indented": BODY.replace("\n", "\n  ").replace("|", "  ").rstrip() + "\n",
    "spaces around": BODY.replace("|", " , "),
    "quoted names": csv().replace("time_s,displacement_m", '"time_s","displacement_m"'),
    "decimal commas, semicolons": BODY.replace(".", ",").replace("|", ";"),
    "decimal commas, tabs": BODY.replace(".", ",").replace("|", "\t"),
    "other order": "\n".join(",".join(row.split(",")[::-1]) for row in csv().split("\n")),
}


@pytest.mark.parametrize("content", VARIANTS.values(), ids=VARIANTS.keys())
def test_spellings_of_a_table(tmp_path: Path, content: str | bytes) -> None:
    (recording,) = load_campaign(write(tmp_path, ONE, a=content)).recordings
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-11)
    assert recording.interval == pytest.approx(2e-3, rel=1e-12)


def test_other_columns_may_hold_anything(tmp_path: Path) -> None:
    rows = csv().splitlines()
    text = "\n".join(["remark," + rows[0], *("n.a.," + row for row in rows[1:])])
    (recording,) = load_campaign(write(tmp_path, ONE, a=text)).recordings
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-11)


@pytest.mark.parametrize(
    ("header", "keys"),
    [
        ("time_s,laser", 'column = "laser"\nunit = "mm"'),
        ("time_s,laser", 'unit = "mm"'),
        ("time_s,displacement_mm", 'column = "displacement_mm"'),
        ("time_s,displacement_mm", 'unit = "mm"'),
    ],
)
def test_column_and_unit(tmp_path: Path, header: str, keys: str) -> None:
    text = csv(header=header, scale=1e3)
    (recording,) = load_campaign(write(tmp_path, f"{ONE}{keys}\n", a=text)).recordings
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-11)


def test_column_chooses_among_several(tmp_path: Path) -> None:
    rows = csv().splitlines()
    text = "\n".join([rows[0] + ",angle_rad", *(row + ",0.25" for row in rows[1:])])
    toml = ONE + 'column = "displacement_m"\n'
    (recording,) = load_campaign(write(tmp_path, toml, a=text)).recordings
    assert recording.quantity == "displacement"


def test_rate_in_place_of_a_time_column(tmp_path: Path) -> None:
    text = "displacement_m\n" + "\n".join(f"{v:.12g}" for v in decay())
    toml = ONE + "sample_rate_hz = 500\nstart_s = 0.1\n"
    (recording,) = load_campaign(write(tmp_path, toml, a=text)).recordings
    assert (recording.interval, recording.samples.size) == (2e-3, 550)
    assert recording.start == pytest.approx(0.1)
    np.testing.assert_allclose(recording.samples, decay()[50:], rtol=1e-11)


def test_rate_that_agrees_with_the_time_column(tmp_path: Path) -> None:
    (recording,) = load_campaign(write(tmp_path, ONE + "sample_rate_hz = 500.1\n")).recordings
    assert recording.interval == pytest.approx(2e-3, rel=1e-12)  # the column's, not the rounded key


def test_start_and_end_include_their_samples(tmp_path: Path) -> None:
    toml = ONE + "start_s = 5.2\nend_s = 5.8\n"
    (recording,) = load_campaign(write(tmp_path, toml, a=csv(start=5.0))).recordings
    np.testing.assert_allclose(recording.samples, decay()[100:401], rtol=1e-11)
    assert recording.start == pytest.approx(5.2)
    assert recording.times[0] == 0.0
    assert recording.duration == pytest.approx(0.6)


def test_unequal_lengths_and_rates(tmp_path: Path) -> None:
    other = csv(decay(1500, 1e-3), interval=1e-3, start=-0.3)
    first, second = load_campaign(write(tmp_path, b=other)).recordings
    assert (first.samples.size, second.samples.size) == (600, 1500)
    assert second.interval == pytest.approx(1e-3, rel=1e-9)
    assert second.start == -0.3


def test_files_elsewhere_only_where_their_folder_is_given(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    (data / "c.csv").write_text(csv())
    absolute, folder = (data / "c.csv").as_posix(), tmp_path / "campaign"
    for place in ("../data/c.csv", absolute):
        write(folder, TOML.replace("a.csv", place), a=None)
        assert load_campaign(folder, [data]).recordings[0].name == "c"
        with pytest.raises(InputError, match="leads out of the campaign's folder"):
            load_campaign(folder)
    write(folder, TOML.replace("a.csv", "link.csv"), a=None)
    (folder / "link.csv").symlink_to(data / "c.csv")
    with pytest.raises(InputError, match="leads out of the campaign's folder"):
        load_campaign(folder)
    assert load_campaign(folder, [tmp_path]).recordings[0].name == "link"


def test_measuring_chain(tmp_path: Path) -> None:
    toml = TOML.replace("mass_kg", "mass_uncertainty_kg = 0.001\nmass_kg") + (
        "[measurement]\nnoise_um = 5.0\n"
        "clock_uncertainty_ppm = 20\ngain_uncertainty_percent = 0.5\n"
        'smoothing = { kind = "savgol", window = 21, polyorder = 2 }\n'
    )
    chain = load_campaign(write(tmp_path, toml)).measurement
    assert chain.noise == pytest.approx(5e-6)
    assert chain.mass_sd == pytest.approx(0.001 / 0.503)
    assert (chain.clock_sd, chain.gain_sd) == (pytest.approx(20e-6), pytest.approx(5e-3))
    assert chain.smoothing is not None
    assert (chain.smoothing.window, chain.smoothing.polyorder) == (21, 2)


def test_even_span_loses_one_sample(tmp_path: Path) -> None:
    toml = TOML + '[measurement]\nsmoothing = { kind = "savgol", window = 20, polyorder = 2 }\n'
    smoothing = load_campaign(write(tmp_path, toml)).measurement.smoothing
    assert smoothing is not None
    assert (smoothing.window, smoothing.declared_window) == (19, 20)


def test_lag(tmp_path: Path) -> None:
    toml = TOML + '[measurement]\nsmoothing = { kind = "lag", time_constant_s = 0.001 }\n'
    smoothing = load_campaign(write(tmp_path, toml)).measurement.smoothing
    assert smoothing is not None
    assert (smoothing.kind, smoothing.time_constant) == ("lag", 0.001)


@pytest.mark.parametrize(
    ("key", "level"), [("noise_mrad = 2", 2e-3), ("noise_deg = 0.09", np.deg2rad(0.09))]
)
def test_noise_of_an_angle(tmp_path: Path, key: str, level: float) -> None:
    toml = f"{ONE}[measurement]\n{key}\n"
    campaign = load_campaign(write(tmp_path, toml, a=csv(header="time_s,angle_rad")))
    assert campaign.measurement.noise == pytest.approx(level)


def test_beams(tmp_path: Path) -> None:
    toml = TOML + (
        "[beam.1]\nlength_mm = 110\nwidth_mm = 20\nthickness_mm = 5\nyoungs_modulus_mpa = 2.1e5\n"
    )
    beam = load_campaign(write(tmp_path, toml)).beams["1"]
    assert (beam.length, beam.youngs_modulus) == (pytest.approx(0.11), pytest.approx(2.1e11))
    assert beam.stiffness == pytest.approx(3 * 2.1e11 * (0.02 * 0.005**3 / 12) / 0.11**3)


def test_priors(tmp_path: Path) -> None:
    toml = TOML + (
        "[priors]\n"
        'k1 = { distribution = "normal", mean = 800, sd = 50.0 }\n'
        'k2 = { distribution = "loguniform", lower = 100, upper = 1e5 }\n'
        '"k2[1]" = { distribution = "lognormal", median = 5e3, sigma = 0.3 }\n'
        '"y0[b]" = { distribution = "uniform", lower = -7e-3, upper = -3e-3 }\n'
        'coulomb_friction.force = { distribution = "halfnormal", scale = 1e-3 }\n'
        '"gap_wear.step" = { distribution = "halfnormal", scale = 1e-6 }\n'
    )
    priors = load_campaign(write(tmp_path, toml)).priors
    assert list(priors) == [
        "k1",
        "k2",
        "k2[1]",
        "y0[b]",
        "coulomb_friction.force",
        "gap_wear.step",
    ]
    assert dict(priors["k1"]) == {"distribution": "normal", "mean": 800.0, "sd": 50.0}
    with pytest.raises(TypeError):
        priors["k1"]["sd"] = 1.0  # type: ignore[index]


def test_case_is_idle_without_a_stop(tmp_path: Path) -> None:
    campaign = load_campaign(write(tmp_path, ONE + 'case = "x"\n'))
    assert campaign.cases == ()
    assert campaign.recordings[0].case == ""


def test_two_periods_are_enough_and_less_is_not(tmp_path: Path) -> None:
    period = 1 / 6.4
    for start in (0.0, 0.21, 0.4, 0.77):
        for periods, usable in ((1.9, False), (2.1, True), (3.3, True)):
            n = int(periods * period / 1e-3)
            samples = decay(2000, 1e-3)[int(start * 1e3) :][:n]
            write(tmp_path, ONE, a=csv(samples, interval=1e-3))
            if usable:
                assert load_campaign(tmp_path).recordings[0].samples.size == n
            else:
                with pytest.raises(InputError, match="fewer than two periods"):
                    load_campaign(tmp_path)


def _real_recordings() -> Path:
    beside = Path(__file__).resolve().parents[2].parent / "shared" / "recordings"
    return Path(os.environ.get("BAYESIMPACT_RECORDINGS", beside))


@pytest.mark.skipif(not _real_recordings().is_dir(), reason="the real recordings are not here")
@pytest.mark.parametrize(
    ("name", "sizes", "interval"), [("pendulum", [4600], 1e-3), ("ship_roll", [18663, 6665], 0.01)]
)
def test_real_recordings(name: str, sizes: list[int], interval: float) -> None:
    campaign = load_campaign(_real_recordings() / name)
    assert [r.samples.size for r in campaign.recordings] == sizes
    for recording in campaign.recordings:
        assert recording.quantity == "angle"
        assert recording.interval == pytest.approx(interval, rel=1e-8)


def test_damaged_files_load_or_are_refused(tmp_path: Path) -> None:
    """Random damage to any file ends in a campaign or in an InputError, in nothing else."""
    rng = np.random.default_rng(7)
    good = {"campaign": TOML + ALL_TABLES, "a": csv(decay(60, 0.01), interval=0.01)}
    scraps = [
        b"",
        b'"',
        b"[",
        b"]",
        b"=",
        b"\n",
        b",",
        b";",
        b".",
        b"-",
        b"\xff",
        b"9" * 400,
        b"{}",
    ]
    loaded = 0
    for trial in range(400):
        name = ("campaign", "a")[trial % 2]
        data = bytearray(good[name].encode())
        for _ in range(rng.integers(1, 4)):
            at = int(rng.integers(len(data)))
            data[at : at + int(rng.integers(0, 9))] = scraps[rng.integers(len(scraps))]
        files = {**good, name: bytes(data)}
        write(tmp_path, files["campaign"], a=files["a"], b=csv(decay(60, 0.01), interval=0.01))
        try:
            load_campaign(tmp_path)
            loaded += 1
        except InputError as error:
            assert str(tmp_path) in str(error)
    assert 0 < loaded < 200


ALL_TABLES = """
[measurement]
noise_um = 5
smoothing = { kind = "savgol", window = 5, polyorder = 2 }
[priors]
k1 = { distribution = "normal", mean = 800, sd = 50.0 }
[beam.1]
length_mm = 110
width_mm = 20
thickness_mm = 5
youngs_modulus_mpa = 2.1e5
"""
