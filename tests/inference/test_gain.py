"""A probe whose gain is unknown, beside another channel that knows its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_rig
from channel_rigs import channels

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError
from bayesimpact.inference.identify import identify
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import Oscillator, build_oscillator

GAIN = 1.03
ACCELEROMETERS = ("a_acc", "b_acc", "c_acc")


def scaled(seed: int, gain: float = GAIN) -> Campaign:
    """Accelerometers read `gain` times too much, and say so only of the first."""
    campaign = channels(seed)
    return replace(
        campaign,
        recordings=tuple(
            replace(r, samples=r.samples * gain, free_gain=True) if r.name == "a_acc" else r
            for r in campaign.recordings
        ),
    )


def oscillator(smoothing: Smoothing | None = None) -> tuple[Oscillator, np.ndarray]:
    """And parameters with a gain, and rest readings, that are no trifles."""
    made = build_oscillator(scaled(0), smoothing=smoothing)
    known = small_rig.true_values(offsets={}) | {"gain[a_acc]": 1.2}
    known |= {f"offset[{n}]": 0.3 for n in ACCELEROMETERS}
    return made, small_rig.vector(made.layout, known)


def test_a_reading_is_the_gain_times_the_motion_and_the_rest_reading() -> None:
    made, theta = oscillator()
    plain = theta.copy()
    plain[made.layout.index("gain[a_acc]")] = 1.0
    for r, found, motion in zip(
        made.campaign.recordings, made.predict(theta), made.predict(plain), strict=True
    ):
        if r.name == "a_acc":
            np.testing.assert_allclose(found, 1.2 * (motion - 0.3) + 0.3, rtol=1e-13)
        else:
            np.testing.assert_array_equal(found, motion)


@pytest.mark.parametrize("smoothing", [None, Smoothing("savgol", 11, 2)])
def test_derivatives_are_those_of_the_readings(smoothing: Smoothing | None) -> None:
    made, theta = oscillator(smoothing)
    likelihood = Likelihood(made, Noise(smoothing=smoothing))
    r = [x.name for x in made.campaign.recordings].index("a_acc")
    part = likelihood.linearise(theta)[r]
    assert sorted(part.columns) == list(made.recording_columns(r))
    for column, slope in zip(part.columns, part.jacobian.T, strict=True):
        step = np.zeros(theta.size)
        step[column] = 1e-6 * max(abs(theta[column]), 1e-3)
        up, down = (likelihood.residuals((theta + s)[None])[r][0] for s in (step, -step))
        numeric = (down - up) / (2 * step[column])
        error = np.linalg.norm(numeric - slope) / np.linalg.norm(slope)
        assert error < 1e-4, made.layout.names[column]


def test_the_gain_is_found_and_the_truth_held() -> None:
    truth, z = small_rig.true_values(offsets={}), []
    for seed in range(4):
        fit = identify(scaled(seed), rng=np.random.default_rng(0), search=False).fit
        assert fit.converged and fit.reduced_chi2 == pytest.approx(1.0, abs=0.15)
        known = {**truth, "gain[a_acc]": GAIN}
        for name in ("c1", "k1", "g", "c2", "k2[1]", "k2[2]", "y0[a]", "gain[a_acc]"):
            z.append((fit.value(name) - known[name]) / fit.sd[fit.names.index(name)])
        assert fit.sd[fit.names.index("gain[a_acc]")] < 1e-3
    assert np.abs(z).max() < 4.0 and 0.5 < np.std(z) < 1.5


def test_search_and_guess_agree() -> None:
    assert identify(scaled(0), rng=np.random.default_rng(0), evaluations=3000).agree


def test_it_is_written_and_read(tmp_path: Path) -> None:
    campaign = scaled(0)
    campaign.save(tmp_path)
    freed = [r.name for r in load_campaign(tmp_path).recordings if r.free_gain]
    assert freed == ["a_acc"]
    again = Campaign.from_arrays(campaign.recordings, name="again", mass_kg=0.503)
    for r, other in zip(campaign.recordings, again.recordings, strict=True):
        assert (r.free_gain, r.motion_name) == (other.free_gain, other.motion_name)


def test_a_prior_of_the_gain(tmp_path: Path) -> None:
    file = scaled(0).save(tmp_path)
    text = file.read_text()
    prior = '\n[priors]\n"gain[a_acc]" = { distribution = "normal", mean = 1.05, sd = 1e-4 }\n'
    file.write_text(text + prior)
    fit = identify(load_campaign(tmp_path), rng=np.random.default_rng(0), search=False).fit
    assert fit.value("gain[a_acc]") > 1.03 + 1e-3
    file.write_text(text.replace('gain = "free"\n', "") + prior)
    with pytest.raises(InputError, match="gain"):
        load_campaign(tmp_path)


def test_gains_that_nothing_tells_are_refused(tmp_path: Path) -> None:
    campaign = small_rig.record()
    free = replace(
        campaign, recordings=tuple(replace(r, free_gain=True) for r in campaign.recordings)
    )
    free.save(tmp_path)
    with pytest.raises(InputError, match="key gain") as refused:
        load_campaign(tmp_path)
    assert "accepted: a recording of known gain beside it" in str(refused.value)
