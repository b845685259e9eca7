"""A magnet that lets go over a while, with and without a stop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy.integrate import solve_ivp

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults.recording_faults import cleaned_campaign
from bayesimpact.diagnosis.faults.soft_release import soft_releases
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.model.effects import SEARCHED

pytestmark = pytest.mark.usefixtures("catalogue_alone")

RIG, CUBIC, HELD = small_rig.RIG, -1e6, 0.15
RNG = np.random.default_rng
DEPTHS = (6.5e-3, 5.5e-3, 4.5e-3)


def recorded(
    fades: tuple[float, ...] = (0.0, 0.0, 0.0),
    drag: float = 0.0,
    bumper: float = 0.0,
    *,
    stop: bool = True,
) -> Campaign:
    """Three decays with a softening spring; a magnet holds each for 0.15 s and lets go over `fades`
    s; with a quadratic drag, N s2/m2, and a bumper behind -4.6 mm, N/m.
    """
    rng, recordings = RNG(1), []
    for name, depth, fade in zip("abc", DEPTHS, fades, strict=True):
        held = RIG.k1 * depth + CUBIC * depth**3 + bumper * max(depth - 4.6e-3, 0.0)

        def rate(t: float, s: np.ndarray, fade: float = fade, held: float = held) -> list[float]:
            y, v = s
            force = -held * float(np.clip((HELD + fade - t) / max(fade, 1e-9), 0.0, 1.0))
            force -= RIG.c1 * v + RIG.k1 * y + CUBIC * y**3 + drag * abs(v) * v
            force += bumper * max(-y - 4.6e-3, 0.0)
            if y > RIG.g and stop:
                force -= RIG.k2["1"] * (y - RIG.g) + RIG.c2 * v
            return [v, force / RIG.mass]

        times = np.arange(3000) / 1000.0
        y = solve_ivp(
            rate, (0.0, 3.0), [-depth, 0.0], t_eval=times, rtol=1e-8, atol=1e-11, max_step=5e-4
        ).y[0]
        noise = small_rig.NOISE * rng.standard_normal(y.size)
        recordings.append(Recording(name, "1" if stop else "", y + noise, 1e-3))
    return Campaign("held", RIG.mass, tuple(recordings), stop=stop)


def found(campaign: Campaign) -> list[str]:
    cleaned = cleaned_campaign(campaign, rng=RNG(0), search=False)
    fit, rested = cleaned.identification.fit, [f.recording for f in cleaned.own]
    assert fit.reduced_chi2 > 9.0
    return [f.recording for f in soft_releases(fit, SEARCHED, campaign_scales(fit), rested)]


def test_a_release_that_takes_a_while_is_found_where_it_does() -> None:
    assert found(recorded(fades=(0.04, 0.03, 0.035))) == ["a", "b", "c"]
    assert found(recorded(fades=(0.0, 0.04, 0.0))) == ["b"]
    assert found(recorded(fades=(0.04, 0.0, 0.035))) == ["a", "b", "c"]  # one rig


def test_without_a_stop_it_is_found_after_a_rest() -> None:
    assert found(recorded(fades=(0.04, 0.03, 0.035), stop=False)) == ["a", "b", "c"]


@pytest.mark.parametrize(
    "law", [{}, {"drag": 2.0}, {"bumper": 500.0}, {"stop": False}, {"bumper": 500.0, "stop": False}]
)
def test_physics_of_large_motions_is_no_release(law: dict[str, Any]) -> None:
    assert found(recorded(**law)) == []


@pytest.mark.long
def test_the_law_is_named_beside_it() -> None:
    laws = tuple(BY_ID[i] for i in ("spring_cubic", "spring_quadratic", "hysteresis_bouc_wen"))
    campaign = recorded(fades=(0.04, 0.03, 0.035))
    answer = diagnose(campaign, rng=RNG(0), effects=laws, search=False)
    assert answer.verdict == "named" and [e.id for e in answer.effects] == ["spring_cubic"]
    assert answer.corrected is not None
    starts = [f.recording for f in answer.corrected.faults if f.id == "recording_start"]
    assert sorted(set(starts)) == ["a", "b", "c"]
