"""What `check` says of a measured input, and of noise beside one."""

from __future__ import annotations

import numpy as np
import pytest

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.report.check_text import campaign_warnings, measured_noise

NOISE = 2e-3


def driven(highest: float, *, band_limited: bool = False) -> Campaign:
    """A fast motion under an input that ends at `highest` (of the sampling rate)."""
    rng = np.random.default_rng(7)
    spectrum = np.fft.rfft(rng.standard_normal(8192))
    spectrum[np.fft.rfftfreq(8192) > highest] = 0.0
    force, times = np.fft.irfft(spectrum, 8192), np.arange(200)
    motion = np.convolve(force, np.exp(-0.03 * times) * np.sin(0.6 * times))[:8192]
    samples = motion + NOISE * rng.standard_normal(8192)
    given = Input(force, band_limited=band_limited)
    return Campaign("rig", 1.0, (Recording("a", "", samples, 1.0, input=given),), stop=False)


def test_a_fast_motion_under_an_input_is_no_noise() -> None:
    noise = measured_noise(driven(0.3))
    assert noise is not None and noise.level == pytest.approx(NOISE, rel=0.05)
    assert noise.correlation == 0.0


@pytest.mark.parametrize(
    ("highest", "band_limited", "said"),
    [(0.3, False, True), (0.3, True, False), (0.03, False, False)],
)
def test_what_lines_between_samples_lose_is_said(
    highest: float, band_limited: bool, said: bool
) -> None:
    warnings = campaign_warnings(driven(highest, band_limited=band_limited), None)
    assert any('hold = "band_limited"' in warning for warning in warnings) == said


def test_how_much_of_an_input_lines_between_its_samples_lose() -> None:
    """Of a sine, the square of its own sinc."""
    for period in (5, 10, 40):
        wave = Input(np.sin(2 * np.pi * np.arange(400) / period))
        assert wave.weakened == pytest.approx(1.0 - np.sinc(1.0 / period) ** 2, rel=1e-6)


@pytest.mark.parametrize("grows", [True, False])
def test_what_is_largest_at_its_end_was_not_released_there(grows: bool) -> None:
    """Of a spring that a shaker moves `check` advised to begin two samples before the end."""
    t = np.arange(600) / 100
    envelope = 0.2 + 0.3 * t if grows else np.where(t < 1.5, 0.1, np.exp(-0.1 * t))
    samples = envelope * np.cos(2 * np.pi * t)
    campaign = Campaign("rig", 1.0, (Recording("a", "", samples, 0.01),), stop=False)
    (said,) = (w for w in campaign_warnings(campaign, None) if "largest excursion" in w)
    assert ("something drove it" in said) is grows and ("set start_s" in said) is not grows
