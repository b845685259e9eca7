"""Sidebands of a motion whose stiffness pulsates, and lines that are none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.score_test.sidebands import is_sideband

OWN, PULSE, INTERVAL, SIZE = 40.0, 17.3, 1.0 / 2000.0, 3000
TIMES = INTERVAL * np.arange(SIZE)
NOISE = 2e-3 * np.random.default_rng(0).standard_normal(SIZE)


def motion(share: float) -> np.ndarray:
    """y'' + 2 y' + w^2 (1 + share cos(2 pi 17.3 t)) y = 0."""
    w = 2 * np.pi * OWN

    def rate(t: float, s: np.ndarray) -> list[float]:
        return [s[1], -2.0 * s[1] - w * w * (1.0 + share * np.cos(2 * np.pi * PULSE * t)) * s[0]]

    found = solve_ivp(rate, (0.0, TIMES[-1]), [1.0, 0.0], t_eval=TIMES, rtol=1e-9, atol=1e-12)
    return np.asarray(found.y[0])


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_line_of_a_stiffness_that_pulsates_has_its_mirror_image(side: float) -> None:
    """A model that takes one sideband for a line leaves the other."""
    samples = motion(0.1) + NOISE
    recording = Recording("a", "", samples, INTERVAL)
    line, mirror = OWN + side * PULSE, OWN - side * PULSE
    columns = np.stack([f(2 * np.pi * g * TIMES) * np.exp(-TIMES)
                        for g in (OWN, line) for f in (np.cos, np.sin)], axis=1)  # fmt: skip
    left = samples - columns @ np.linalg.lstsq(columns, samples, rcond=None)[0]
    assert is_sideband(recording, left, OWN, line, (line,))
    assert not is_sideband(recording, NOISE, OWN, line, (line,))  # nothing else remains
    assert is_sideband(recording, NOISE, OWN, line, (line, mirror))  # the model has it too


def test_a_mode_or_a_hum_has_none_and_what_is_left_about_the_motion_is_none() -> None:
    line = 0.05 * np.exp(-TIMES) * np.cos(2 * np.pi * (OWN + PULSE) * TIMES)
    recording = Recording("a", "", motion(0.0) + line + NOISE, INTERVAL)
    assert not is_sideband(recording, NOISE, OWN, OWN + PULSE, (OWN + PULSE,))
    phase = 0.3 * np.exp(-TIMES) * np.sin(2 * np.pi * OWN * TIMES)  # a phase that is 0.3 rad off
    assert not is_sideband(recording, phase + NOISE, OWN, OWN + PULSE, (OWN + PULSE,))
    assert not is_sideband(recording, phase, OWN, OWN + 1.0, (OWN + 1.0,))  # of its own band
    broad = 300.0 * NOISE  # as strong as the line in every line, and so none by itself
    assert not is_sideband(recording, broad, OWN, OWN + PULSE, (OWN + PULSE,))
    assert not is_sideband(recording, NOISE, OWN, 85.0, (85.0,))  # no mirror image above zero


@pytest.mark.parametrize(
    ("own", "line"), [(10.0, 0.4), (10.0, 19.6), (900.0, 990.0), (10.0, 990.0)]
)
def test_lines_at_the_ends_of_a_spectrum_have_no_mirror_image(own: float, line: float) -> None:
    """A recording of one second, beside longer ones that do resolve the line."""
    recording = Recording("a", "", NOISE[:2000].copy(), INTERVAL)
    assert not is_sideband(recording, NOISE[:2000], own, line, (line,))
