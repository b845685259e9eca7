"""A hand's push in the first instants, by the equation of motion."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy.integrate import solve_ivp

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults.pushed_start import pushed_starts
from bayesimpact.diagnosis.faults.recording_faults import cleaned_campaign
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.model.effects import SEARCHED

pytestmark = pytest.mark.usefixtures("catalogue_alone")

RIG, CUBIC, BUMPER = small_rig.PLAIN, 3e6, 6e3
PERIOD = 2 * np.pi * np.sqrt(RIG.mass / RIG.k1)
LASTS = 0.9 * PERIOD
RNG = np.random.default_rng


def recorded(push: float = 0.0, bumper: float = np.inf) -> Campaign:
    """Three decays with a hardening spring; in the second one a half sine of a force, N, acts, and
    a bumper stands behind -`bumper`, m, on all.
    """
    rng, recordings = RNG(1), []
    for name, y0 in (("a", 5e-3), ("b", -4.0e-3), ("c", 4.5e-3)):
        size = push if name == "b" else 0.0

        def rate(t: float, s: np.ndarray, size: float = size) -> list[float]:
            force = size * np.sin(np.pi * t / LASTS) if t < LASTS else 0.0
            force += BUMPER * max(-bumper - s[0], 0.0)
            spring = RIG.k1 * s[0] + CUBIC * s[0] ** 3
            return [s[1], (force - RIG.c1 * s[1] - spring) / RIG.mass]

        times = np.arange(2000) / 500.0
        y = solve_ivp(
            rate, (0.0, 4.0), [y0, 0.0], t_eval=times, rtol=1e-9, atol=1e-12, max_step=2e-3
        ).y[0]
        noise = small_rig.NOISE * rng.standard_normal(y.size)
        recordings.append(Recording(name, "", y + noise, 1 / 500.0))
    return Campaign("pushed", RIG.mass, tuple(recordings), stop=False)


def found(campaign: Campaign) -> list[tuple[str, float]]:
    fit = cleaned_campaign(campaign, rng=RNG(0), search=False).identification.fit
    assert fit.reduced_chi2 > 9.0
    return [(f.recording, f.size) for f in pushed_starts(fit, SEARCHED, campaign_scales(fit))]


def test_a_push_is_found_where_it_acts_and_no_law() -> None:
    ((name, lasts),) = found(recorded(push=4.0))
    assert name == "b" and LASTS < lasts < LASTS + 0.3 * PERIOD
    assert found(recorded()) == []
    assert found(recorded(bumper=3.6e-3)) == []  # met in the first swings of two recordings


@pytest.mark.long
def test_physics_is_named_beside_it() -> None:
    laws = tuple(BY_ID[i] for i in ("spring_cubic", "released_mode", "stiffness_drift"))
    answer = diagnose(recorded(push=4.0), rng=RNG(0), effects=laws, search=False)
    assert answer.verdict == "named" and [e.id for e in answer.effects] == ["spring_cubic"]
    assert answer.corrected is not None
    assert [(f.id, f.recording) for f in answer.corrected.faults] == [("recording_start", "b")]
    assert answer.after.value("spring_cubic.stiffness") == pytest.approx(CUBIC, rel=0.02)
