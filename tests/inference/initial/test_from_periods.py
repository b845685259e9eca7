"""A base fit that misses its recordings by far begins again from periods ahead."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import with_effect

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.inference.initial import from_periods
from bayesimpact.inference.initial.from_periods import FAR, or_by_periods

SHAKEN = {"harmonic_forcing": {"amplitude": 0.4, "frequency": 8.3, "phase": 1.0}}


def fitted(effects: Any = None, **how: Any) -> Fit:
    campaign = small_rig.record(1, effects, duration=4.0, **how)
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def test_a_fit_that_lost_the_stop_finds_it_again(monkeypatch: Any) -> None:
    """From a mode without one: far gap, no stiffness there."""
    fit = fitted()
    lost = fit.mode.copy()
    for name, value in (("g", 0.02), ("k2[1]", 1.0), ("k2[2]", 1.0), ("c2", 0.0), ("k1", 950.0)):
        lost[fit.names.index(name)] = value
    bad = from_periods.find_mode(fit.density, lost)
    assert bad.rms > FAR * bad.signal
    found = or_by_periods(bad)
    assert found.log_posterior == pytest.approx(fit.log_posterior, abs=0.1)
    assert found.value("g") == pytest.approx(1.1e-3, rel=0.02)
    monkeypatch.setattr(from_periods, "_ahead", lambda found, theta: None)
    assert or_by_periods(bad) is bad


def test_one_that_explains_most_or_has_no_stop_stays(monkeypatch: Any) -> None:
    def refused(*_: Any) -> None:
        raise AssertionError("begun again")

    monkeypatch.setattr(from_periods, "_ahead", refused)
    fit = fitted()
    assert or_by_periods(fit) is fit
    plain = fitted(rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES)
    wrong = from_periods.find_mode(plain.density, plain.mode * 1.3, max_iterations=0)
    assert wrong.rms > FAR * wrong.signal and or_by_periods(wrong) is wrong


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
def test_an_end_is_never_less_likely(quantity: Any, monkeypatch: Any) -> None:
    """Of shaken recordings, at the door of a diagnosis."""
    after = fitted(SHAKEN, quantity=quantity)
    monkeypatch.setattr("bayesimpact.inference.identify.or_by_periods", lambda fit: fit)
    before = fitted(SHAKEN, quantity=quantity)
    assert before.rms > FAR * before.signal
    assert after.log_posterior >= before.log_posterior - 0.1


def test_a_gap_is_reached_from_rest_and_has_any_name() -> None:
    """Readings count from rest; `gap_per_recording` has gaps in the place of g."""
    fit = fitted()
    far = {n: 0.05 for n in fit.names if n.startswith("offset[")}
    recordings = tuple(
        replace(r, samples=r.samples + 0.05) for r in fit.density.oscillator.campaign.recordings
    )
    oscillator = fit.density.oscillator
    oscillator = replace(oscillator, campaign=replace(oscillator.campaign, recordings=recordings))
    mode = fit.mode + np.array([far.get(n, 0.0) for n in fit.names])
    likelihood = replace(fit.density.likelihood, oscillator=oscillator)
    moved = replace(fit, density=replace(fit.density, likelihood=likelihood), mode=mode)
    for one in (fit, moved):
        (_, start) = from_periods._starts(one)
        assert 1e-3 < start[one.names.index("g")] < 4e-3
    found: Any = SimpleNamespace(fit=fit)
    own = with_effect(found, "gap_per_recording")
    (_, start) = from_periods._starts(own)
    gaps = [start[own.names.index(f"gap_per_recording.g[{r}]")] for r in "abc"]
    assert len(set(gaps)) == 1 and 1e-3 < gaps[0] < 4e-3


def test_no_period_is_told_without_a_spring() -> None:
    fit = fitted()
    theta = fit.mode.copy()
    theta[fit.names.index("k1")] = 0.0
    assert from_periods._ahead(fit, theta) is None
