"""The bundled campaign is what its command makes, and what its README says."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.read import load_campaign
from bayesimpact.trial.bundle import PAPER_RIG, main
from bayesimpact.trial.rig.recordings import Release, motion


def test_paper_folder_is_made_again_bit_for_bit(tmp_path):
    main(["paper", "--out", str(tmp_path)])
    stored = bundled_campaign("paper")
    made = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    assert made == {file.name: file.read_bytes() for file in stored.iterdir()}
    assert sum(map(len, made.values())) < 1_500_000


def test_paper_folder_holds_what_is_said_of_it():
    campaign = load_campaign(bundled_campaign("paper"))
    names = [f"case{case}_{letter}" for case in "123" for letter in "abc"]
    assert [r.name for r in campaign.recordings] == names
    assert campaign.cases == ("1", "2", "3")
    assert campaign.mass == 0.503
    for recording in campaign.recordings:
        assert recording.samples.size == 6000
        assert recording.interval == pytest.approx(1e-3, rel=1e-12)
        height = {"a": -6.5e-3, "b": -5e-3, "c": -4e-3}[recording.name[-1]]
        assert abs(recording.samples[0] - height) < 0.3e-3
    stiffness = [campaign.beams[case].stiffness for case in campaign.cases]
    assert stiffness == pytest.approx([5276.3, 4622.0, 3000.8], rel=2e-5)  # Table 1


def test_noise_of_paper_campaign_is_white_and_5_um():
    """Third differences remove the motion far from the noise's own level."""
    campaign = load_campaign(bundled_campaign("paper"))
    tails = [np.diff(r.samples[4000:], 3) for r in campaign.recordings]
    variance = np.mean([np.mean(tail**2) for tail in tails]) / 20  # 1 + 9 + 9 + 1
    # relative standard error of a variance from 9 x 2000 correlated third differences: about 2 %
    assert np.sqrt(variance) == pytest.approx(5e-6, rel=0.04)


def test_touches_of_the_paper_rig_become_weaker_and_cease():
    run = motion(PAPER_RIG, Release("r", "1", -6.5e-3), rate=1000, duration=6)
    assert 25 < len(run.onsets) < 40
    assert len(run.ends) == len(run.onsets)
    assert all(a < b for a, b in pairwise(run.onsets))
    assert run.onsets[-1] < 5.5
    assert run.displacement[-150:].max() < PAPER_RIG.g
