"""Models that do not stand out from one another, and what that leaves open of a parameter."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import SECOND_STOP
from bayesimpact.diagnosis.intervals import intervals
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate, fit_from
from bayesimpact.diagnosis.selection import comparable
from bayesimpact.diagnosis.selection.comparable import (
    Comparable,
    alike_in_misfit,
    alike_in_odds,
    value_in,
)
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.identify import identify
from bayesimpact.report.diagnosis import document


def moved(fit, **changes):
    """A fit with other values: shifts by parameter."""
    mode = fit.mode.copy()
    for name, change in changes.items():
        mode[fit.names.index(name)] += change
    return replace(fit, mode=mode)


@pytest.fixture(scope="module")
def split(small):
    """With a gap of every recording's own."""
    return fit_from(small.fit, (BY_ID["gap_per_recording"],), {}, campaign_scales(small.fit)).fit


def test_variance_between_models_is_that_of_their_values(small):
    others = (moved(small.fit, c1=0.3), moved(small.fit, c1=-0.1, k1=2.0))
    found = Comparable(others, np.full(2, 1 / 3)).between(small.fit)
    at, k1 = small.fit.names.index("c1"), small.fit.names.index("k1")
    assert found[at, at] == pytest.approx((0.3**2 + 0.1**2) / 3)
    assert found[k1, k1] == pytest.approx(2.0**2 / 3)
    assert found[at, k1] == pytest.approx(-0.1 * 2.0 / 3)
    low, middle, high = intervals(
        small.fit, beside=Comparable(others, np.full(2, 1 / 3))
    ).quantiles("c1")
    assert middle == pytest.approx(small.fit.value("c1"), abs=0.1)
    assert high - low > 0.2
    assert Comparable((), np.zeros(0)).between(small.fit) == pytest.approx(np.zeros_like(found))


def test_a_model_without_a_parameter_says_nothing_of_it(small):
    law = fit_from(small.fit, (BY_ID["hunt_crossley"],), {}, campaign_scales(small.fit)).fit
    assert "c2" not in law.names and value_in(law, small.fit, "c2") is None
    found = Comparable((law, moved(small.fit, c2=0.5)), np.full(2, 1 / 3)).between(small.fit)
    at = small.fit.names.index("c2")
    assert found[at, at] == pytest.approx(0.5**2 / 2)  # of the two that have it


def test_parts_of_a_gap_stand_for_the_gap_and_it_for_them(small, split):
    parts = [n for n in split.names if n.startswith("gap_per_recording.g[")]
    assert len(parts) == len(small_rig.RELEASES)
    mean = np.mean([split.value(n) for n in parts])
    assert value_in(split, small.fit, "g") == pytest.approx(mean)
    assert value_in(small.fit, split, parts[1]) == small.fit.value("g")
    assert value_in(small.fit, split, "k1") == small.fit.value("k1")


def test_phases_differ_by_less_than_a_turn(small):
    wave = fit_from(small.fit, (BY_ID["harmonic_forcing"],), {}, campaign_scales(small.fit)).fit
    at = [n.startswith("harmonic_forcing.phase") for n in wave.names].index(True)
    name = wave.names[at]
    turned = moved(wave, **{name: 2 * np.pi - 0.2})
    found = Comparable((turned,), np.full(1, 0.5)).between(wave)
    assert found[at, at] == pytest.approx(0.2**2 / 2)


def test_models_with_little_more_misfit_are_comparable(small, monkeypatch):
    """Neither those with much more, nor free forces, nor fits that failed."""
    left = {"chosen": 10.0, "near": 10.0 * EXCESS, "far": 10.1 * EXCESS, "worst": -np.inf}
    fits = {
        label: SimpleNamespace(label=label, names=("c1",), left=value)
        for label, value in left.items()
    }
    fits["free"] = SimpleNamespace(label="free", names=("learned_force.a1",), left=1.0)
    monkeypatch.setattr(comparable, "misfit_above_noise", lambda selection, fit: fit.left)
    monkeypatch.setattr(comparable, "doubtful_misfit", lambda selection: 1.0)
    tried = [Candidate((), f, -np.inf if f.left < 0 else 0.0) for f in fits.values()]
    found = alike_in_misfit(SimpleNamespace(tried=tried), fits["chosen"])
    assert [f.label for f in found.fits] == ["near"]
    assert found.weights == pytest.approx([0.5])


def test_rivals_weigh_as_much_as_their_odds(small):
    odds = {"chosen": 0.0, "near": -np.log(3.0), "leading": 2.0}
    sets = {label: SimpleNamespace(fit=label) for label in odds}
    selection = SimpleNamespace(log_odds=lambda c: odds[c.fit])
    found = alike_in_odds(selection, sets["chosen"], [sets["near"], sets["leading"]])
    assert found.weights == pytest.approx(np.array([1 / 3, 1.0]) / (1 + 1 / 3 + 1))


def test_the_mean_of_parts_is_as_uncertain_as_the_posterior_says(split):
    """Not as the fit's own covariance: under `partly` that is many times too narrow."""
    known = intervals(split)
    at = [i for i, n in enumerate(split.names) if n.startswith("gap_per_recording.g[")]
    wide = replace(known, covariance=known.covariance + 0.0)
    wide.covariance[np.ix_(at, at)] += 1e-4**2  # all gaps together
    row = document._parameters(split, wide, None)["g"]
    assert row["ci90"][1] - row["ci90"][0] == pytest.approx(2 * 1.6449e-4, rel=1e-2)
    draws = np.random.default_rng(0).multivariate_normal(wide.mean, wide.covariance, 20_000)
    drawn = document._parameters(split, known, draws)["g"]
    assert drawn["ci90"] == pytest.approx(row["ci90"], abs=0.05 * 1e-4)
    assert drawn["median"] == pytest.approx(row["median"], abs=0.03 * 1e-4)


def test_what_a_campaign_declares_is_compared_like_what_is_found(small):
    """The opposite stop of a two-sided one: a traceback ended such diagnoses."""
    campaign = replace(small.fit.density.oscillator.campaign, declared=(SECOND_STOP,))
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    other = fit_from(fit, (BY_ID["spring_cubic"],), {}, campaign_scales(fit)).fit
    at = fit.names.index("opposite_stop.stiffness")
    found = Comparable((other, moved(fit, **{fit.names[at]: 7.0})), np.full(2, 1 / 3)).between(fit)
    assert found[at, at] >= 7.0**2 / 3 * (1 - 1e-9)
