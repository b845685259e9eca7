"""A hum that is steady passes for one; what rings down or differs between recordings does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign, Measurement, Smoothing
from bayesimpact.diagnosis.refits.extend import campaign_scales, extend, transfer
from bayesimpact.diagnosis.refits.refit import Candidate, refit
from bayesimpact.diagnosis.score_test.forced_responses import simulated_responses
from bayesimpact.diagnosis.score_test.frequency_scan import (
    LEAST_GAIN,
    _blocks,
    _statistics,
    frequencies,
    leaking,
    periodic_scores,
)
from bayesimpact.diagnosis.score_test.harmonics import (
    blocks_of,
    hums,
    line_blocks,
    projected,
    rotations,
    white_line_blocks,
)
from bayesimpact.diagnosis.score_test.own_band import shakes_in_own_band
from bayesimpact.diagnosis.score_test.steady import steadiness
from bayesimpact.diagnosis.selection.models import Models
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.measurement import magnitude_response, smooth
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

FREQUENCY, AMPLITUDE = 61.3, 2e-6
Envelope = Callable[[int, np.ndarray], np.ndarray]


def hummed(campaign: Campaign, frequency: float, envelope: Envelope) -> Campaign:
    """The campaign with a hum of phase r in recording r, behind the filter that it declares."""
    recordings = []
    for r, x in enumerate(campaign.recordings):
        hum = envelope(r, x.times) * np.sin(2 * np.pi * frequency * x.times + r)
        passed = smooth(hum, campaign.measurement.smoothing, x.interval)
        recordings.append(replace(x, samples=x.samples + passed))
    return replace(campaign, recordings=tuple(recordings))


def p_value(seed: int, envelope: Envelope) -> float:
    """Of a hum with the envelope (recording, times), fitted as a steady one."""
    campaign = hummed(small_rig.record(seed), FREQUENCY, envelope)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    scales = campaign_scales(fit)
    (score,) = periodic_scores(fit, [BY_ID["sensor_hum"]], scales)
    found = refit(fit, [score], scales).fit
    assert found.value("sensor_hum.frequency") == pytest.approx(FREQUENCY, abs=0.3)
    (p,) = steadiness(found, scales)
    return p


def test_a_steady_hum_passes():
    """p-values are uniform: lines that the model's own amplitude and phases take do not count."""
    p = [p_value(seed, lambda r, t: AMPLITUDE + 0 * t) for seed in range(1, 17)]
    assert min(p) > 1e-3
    assert np.mean(p) == pytest.approx(0.5, abs=3 * np.sqrt(1 / 12 / len(p)))


@pytest.mark.parametrize(
    "envelope",
    [
        lambda r, t: (0.3 + 0.7 * r) * AMPLITUDE + 0 * t,
        lambda r, t: 2 * AMPLITUDE * np.exp(-2 * t),
    ],
    ids=["differs between recordings", "rings down"],
)
def test_what_is_not_steady_does_not(envelope):
    assert p_value(4, envelope) < 1e-4


def test_a_hum_slower_than_the_motion_is_found():
    """The mains on a stiff rig. A hum of less than five periods would pass for a drift."""
    campaign = small_rig.record(7)
    scales = campaign_scales(identify(campaign, rng=np.random.default_rng(0), search=False).fit)
    frequency = 0.7 * scales.natural_frequency
    campaign = hummed(campaign, frequency, lambda r, t: AMPLITUDE + 0 * t)
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    (score,) = periodic_scores(fit, [BY_ID["sensor_hum"]], scales)
    assert score.p_value < 1e-9
    assert score.shapes["sensor_hum.frequency"] == pytest.approx(frequency, abs=0.3)
    grid = frequencies(fit, BY_ID["sensor_hum"], scales)
    assert grid[0] * scales.duration == pytest.approx(5.0)


FILTERED = Smoothing("savgol", window=9, polyorder=2)


def behind_a_filter(frequency: float, amplitude: float) -> Fit:
    """A base fit of recordings with a hum of phase r in recording r, all behind `FILTERED`."""
    campaign = small_rig.record(
        5,
        chain=MeasuringChain(noise=small_rig.NOISE, offsets=small_rig.OFFSETS, smoothing=FILTERED),
        duration=1.5,
        measurement=Measurement(smoothing=FILTERED),
    )
    campaign = hummed(campaign, frequency, lambda r, t: amplitude + 0 * t)
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


def test_a_hum_behind_a_declared_filter_is_found():
    """The search's Fourier sums say what simulated readings, filtered and whitened, say."""
    fit = behind_a_filter(FREQUENCY, AMPLITUDE)
    (score,) = periodic_scores(fit, [BY_ID["sensor_hum"]], campaign_scales(fit))
    assert score.p_value < 1e-9
    assert score.shapes["sensor_hum.frequency"] == pytest.approx(FREQUENCY, abs=0.3)
    assert score.size[0] == pytest.approx(AMPLITUDE, abs=4 * score.size_sd[0])
    apart = score.shapes["sensor_hum.frequency"] - FREQUENCY  # by half a step of the scan at most
    for r, x in enumerate(fit.density.oscillator.campaign.recordings):
        middle = np.pi * apart * x.duration  # where phases are known best
        assert np.cos(score.shapes[f"sensor_hum.phase[{x.name}]"] + middle - r) > 0.9
    lines = np.array([FREQUENCY - 1, FREQUENCY, FREQUENCY + 1])
    waves = hums(fit, 0, lines).reshape(lines.size, 2, -1)
    direct, sums = blocks_of(fit, 0, waves), line_blocks(fit, 0, lines)
    np.testing.assert_allclose(sums.score, direct.score, rtol=0.05, atol=0.01 * sums.score.max())
    np.testing.assert_allclose(sums.own[:, 0, 0], direct.own[:, 0, 0], rtol=0.05)


@pytest.mark.parametrize("decay", [0.0, 3.0])
def test_in_white_noise_fourier_sums_are_exact(decay: float) -> None:
    """At all frequencies, below the natural one too, where samples are set aside, of a velocity."""
    campaign = small_rig.record(
        1, rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES, quantity="velocity",
        chain=MeasuringChain(noise=1e-3),
    )  # fmt: skip
    used = np.ones(campaign.recordings[0].samples.size, dtype=bool)
    used[300:350] = used[-7:] = False
    first = replace(campaign.recordings[0], used=used)
    campaign = replace(campaign, recordings=(first, *campaign.recordings[1:]))
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    assert fit.density.likelihood.noise.is_white
    lines = np.arange(0.7, 12.0, 0.37)
    waves = hums(fit, 0, lines, decay).reshape(lines.size, 2, -1)
    direct, sums = blocks_of(fit, 0, waves), white_line_blocks(fit, 0, lines, decay)
    for name in ("own", "absorbed", "score"):
        expected = getattr(direct, name)
        scale = np.abs(expected).max(axis=0)
        np.testing.assert_allclose(getattr(sums, name) / scale, expected / scale, atol=1e-9)


def test_a_hum_above_the_band_of_a_filter_is_found_by_what_leaks_into_it():
    """The whitened numbers end at half power; the filter leaves this one 0.4 of its amplitude.

    It is forty times the noise before the filter.
    """
    fit = behind_a_filter(0.0, 0.0)
    interval = float(fit.density.oscillator.intervals[0])
    above = leaking(fit, campaign_scales(fit))
    assert np.all(magnitude_response(FILTERED, interval, above) >= LEAST_GAIN)
    assert magnitude_response(FILTERED, interval, above[:1])[0] ** 2 == pytest.approx(0.5, abs=0.01)
    frequency = 0.2 + float(
        above[np.argmin(np.abs(magnitude_response(FILTERED, interval, above) - 0.4))]
    )
    (nothing,) = periodic_scores(fit, [BY_ID["sensor_hum"]], campaign_scales(fit))
    assert nothing.p_value > 0.01
    fit = behind_a_filter(frequency, 100 * AMPLITUDE)
    (score,) = periodic_scores(fit, [BY_ID["sensor_hum"]], campaign_scales(fit))
    assert score.p_value < 1e-9
    assert score.shapes["sensor_hum.frequency"] == pytest.approx(frequency, abs=0.7)


def test_scores_are_those_of_the_mode_although_an_ascent_ended_beside_it():
    """Half a standard deviation away from the mode the fitted parameters take their part back."""
    fit = identify(small_rig.record(6), rng=np.random.default_rng(0), search=False).fit
    density, theta = fit.density, fit.mode.copy()
    away = density.oscillator.layout.roles("physical", "nuisance")
    theta[away] += 0.5 * fit.sd[away]
    beside = replace(fit, mode=theta, linearisation=density.likelihood.linearise(theta))
    scales = campaign_scales(fit)
    lines = np.array([0.9, 1.0, 1.1]) * scales.natural_frequency

    def numbers(at: Fit) -> np.ndarray:
        waves = [
            simulated_responses(at, r, lines, scales).reshape(lines.size, 2, -1)
            for r in range(len(at.linearisation))
        ]
        information, score = projected(at, [blocks_of(at, r, w) for r, w in enumerate(waves)])
        return score / np.sqrt(np.einsum("fii->fi", information))

    np.testing.assert_allclose(numbers(beside), numbers(fit), atol=0.1)


def test_a_hum_at_the_motion_s_own_frequency_is_scored_exactly():
    """There the parameters absorb all but a few hundredths of it; sums alone err by as much."""
    fit = plain_fit()
    scales, recordings = campaign_scales(fit), range(len(fit.linearisation))
    grid = frequencies(fit, BY_ID["sensor_hum"], scales)[:60]
    found = [_blocks(fit, r, grid, grid[:0], 0.0, scales) for r in recordings]
    exact = [blocks_of(fit, r, hums(fit, r, grid).reshape(grid.size, 2, -1)) for r in recordings]
    slow = grid < 2 * scales.natural_frequency
    assert slow.any() and not slow.all()
    for ours, direct in zip(projected(fit, found), projected(fit, exact), strict=True):
        np.testing.assert_allclose(ours[slow], direct[slow], rtol=1e-9, atol=1e-9 * direct.max())
    statistic, _, _ = _statistics(fit, found)
    assert (statistic >= 0).all()


def test_what_is_absorbed_but_for_rounding_tells_nothing(small):
    fit = small.fit
    own = fit.density.oscillator.layout.roles("nuisance")  # every recording's alone
    columns = [x.jacobian[:, np.isin(x.columns, own)][:, :2].T[None] for x in fit.linearisation]
    blocks = [blocks_of(fit, r, c / np.linalg.norm(c)) for r, c in enumerate(columns)]
    statistic, sizes, _ = _statistics(fit, blocks)
    np.testing.assert_array_equal(statistic, 0.0)
    np.testing.assert_array_equal(sizes, 0.0)


def test_a_model_without_a_line_has_nothing_to_be_steady(small):
    assert steadiness(small.fit, campaign_scales(small.fit)) == ()


@pytest.mark.parametrize(
    ("apart", "large_misfit", "force", "hum"),
    [(0.0, True, True, True), (0.0, False, True, True), (0.7, False, True, True),
     (2.0, False, False, False), (10.0, True, False, False)],
)  # fmt: skip
def test_a_line_in_the_band_of_the_motion_is_told_apart(apart, large_misfit, force, hum):
    """A plain oscillator swings at one frequency only; a force or a hum elsewhere may be one.

    `apart`: between both frequencies, in units of the reciprocal of the duration.
    """
    rig, fit = small_rig.PLAIN, plain_fit()
    assert not shakes_in_own_band(fit, large_misfit)
    own_frequency = np.sqrt(rig.k1 / rig.mass) / (2 * np.pi)
    frequency = own_frequency + apart / campaign_scales(fit).duration
    assert shakes_in_own_band(with_line(fit, frequency), large_misfit) is force
    assert shakes_in_own_band(with_line(fit, frequency, "sensor_hum"), large_misfit) is hum


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("apart", "own"), [(0.98, True), (1.02, False)])
def test_the_band_ends_where_the_recordings_can_separate_two_lines(side, apart, own):
    """One reciprocal duration from the strongest of a recording's Fourier coefficients.

    All recordings are as long as the first, and swing as it does.
    """
    fit = plain_fit()
    recording = fit.density.oscillator.campaign.recordings[0]
    spectrum = np.abs(np.fft.rfft(recording.samples - recording.samples.mean()))
    line = (np.argmax(spectrum) + side * apart) / (recording.samples.size * recording.interval)
    assert shakes_in_own_band(with_line(fit, line), False) is own


@pytest.mark.parametrize(("chi2", "kept"), [(1.01, True), (4.0, False)])
def test_a_hum_beside_the_motion_s_line_is_taken_only_where_nothing_remains(chi2, kept):
    """Long before the misfit is large: a steady line takes what is left of a slow change."""
    fit, rig = plain_fit(), small_rig.PLAIN
    scales = campaign_scales(fit)
    beside = np.sqrt(rig.k1 / rig.mass) / (2 * np.pi) + 1.7 / scales.duration
    held = with_line(fit, beside, "sensor_hum")
    likelihood = held.density.likelihood
    level = likelihood.noise.level * np.sqrt(held.reduced_chi2 / chi2)
    noise = replace(likelihood.noise, level=level, level_error=0.01)
    density = replace(held.density, likelihood=replace(likelihood, noise=noise))
    model = Candidate(density.oscillator.effects, replace(held, density=density), 100.0)
    models = Models((), scales, np.random.default_rng(0), lambda message: None)
    assert np.isfinite(models.keep(model).log_evidence) == kept


def plain_fit() -> Fit:
    """A fit of an oscillator without a stop."""
    recorded = small_rig.record(rig=small_rig.PLAIN, releases=small_rig.PLAIN_RELEASES)
    return identify(recorded, rng=np.random.default_rng(0), search=False).fit


def with_line(fit: Fit, frequency: float, what: str = "harmonic_forcing") -> Fit:
    """The same with a harmonic force or a hum of a frequency, Hz, in its model."""
    scales, effects = campaign_scales(fit), (BY_ID[what],)
    density = extend(fit, effects, scales)
    shapes = {f"{what}.frequency": frequency}
    mode = transfer(fit, density.oscillator.layout, effects, scales, shapes)
    return replace(fit, density=density, mode=mode)


@pytest.mark.parametrize("count", [1, 2, 3, 32])
def test_lines_turned_by_equal_steps_are_sines_and_cosines(count):
    lines, times = 3.7 + 0.31 * np.arange(count), 0.2 + 1e-3 * np.arange(4000)
    expected = np.exp(2j * np.pi * np.outer(lines, times))
    np.testing.assert_allclose(rotations(lines, times), expected, atol=1e-11)
    uneven = lines**1.1
    expected = np.exp(2j * np.pi * np.outer(uneven, times))
    np.testing.assert_allclose(rotations(uneven, times), expected, atol=1e-11)
