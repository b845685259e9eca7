"""Several channels of one motion: they share its initial state, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_rig
from channel_rigs import channels

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.channels import keepers
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.nuisances import nuisance_step

SHARED = ("c1", "k1", "g", "c2", "k2[1]", "k2[2]", "y0[a]", "v0[a]", "y0[c]")


def mode(campaign: Campaign, *, search: bool = False) -> Identification:
    return identify(campaign, rng=np.random.default_rng(0), search=search, evaluations=3000)


def test_two_channels_tell_more_than_one_and_hold_the_truth() -> None:
    truth, z = small_rig.true_values(offsets={}), []
    for seed in range(4):
        both = channels(seed)
        found, one = (
            mode(both, search=seed == 0).fit,
            mode(replace(both, recordings=both.recordings[:3])).fit,
        )
        assert found.converged and found.reduced_chi2 == pytest.approx(1.0, abs=0.15)
        assert found.mode.size == one.mode.size + 3  # rest readings of the accelerometers
        for name in SHARED:
            index, alone = found.names.index(name), one.names.index(name)
            assert found.sd[index] < 0.8 * one.sd[alone], name
            z.append((found.value(name) - truth[name]) / found.sd[index])
    assert np.abs(z).max() < 4.0 and 0.5 < np.std(z) < 1.5


def test_search_and_guess_agree() -> None:
    assert mode(channels(0), search=True).agree


def test_a_channel_whose_start_was_cut_off_has_a_state_of_its_own() -> None:
    campaign = channels(0)
    assert keepers(campaign.recordings) == ("a", "b", "c") * 2
    cut = (*campaign.recordings[:3], campaign.recordings[3].part(50, 1600))
    assert keepers(cut) == ("a", "b", "c", "a_acc")


def test_a_shared_step_solves_the_joined_equations() -> None:
    """Against least squares on all residuals at once."""
    rng = np.random.default_rng(1)
    columns = np.array([[0, 1, 2], [0, 1, 3]])
    jacobians, targets = rng.standard_normal((2, 20, 3)), rng.standard_normal((2, 20))
    whole = np.zeros((40, 4))
    whole[:20, columns[0]], whole[20:, columns[1]] = jacobians
    expected = np.linalg.lstsq(whole, targets.ravel(), rcond=None)[0]
    blocks = np.einsum("rni,rnj->rij", jacobians, jacobians)[None]
    right = np.einsum("rni,rn->ri", jacobians, targets)[None]
    found = nuisance_step(np.zeros((1, 4)), columns, blocks, right)
    assert found[0] == pytest.approx(expected, rel=1e-6)


def test_channels_are_written_and_read(tmp_path: Path) -> None:
    channels(0).save(tmp_path)
    read = load_campaign(tmp_path)
    assert keepers(read.recordings) == ("a", "b", "c") * 2
    assert [r.order for r in read.recordings] == [0, 0, 0, 2, 2, 2]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('case = "1"\nmotion = "b"', 'case = "1"\nmotion = "c"', 'accepted: case "2", as c'),
        ('case = "1"\nmotion = "a"', 'case = "1"\nmotion = "a"\nstart_s = 0.1', "where a begins"),
    ],
)
def test_channels_that_cannot_be_of_one_motion_are_refused(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    file = channels(0).save(tmp_path)
    head, tail = file.read_text().rsplit(old, 1)
    file.write_text(head + new + tail)
    with pytest.raises(InputError, match="key motion") as refused:
        load_campaign(tmp_path)
    assert message in str(refused.value)
