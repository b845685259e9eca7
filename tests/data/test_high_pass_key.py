"""`high_pass_hz` at every door."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from campaigns import TOML, csv, decay, write

import bayesimpact as bi
from bayesimpact.errors import InputError

SECOND = "high_pass_hz = 0.35\n"  # TOML ends with the second recording's entry


def test_it_belongs_to_its_recording(tmp_path: Path) -> None:
    campaign = bi.load(write(tmp_path, TOML + SECOND))
    assert [r.high_pass for r in campaign.recordings] == [0.0, 0.35]
    again = bi.Campaign.from_arrays(campaign.recordings, name="rig", mass_kg=0.503)
    assert [r.high_pass for r in again.recordings] == [0.0, 0.35]


def test_arrays_may_state_it() -> None:
    entry = {"name": "a", "samples": decay(), "unit": "m", "sample_rate_hz": 500.0}
    made = bi.Campaign.from_arrays(
        [{**entry, "high_pass_hz": np.float64(0.2)}], name="rig", mass_kg=0.5, stop=False
    )
    assert made.recordings[0].high_pass == 0.2
    with pytest.raises(InputError, match="below half the sampling rate, 250 Hz"):
        bi.Campaign.from_arrays(
            [{**entry, "high_pass_hz": 300.0}], name="rig", mass_kg=0.5, stop=False
        )


def test_half_the_rate_is_that_of_the_true_clock(tmp_path: Path) -> None:
    toml = TOML + "high_pass_hz = 200.0\nclock_ratio = 2.0\n"
    with pytest.raises(InputError, match="below half the sampling rate, 125 Hz"):
        bi.load(write(tmp_path, toml))


def test_its_state_may_have_a_prior(tmp_path: Path) -> None:
    prior = '[priors]\nhigh_pass_state = { distribution = "normal", mean = 0.0, sd = 1e-4 }\n'
    campaign = bi.load(write(tmp_path, TOML + SECOND + prior))
    assert set(campaign.priors) == {"high_pass_state"}
    with pytest.raises(InputError, match="no parameter of this campaign"):
        bi.load(write(tmp_path, TOML + prior))


def test_a_part_of_a_recording_keeps_it(tmp_path: Path) -> None:
    campaign = bi.load(write(tmp_path, TOML + SECOND, b=csv(decay(900))))
    assert campaign.recordings[1].part(10, 500).high_pass == 0.35
    assert replace(campaign.recordings[1], samples=np.zeros(3)).high_pass == 0.35
