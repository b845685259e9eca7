"""A start of up to three periods under a force, by the law of readings a fixed time apart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from effect_rigs import BY_ID
from scipy.integrate import solve_ivp

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults.forced_start import start_of_free

pytestmark = pytest.mark.usefixtures("catalogue_alone")

RATE = 2 * np.pi  # rad/s: a period of 1 s
Law = Callable[[float, float], float]


def nothing(y: float, v: float) -> float:
    return 0.0


LAWS: dict[str, Law] = {
    "nothing": nothing,
    "quadratic drag": lambda y, v: 0.5 * v * abs(v),
    "cubic spring": lambda y, v: 0.2 * RATE**2 * y**3,
    "dry friction": lambda y, v: 1.0 * float(np.tanh(100.0 * v)),
}


def decay(
    push: float = 0.0,
    lasts: float = 1.0,
    law: Law = nothing,
    *,
    damping: float = 0.05,
    derivative: int = 0,
    interval: float = 0.02,
    noise: float = 3e-3,
) -> Recording:
    """Ten periods of a unit mass, the first of them under a force of `push` times the spring's."""

    def rate(t: float, s: np.ndarray) -> list[float]:
        force = push * RATE**2 * np.cos(1.7 * RATE * t) if t < lasts else 0.0
        return [s[1], force - 2 * damping * RATE * s[1] - RATE**2 * s[0] - law(s[0], s[1])]

    t = np.arange(0.0, 10.0, interval)
    y, v = solve_ivp(rate, (0.0, 10.0), [1.0, 0.0], t_eval=t, rtol=1e-8, max_step=0.02).y
    signal = y
    if derivative == 2:
        signal = np.array([rate(*row)[1] for row in zip(t, np.column_stack([y, v]), strict=True)])
    errors = noise * np.abs(signal).max() * np.random.default_rng(0).standard_normal(t.size)
    return Recording(
        "push",
        "",
        signal + errors,
        interval,
        quantity=("displacement", "", "acceleration")[derivative],
    )


@pytest.mark.parametrize("lasts", [0.3, 1.0, 2.6])
@pytest.mark.parametrize(("derivative", "interval"), [(0, 0.02), (2, 0.16)])
def test_the_end_of_a_push_is_found(lasts: float, derivative: int, interval: float) -> None:
    recording = decay(0.6, lasts, derivative=derivative, interval=interval)
    start = start_of_free(recording, 1.0)
    assert start is not None and start.is_forced
    assert lasts - 0.2 < start.first * interval < lasts + 0.2


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("damping", [0.01, 0.08])
def test_physics_is_no_force_of_the_start(law: str, damping: float) -> None:
    start = start_of_free(decay(law=LAWS[law], damping=damping), 1.0)
    assert start is not None and not start.is_forced


def test_noise_alone_and_short_recordings_are_none() -> None:
    noise = Recording("n", "", np.random.default_rng(1).standard_normal(300), 0.02)
    start = start_of_free(noise, 1.0)
    assert start is None or not start.is_forced
    assert start_of_free(decay().part(0, 30), 1.0) is None


def test_a_diagnosis_tells_the_start_and_nothing_else() -> None:
    """Whole, the recording asks for a drift and a mode that are not there; the end of a push is no
    knock.
    """
    campaign = Campaign("push", 1.0, (decay(0.6, 2.0, interval=0.05),), stop=False)
    laws = tuple(BY_ID[i] for i in ("sensor_drift", "released_mode"))
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=laws, search=False)
    assert found.corrected is not None
    (fault,) = found.corrected.faults
    assert fault.id == "recording_start" and 1.8 < fault.size < 2.2
    assert found.verdict == "named" and found.effects == ()
