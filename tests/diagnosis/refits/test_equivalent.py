"""An effect begins in the place of another one with the size at which it does what that one did."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits import refit
from bayesimpact.diagnosis.refits.equivalent import equivalent
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate, exchanged, fit_from
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.identify import identify
from bayesimpact.inference.mode import find_mode
from bayesimpact.model.effects.effect import Scales

DRAG, POWER = BY_ID["quadratic_drag"], BY_ID["power_damping"]
COEFFICIENT = 0.4


@pytest.fixture(scope="module")
def dragged() -> tuple[Candidate, Scales]:
    """A drag, fitted as a power of the speed that is free."""
    campaign = small_rig.record(
        3,
        {"quadratic_drag": {"coefficient": COEFFICIENT}},
        rig=small_rig.PLAIN,
        releases=small_rig.PLAIN_RELEASES,
    )
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    start = {"power_damping.coefficient": COEFFICIENT, "power_damping.exponent": 2.0}
    return fit_from(fit, (POWER,), start, scales), scales


def test_a_law_of_another_form_takes_over_the_force(dragged: tuple[Candidate, Scales]) -> None:
    candidate, scales = dragged
    at = candidate.fit.mode.copy()
    names = candidate.fit.names
    at[names.index("power_damping.coefficient")] = COEFFICIENT
    at[names.index("power_damping.exponent")] = 2.0
    fit = replace(candidate.fit, mode=at)
    found = equivalent(POWER, DRAG, fit, scales)
    assert found == {"quadratic_drag.coefficient": pytest.approx(COEFFICIENT, rel=1e-9)}
    other = replace(POWER, law=replace(POWER.law, force=lambda *path: np.nan))
    assert equivalent(POWER, other, fit, scales) == {}


@pytest.mark.parametrize("other", ["harmonic_forcing", "hysteresis_bouc_wen", "gap_per_recording"])
def test_what_is_no_force_of_place_and_speed_has_no_equal(
    dragged: tuple[Candidate, Scales], other: str
) -> None:
    candidate, scales = dragged
    assert equivalent(POWER, BY_ID[other], candidate.fit, scales) == {}


def test_an_exchange_begins_there(
    dragged: tuple[Candidate, Scales], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From none at all a drag came to rest there, and the free power was named in its place."""
    candidate, scales = dragged
    starts: list[float] = []

    def ascent(density: PosteriorDensity, start: np.ndarray, **options: Any) -> Fit:
        starts.append(float(start[density.oscillator.layout.index("quadratic_drag.coefficient")]))
        return find_mode(density, start, **options)

    monkeypatch.setattr(refit, "find_mode", ascent)
    found = exchanged(candidate, POWER, DRAG, scales)
    assert starts[0] == pytest.approx(COEFFICIENT, rel=0.2)
    assert found.fit.log_likelihood > candidate.fit.log_likelihood - 2.0
    assert found.fit.value("quadratic_drag.coefficient") == pytest.approx(COEFFICIENT, rel=0.05)
