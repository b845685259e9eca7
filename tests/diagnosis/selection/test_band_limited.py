"""What an input did between its samples shows once a model leaves little else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.revision import band_limited, without_lines
from bayesimpact.inference.identify import identify

MASS, C1, K1 = 0.5, 0.6, 800.0
INTERVAL, NOISE = 4e-3, 5e-6


def shaken(lines: bool) -> Campaign:
    """A linear oscillator under three sines, of 10 to 30 samples a period, in closed form; or under
    the `lines` between their samples, each of whose harmonics it answers in the same way.
    """
    t = INTERVAL * np.arange(1500)
    rng, drive, moved = np.random.default_rng(2), np.zeros(t.size), np.zeros(t.size)
    for frequency, size, phase in ((8.3, 2.0, 0.3), (13.1, 4.0, 1.9), (24.7, 9.0, 2.2)):
        drive += size * np.cos(2 * np.pi * frequency * t + phase)
        images = [frequency + n / INTERVAL for n in range(-40, 41)] if lines else [frequency]
        for image in images:
            share = np.sinc(image * INTERVAL) ** 2 if lines else 1.0
            w = 2 * np.pi * image
            answer = share * size * np.exp(1j * phase) / (K1 - MASS * w * w + 1j * w * C1)
            moved += (answer * np.exp(1j * w * t)).real
    samples = moved + NOISE * rng.standard_normal(t.size)
    recording = Recording("a", "", samples, INTERVAL, input=Input(drive))
    return Campaign("shaken", MASS, (recording,), stop=False)


def test_a_stated_hold_stands(tmp_path: Path) -> None:
    (recording,) = shaken(lines=False).recordings
    assert recording.input is not None
    stated = replace(recording, input=replace(recording.input, lines_stated=True))
    for one, said in ((recording, False), (stated, True)):
        campaign = replace(shaken(lines=False), recordings=(one,))
        again = load_campaign(campaign.save(tmp_path / str(said)).parent)
        given = again.recordings[0].input
        assert given is not None and given.lines_stated is said
        fit = identify(again, rng=np.random.default_rng(0), search=False).fit
        assert (band_limited(fit) is None) is said


@pytest.mark.parametrize("lines", [True, False])
def test_what_an_input_does_between_samples_is_told(lines: bool) -> None:
    """Before this was asked, a force of no effect was learned for it."""
    found = diagnose(shaken(lines), rng=np.random.default_rng(0), search=False)
    assert found.verdict == "adequate" and not found.effects
    assert found.selection.band_limited is not lines
    assert found.after.reduced_chi2 == pytest.approx(1.0, abs=0.12)
    assert abs(found.after.value("k1") - K1) < 4 * found.after.sd[found.after.names.index("k1")]


def test_a_steady_force_is_not_what_a_hold_takes_from_a_steady_input() -> None:
    """A line of the input's own frequency gives back what lines between its samples take away."""
    t = INTERVAL * np.arange(1500)
    recordings = []
    for name, size in (("a", 9.0), ("b", 9.0)):
        moved = NOISE * np.random.default_rng(len(recordings)).standard_normal(t.size)
        drive = np.zeros(t.size)
        for frequency, share in ((12.0, 1.0), (4.1, 0.2)):
            w = 2 * np.pi * frequency
            answer = share * size / (K1 - MASS * w * w + 1j * w * C1)
            moved += (answer * np.exp(1j * w * t)).real
            drive += share * size * np.cos(w * t)
        recordings.append(Recording(name, "", moved, INTERVAL, input=Input(drive)))
    campaign = Campaign("shaken", MASS, tuple(recordings), stop=False)
    base = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    line = {"amplitude": 0.05, "frequency": 12.0, "phase[a]": 1.6, "phase[b]": 1.6}
    values = {f"harmonic_forcing.{name}": value for name, value in line.items()}
    forced = fit_from(base, [BY_ID["harmonic_forcing"]], values, campaign_scales(base)).fit
    assert forced.reduced_chi2 < 1.2 < base.reduced_chi2
    plain = without_lines(base, forced)
    assert plain is not None and plain.reduced_chi2 == pytest.approx(1.0, abs=0.12)
    real = replace(campaign, recordings=tuple(_pushed(r, 0.05, 9.0) for r in recordings))
    base = identify(real, rng=np.random.default_rng(0), search=False).fit
    values |= {"harmonic_forcing.frequency": 9.0}
    forced = fit_from(base, [BY_ID["harmonic_forcing"]], values, campaign_scales(base)).fit
    assert without_lines(base, forced) is None


def _pushed(recording: Recording, size: float, frequency: float) -> Recording:
    """By a force of its own frequency too."""
    w = 2 * np.pi * frequency
    answer = size / (K1 - MASS * w * w + 1j * w * C1) * np.exp(1j * w * recording.times)
    return replace(recording, samples=recording.samples + answer.real)
