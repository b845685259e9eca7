"""What the rig writes is what `load_campaign` reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data.campaign import Campaign, Measurement, Smoothing
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.trial.bundle import PAPER_BEAMS, PAPER_RIG
from bayesimpact.trial.rig.files import write_campaign
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, make_campaign


@pytest.fixture(scope="module")
def campaign():
    releases = [Release("stiff a", "1", -5e-3), Release("soft", "3", -4e-3)]
    return make_campaign(
        'a "quoted" näme',
        PAPER_RIG,
        releases,
        chain=MeasuringChain(noise=5e-6),
        rate=1024,
        duration=1,
        rng=np.random.default_rng(0),
        measurement=Measurement(
            noise=5e-6, smoothing=Smoothing("savgol", 21, 2, declared_window=21)
        ),
        beams={case: PAPER_BEAMS[case] for case in ("1", "3")},
    )


def test_round_trip(tmp_path, campaign):
    write_campaign(tmp_path / "new", campaign, decimals=7, comment="one\ntwo")
    read = load_campaign(tmp_path / "new")
    assert (read.name, read.mass, read.stop) == (campaign.name, campaign.mass, True)
    assert read.cases == ("1", "3")
    assert read.measurement.noise == pytest.approx(5e-6, rel=1e-12)
    assert read.measurement.smoothing == campaign.measurement.smoothing
    for case, beam in campaign.beams.items():
        assert read.beams[case].stiffness == pytest.approx(beam.stiffness, rel=1e-12)
    for mine, theirs in zip(campaign.recordings, read.recordings, strict=True):
        assert (mine.name, mine.case) == (theirs.name, theirs.case)
        assert theirs.interval == pytest.approx(1 / 1024, rel=1e-9)
        assert np.abs(mine.samples - theirs.samples).max() <= 0.5001e-10
    lines = (tmp_path / "new" / "campaign.toml").read_text(encoding="utf-8").splitlines()
    assert lines[:2] == ["# one", "# two"]


def test_uncertainties_priors_and_lag_survive(tmp_path, campaign):
    known = Measurement(
        smoothing=Smoothing("lag", time_constant=2e-3), mass_sd=1e-3, clock_sd=2e-5, gain_sd=5e-3
    )
    priors = {"k2[1]": {"distribution": "normal", "mean": 5276.3, "sd": 500.0}}
    write_campaign(tmp_path, replace(campaign, measurement=known, priors=priors))
    read = load_campaign(tmp_path)
    assert read.measurement.smoothing == known.smoothing
    assert read.measurement.mass_sd == pytest.approx(1e-3, rel=1e-12)
    assert read.measurement.clock_sd == pytest.approx(2e-5, rel=1e-12)
    assert read.measurement.gain_sd == pytest.approx(5e-3, rel=1e-12)
    assert {k: dict(v) for k, v in read.priors.items()} == priors


def test_angles_without_a_stop(tmp_path):
    samples = 0.2 * np.cos(2 * np.pi * np.arange(400) / 100)
    pendulum = Recording("p", "", samples, interval=0.01, start=2.0, quantity="angle")
    write_campaign(tmp_path, Campaign("pendulum", 1.0, (pendulum,), stop=False))
    read = load_campaign(tmp_path)
    assert not read.stop
    assert read.recordings[0].quantity == "angle"
    assert read.recordings[0].start == pytest.approx(2.0)
    assert np.abs(read.recordings[0].samples - samples).max() <= 0.5001e-9
