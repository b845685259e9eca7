"""A harmonic force beside friction, whose responses have to be simulated."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import refit
from bayesimpact.diagnosis.score_test import frequency_scan as periodic
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.inference.identify import identify

FORCING = BY_ID["harmonic_forcing"]


@pytest.fixture(scope="module")
def beside_friction():
    effects = {
        "coulomb_friction": {"force": 0.02},
        "harmonic_forcing": {"amplitude": 0.008, "frequency": 15.3, "phase": 0.4},
    }
    campaign = small_rig.record(8, effects, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES)
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(base)
    friction = [BY_ID["coulomb_friction"]]
    found = scan(base, friction, scales, rng=np.random.default_rng(0))
    return refit(base, [found.best()[0]], scales).fit, scales


@pytest.fixture
def not_superposed(monkeypatch):
    """As beside a law with a state of its own."""
    monkeypatch.setattr(periodic, "force_responses", lambda *_: None)


def test_a_few_lines_find_what_the_whole_grid_finds(beside_friction, not_superposed, monkeypatch):
    fit, scales = beside_friction
    (few,) = periodic.periodic_scores(fit, [FORCING], scales)
    monkeypatch.setattr(periodic, "SIMULATED", 10_000)
    (all_of_them,) = periodic.periodic_scores(fit, [FORCING], scales)
    assert few.shapes == all_of_them.shapes
    assert few.p_value == all_of_them.p_value and few.gain == all_of_them.gain
    assert few.shapes["harmonic_forcing.frequency"] == pytest.approx(
        15.3, abs=0.5 / scales.duration
    )
    assert few.gain > 20.0


def test_only_a_few_lines_are_simulated(beside_friction, not_superposed, monkeypatch):
    fit, scales = beside_friction
    grid, tried = periodic.frequencies(fit, FORCING, scales), []
    simulated = periodic.simulated_responses

    def counted(fit, r, frequencies, scales):
        tried.append((r, frequencies.size))
        return simulated(fit, r, frequencies, scales)

    monkeypatch.setattr(periodic, "SIMULATED", 3)
    monkeypatch.setattr(periodic, "simulated_responses", counted)
    periodic.periodic_scores(fit, [FORCING], scales)
    assert grid.size > 9
    for r in range(2):  # three lines, or fewer, and their neighbours
        assert 3 < sum(n for at, n in tried if at == r) <= 9
