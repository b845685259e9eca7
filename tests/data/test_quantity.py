"""Velocities and accelerations in campaign.toml, in files and in memory."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.draft import DraftedRig, draft, looks_at
from bayesimpact.data.quantity import QUANTITIES, reading_unit, unit_of
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError

T = np.arange(400) / 1000.0
WAVE = np.exp(-0.5 * T) * np.cos(2 * np.pi * 12.0 * T)


def written(folder, header, values, entry="", name="a.csv", top=""):
    folder.mkdir(exist_ok=True)
    rows = "\n".join(f"{t:.6f},{x:.9g}" for t, x in zip(T, values, strict=True))
    (folder / name).write_text(f"{header}\n{rows}\n" if header else rows + "\n")
    toml = f'name = "t"\nmass_kg = 0.5\nstop = false\n{top}[[recording]]\nfile = "{name}"\n{entry}'
    (folder / "campaign.toml").write_text(toml)
    return folder


@pytest.mark.parametrize(
    ("column", "quantity", "factor"),
    [
        ("velocity_m_s", "velocity", 1.0),
        ("velocity_mm_s", "velocity", 1e-3),
        ("acceleration_m_s2", "acceleration", 1.0),
        ("acceleration_mm_s2", "acceleration", 1e-3),
        ("acceleration_g", "acceleration", 9.80665),
        ("angular_velocity_rad_s", "angular_velocity", 1.0),
        ("angular_velocity_deg_s", "angular_velocity", np.pi / 180),
        ("displacement_mm", "displacement", 1e-3),
    ],
)
def test_columns_say_what_they_hold(tmp_path, column, quantity, factor):
    for key in ("", f'quantity = "{quantity}"\n'):
        campaign = load_campaign(written(tmp_path, f"time_s,{column}", WAVE, key))
        (recording,) = campaign.recordings
        assert recording.quantity == quantity and recording.unit == unit_of(quantity)
        np.testing.assert_allclose(recording.samples, WAVE * factor, rtol=1e-8)
    keys = f'column = 2\ntime_column = 1\nunit = "{column_unit(column)}"\n'  # no header at all
    campaign = load_campaign(written(tmp_path / "bare", "", WAVE, keys, "a.lvm"))
    assert campaign.recordings[0].quantity == quantity
    np.testing.assert_allclose(campaign.recordings[0].samples, WAVE * factor, rtol=1e-8)


def column_unit(column):
    tail = column.split("_", 2 if column.startswith("angular") else 1)[-1]
    return tail.replace("_", "/", 1)


def test_a_label_in_brackets_and_a_choice_by_quantity(tmp_path):
    folder = tmp_path / "two"
    folder.mkdir()
    rows = "\n".join(f"{t:.6f},{x:.9g},{2 * x:.9g}" for t, x in zip(T, WAVE, strict=True))
    (folder / "a.txt").write_text(f"Time [s],Laser (mm/s),Acc [m/s^2]\n{rows}\n")
    for quantity, factor in (("velocity", 1e-3), ("acceleration", 2.0)):
        entry = 'name = "t"\nmass_kg = 1\nstop = false\n[[recording]]\nfile = "a.txt"\n'
        entry = entry.replace("mass_kg = 1\n", "mass_kg = 1.0\n")
        (folder / "campaign.toml").write_text(entry + f'quantity = "{quantity}"\n')
        (recording,) = load_campaign(folder).recordings
        np.testing.assert_allclose(recording.samples, WAVE * factor, rtol=1e-8)
    made = draft("t", looks_at(folder, [folder / "a.txt"]), DraftedRig(mass=1.0, stop=False))
    assert 'quantity = "velocity"' in made.toml and not made.needed


def test_what_contradicts_itself_is_refused(tmp_path):
    cases = {
        "one": ("time_s,velocity_mm_s", 'quantity = "acceleration"\n', "key quantity"),
        "two": ("time_s,velocity_mm_s", 'unit = "g"\n', "column velocity_mm_s"),
        "three": ("time_s,x", 'unit = "m/s"\nquantity = "displacement"\n', "key quantity"),
        "four": ("time_s,velocity_mm_s", 'quantity = "speed"\n', "key quantity"),
    }
    for name, (header, entry, where) in cases.items():
        with pytest.raises(InputError) as refused:
            load_campaign(written(tmp_path / name, header, WAVE, entry))
        assert where in str(refused.value)
    noise = "[measurement]\nnoise_um = 5.0\n"
    with pytest.raises(InputError, match=r"noise_um.*velocity.*estimated"):
        load_campaign(written(tmp_path / "five", "time_s,velocity_mm_s", WAVE, top=noise))


def test_quantities_may_be_mixed_but_not_lines_and_angles():
    def entry(name, unit):
        return {"name": name, "samples": WAVE, "unit": unit, "sample_rate_hz": 1000.0}

    campaign = Campaign.from_arrays(
        [entry("a", "mm"), entry("b", "mm/s"), entry("c", "g")], name="t", mass_kg=1.0, stop=False
    )
    assert campaign.mixed and [r.order for r in campaign.recordings] == [0, 1, 2]
    with pytest.raises(InputError, match=r"an angular velocity.*along a line"):
        Campaign.from_arrays(
            [entry("a", "mm"), entry("b", "rad/s")], name="t", mass_kg=1.0, stop=False
        )


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_saved_campaign_is_the_same(tmp_path, quantity):
    entry = {"name": "a", "samples": WAVE, "unit": unit_of(quantity), "sample_rate_hz": 1000.0}
    campaign = Campaign.from_arrays([entry], name="t", mass_kg=1.0, stop=False)
    campaign.save(tmp_path / "saved")
    again = load_campaign(tmp_path / "saved")
    assert again.recordings[0].quantity == quantity
    np.testing.assert_array_equal(again.recordings[0].samples, WAVE)


@pytest.mark.parametrize(
    ("unit", "order", "expected"),
    [
        ("m", 0, "m"), ("m", 1, "m/s"), ("m", 2, "m/s2"), ("m/s", 1, "m/s2"), ("1/m", 1, "s/m"),
        ("1/m2", 2, "s4/m2"), ("Hz", 2, "Hz"), ("rad", 1, "rad"),
    ],
)  # fmt: skip
def test_units_of_what_acts_on_a_reading(unit, order, expected):
    assert reading_unit(unit, order) == expected
