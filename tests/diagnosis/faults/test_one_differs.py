"""One recording that differs, beside physics that all of them miss and no effect describes."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from scipy.integrate import solve_ivp

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.faults.alone import Alone, SharedModel
from bayesimpact.diagnosis.faults.compare import Compared, _alternatives, compare_recordings
from bayesimpact.diagnosis.faults.together import Hypothesis, Weighed
from bayesimpact.diagnosis.selection.outcome import is_large
from bayesimpact.inference.identify import identify

RIG = small_rig.PLAIN
DEPTHS = (4.9e-3, 5.8e-3, 5.2e-3, 5.1e-3, 5.6e-3)
RIPPLE, PITCH = 1.5e-2, 5e-4  # N, m/rad: the cogging of a motor


def recorded(clocks: tuple[float, ...], steep: float = 0.0, first: float = DEPTHS[0]) -> Campaign:
    """Five decays under the cogging of a motor, with a spring of seventh power, of `steep` times
    the linear one at 5 mm, with clocks that run so many times too fast.
    """
    rng, recordings = np.random.default_rng(2), []
    for name, depth, clock in zip("abcde", (first, *DEPTHS[1:]), clocks, strict=True):

        def rate(t: float, s: np.ndarray) -> list[float]:
            spring = RIG.k1 * s[0] * (1.0 + steep * (s[0] / 5e-3) ** 6)
            force = spring + RIPPLE * np.sin(s[0] / PITCH + 1.0)
            return [s[1], -(force + RIG.c1 * s[1]) / RIG.mass]

        times = np.arange(1500) / 500.0
        y = solve_ivp(
            rate, (0.0, 3.1), [-depth, 0.0], t_eval=times * clock, rtol=1e-8, atol=1e-11
        ).y[0]
        noise = small_rig.NOISE * rng.standard_normal(y.size)
        recordings.append(Recording(name, "", y + noise, 1 / 500.0))
    return Campaign("cogging", RIG.mass, tuple(recordings), stop=False)


def found(campaign: Campaign) -> list[Compared]:
    base = identify(campaign, rng=np.random.default_rng(0), search=False)
    assert is_large(base.fit)
    return list(compare_recordings(base.fit, SharedModel(base.noise)))


def test_a_clock_that_is_off_stands_out_of_what_all_of_them_miss() -> None:
    (one,) = found(recorded((1.0, 1.0, 1.002, 1.0, 1.0)))
    assert one.fault.recording == "c" and 4 * one.after < one.before
    assert one.fault.id == "recording_clock" or "k1" in one.fault.statement
    assert one.fault.strength > one.fault.threshold
    ((other, probability),) = one.alternatives
    assert other == "physics that recordings show differently" and probability < 0.1


@pytest.mark.parametrize(
    ("clocks", "steep", "first"),
    [
        ((1.0, 1.0, 1.0, 1.0, 1.0), 0.0, 4.9e-3),
        ((1.0, 1.004, 0.997, 0.9985, 1.0015), 0.0, 4.9e-3),  # all of them differ
        ((1.0, 1.0, 1.0, 1.0, 1.0), 0.02, 8e-3),  # the largest motion differs
    ],
)
def test_what_all_of_them_show_is_no_fault_of_one(
    clocks: tuple[float, ...], steep: float, first: float
) -> None:
    assert found(recorded(clocks, steep, first)) == []


def test_other_explanations_are_told_in_words() -> None:
    alone = [Alone(name, np.zeros(2), np.eye(2), 1.0, 1.0) for name in ("a", "b")]
    ranked = [
        Weighed(Hypothesis("recording_other_rig", 0, what="k1"), 0.0),
        Weighed(Hypothesis("recording_clock", 0), -1.0),
        Weighed(Hypothesis("recording_other_rig", 1, what="c1"), -2.0),
    ]
    told = [words for words, _ in _alternatives(ranked, alone)]
    assert told == ["another clock of a", "another c1 of b"]
