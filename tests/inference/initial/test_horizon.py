"""Fits over growing stretches: past the side minima in which an ascent with everything ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.refits.refit import or_by_stretches
from bayesimpact.inference.fit import PosteriorDensity
from bayesimpact.inference.identify import identify
from bayesimpact.inference.initial.horizon import growing_horizon, shortened, stretches
from bayesimpact.inference.mode import find_mode


@pytest.fixture(scope="module")
def found():
    campaign = small_rig.record(duration=8.0, rate=500.0)
    return identify(campaign, rng=np.random.default_rng(1), search=False)


def started_at(density: PosteriorDensity, mode: np.ndarray, name: str, factor: float) -> np.ndarray:
    """The mode with one parameter off by a factor."""
    theta = mode.copy()
    theta[density.oscillator.layout.index(name)] *= factor
    return theta


def test_cycles_that_were_lost_are_found_again(found):
    """50 cycles with impacts, and errors of frequency of some five of them.

    Which side minimum an ascent ends in hangs on rounding: counted over many starts.
    """
    density, mode = found.fit.density, found.fit.mode
    starts = [
        started_at(density, mode, name, factor)
        for name in ("k1", "k2[1]")
        for factor in (0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.5)
    ]
    direct = [find_mode(density, s) for s in starts]
    with_all = sum(f.reduced_chi2 < 2.0 for f in direct)
    over_stretches = sum(growing_horizon(density, s).reduced_chi2 < 2.0 for s in starts)
    assert over_stretches >= with_all + 4
    either = [or_by_stretches(f, s, None) for f, s in zip(direct, starts, strict=True)]
    assert sum(f.reduced_chi2 < 2.0 for f in either) >= over_stretches


def test_what_is_held_moves_only_with_the_whole_recordings(found):
    density = found.fit.density
    k1 = density.oscillator.layout.index("k1")
    start = started_at(density, found.fit.mode, "k1", 1.1)
    held = growing_horizon(density, start, fixed=[k1], max_iterations=0)
    free = growing_horizon(density, start, max_iterations=0)
    assert held.mode[k1] == start[k1]
    assert free.mode[k1] == pytest.approx(found.fit.mode[k1], rel=1e-2)


def test_stretches_double_and_cut_all_recordings_alike(found):
    density = found.fit.density
    durations = stretches(density.oscillator.campaign, found.fit.value("k1"))
    cycle = 2 * np.pi * np.sqrt(0.503 / found.fit.value("k1"))
    assert durations[0] == pytest.approx(3 * cycle) and durations[-1] < 0.75 * 8.0
    assert np.diff(np.log2(durations)) == pytest.approx(np.ones(len(durations) - 1))
    part = shortened(density, durations[0])
    assert part.oscillator.layout is density.oscillator.layout
    assert set(part.oscillator.counts) == {int(durations[0] * 500.0) + 1}
    longer = Recording("d", "", np.zeros(7000), 1e-3)  # 7 s: the longest recording decides
    campaign = density.oscillator.campaign.truncated(2.0)
    more = replace(campaign, recordings=(*campaign.recordings, longer))
    assert len(stretches(more, 808.0)) == 4 > len(stretches(campaign, 808.0)) == 2
