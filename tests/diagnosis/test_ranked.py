"""What a search takes for a gain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.extend import campaign_scales
from bayesimpact.diagnosis.ranked import Ranked
from bayesimpact.diagnosis.refit import base_candidate, fit_from
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.free_changes import motions_beside


def search_of(force: float, stiffness: float) -> tuple[Ranked, float, float]:
    """A search about a plain decay shaken at random (N) with a cubic spring (N/m3); what that gains
    by the evidence alone, and what the search makes of it.
    """
    effects = {"spring_cubic": {"stiffness": stiffness}}
    clean = small_rig.record(
        5, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, duration=4.0
    )
    fit = identify(clean, rng=np.random.default_rng(0), search=False).fit
    o, rng, shaken = fit.target.oscillator, np.random.default_rng(1), []
    for r, recording in enumerate(clean.recordings):
        t, knots = recording.times, np.linspace(0.0, recording.times[-1], 200)
        wave = np.interp(t, knots, force * rng.standard_normal(knots.size))
        q = o.layout.slots(fit.mode)[[r]]
        moved, still = (motions_beside(o, r, q, 0, waves=w[None])[0] for w in (wave, 0.0 * wave))
        shaken.append(replace(recording, samples=recording.samples + moved - still))
    campaign = replace(clean, recordings=tuple(shaken))
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    search = Ranked(EFFECTS, campaign_scales(fit), np.random.default_rng(0), lambda words: None)
    base = search.examine(base_candidate(fit)).candidate
    added = search.keep(fit_from(fit, (BY_ID["spring_cubic"],), {}, campaign_scales(fit)))
    gained = added.log_evidence - base.log_evidence
    return search, gained, search.promise(added) - search.promise(base)


def test_beside_a_force_of_time_a_law_that_is_there_gains_and_a_false_one_does_not():
    search, alone, beside = search_of(0.05, 0.0)
    assert search.is_large and search.left is not None
    assert alone > 100.0 and beside < 5.5
    assert search_of(0.05, 4e6)[2] > 5.5


def test_where_the_misfit_is_not_large_every_sample_counts():
    search, alone, beside = search_of(0.0, 2e4)
    assert not search.is_large and search.left is None
    assert beside == pytest.approx(alone - search.cost)
