"""Repeated readings of a motion that has died away count once; others all count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.find import set_aside
from bayesimpact.data.faults.tail import without_tail
from bayesimpact.data.recording import Recording
from bayesimpact.inference.identify import identify

STEP = 2e-3  # rad


def decay(step: float, noise: float, seed: int = 0, duration: float = 40.0) -> Recording:
    """A pendulum at 1 Hz and 100 Hz that is within a step of its rest from about 21 s on."""
    t = np.arange(0.0, duration, 0.01)
    y = 0.5 * np.exp(-0.29 * t) * np.cos(2 * np.pi * t) + 0.3 * step
    y = y + noise * np.random.default_rng(seed).standard_normal(t.size)
    samples = np.round(y / step) * step if step else y
    return Recording("swing", "", samples, 0.01, quantity="angle")


def test_the_tail_in_one_step_counts_once():
    whole = decay(STEP, 1e-4)
    kept, notice = without_tail(whole)
    assert kept.used is not None and notice is not None
    first = int(np.argmin(kept.used))
    assert notice.spans == ((first, 4000),) and f"{4000 - first} of 4000" in notice.statement
    assert not kept.used[first:].any() and kept.used[:first].all()
    assert 15.0 < first * 0.01 < 25.0
    np.testing.assert_array_equal(kept.samples, whole.samples)


@pytest.mark.parametrize(
    ("step", "noise", "duration"),
    [(0.0, 1e-3, 40.0), (STEP, 6e-3, 40.0), (STEP, 1e-4, 12.0)],
    ids=["no steps", "noise over steps", "still swinging"],
)
def test_other_recordings_stay_as_they_are(step, noise, duration):
    whole = decay(step, noise, duration=duration)
    assert without_tail(whole) == (whole, None)


def test_the_campaign_says_so_among_its_notices_and_has_no_fault():
    campaign = Campaign("swing", 1.0, (decay(STEP, 1e-4),), stop=False)
    cleaned, faults = set_aside(campaign)
    assert cleaned.recordings[0].used is not None and len(cleaned.notes) == 1
    assert all(f.action == "notice" for f in faults)
    assert [f.id for f in faults if f.size > 1000] == ["recording_rest"]


def test_samples_are_counted_as_read_where_the_start_is_cut():
    moving = decay(STEP, 1e-4)
    held = np.concatenate([np.full(150, moving.samples[0]), moving.samples])
    cleaned, faults = set_aside(
        Campaign("swing", 1.0, (replace(moving, samples=held),), stop=False)
    )
    (rest,) = (f for f in faults if f.id == "recording_rest")
    used = cleaned.recordings[0].used
    assert any(f.id == "recording_start" for f in faults) and used is not None
    assert rest.spans[0][0] == held.size - used.size + int(np.argmin(used))


def test_rounding_at_rest_does_not_make_a_fit_sure_of_itself():
    """The offset's interval: with all readings at rest it is far from the true rest."""
    campaign = Campaign("swing", 1.0, (decay(STEP, 1e-4),), stop=False)

    def off(c: Campaign) -> float:
        fit = identify(c, rng=np.random.default_rng(0), search=False).fit
        at = fit.names.index("offset[swing]")
        return abs(float(fit.mode[at]) - 0.3 * STEP) / float(fit.sd[at])

    assert off(campaign) > 6.0
    assert off(set_aside(campaign)[0]) < 4.0
