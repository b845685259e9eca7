"""Keys of campaign.toml that deal with a recording's faults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from campaigns import csv, decay, write

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.gaps import bridged
from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError

HEAD = 'name = "rig"\nmass_kg = 0.5\nstop = false\n'
ONE = HEAD + '[[recording]]\nfile = "a.csv"\n'


def load(folder: Path, keys: str = "", a: str | None = None, head: str = HEAD) -> Campaign:
    toml = f'{head}[[recording]]\nfile = "a.csv"\n{keys}\n'
    return load_campaign(write(folder, toml, a=csv() if a is None else a))


def test_excluded_samples_are_marked_and_bridged(tmp_path: Path) -> None:
    samples = decay()
    samples[100:104] += 1.0
    text = csv(samples, start=115.0)
    recording = load(tmp_path, "exclude_s = [[115.2, 115.206], [115.5, 115.5]]", text).recordings[0]
    assert recording.used is not None
    assert np.flatnonzero(~recording.used).tolist() == [100, 101, 102, 103, 250]
    assert recording.count == recording.samples.size - 5
    # a cubic from parabolas, 78 samples per period: the stand-in is no evidence, only near
    np.testing.assert_allclose(recording.samples, decay(), atol=1e-5)
    with pytest.raises(ValueError, match="read-only"):
        recording.used[0] = False


def test_the_mask_follows_a_shortened_and_a_thinned_campaign(tmp_path: Path) -> None:
    campaign = load(tmp_path, "exclude_s = [[0.2, 0.206]]")
    assert campaign.truncated(0.1).recordings[0].used is None
    thin = campaign.thinned(4e-3).recordings[0]
    assert thin.used is not None and np.flatnonzero(~thin.used).tolist() == [50, 51]


def test_a_long_gap_is_bridged_by_neighbouring_periods() -> None:
    samples = decay()
    used = np.ones(samples.size, dtype=bool)
    used[200:290] = False  # more than a period of 78 samples
    spoiled = np.where(used, samples, 0.0)
    error = bridged(spoiled, used) - samples
    assert np.abs(error).max() < 0.1 * np.abs(samples).max()


@pytest.mark.parametrize("keys", ["invert = true", "scale = -1.0"])
def test_sign_and_scale(tmp_path: Path, keys: str) -> None:
    np.testing.assert_allclose(load(tmp_path, keys).recordings[0].samples, -decay(), rtol=1e-11)


def test_scale(tmp_path: Path) -> None:
    samples = load(tmp_path, "scale = 1000").recordings[0].samples
    np.testing.assert_allclose(samples, 1e3 * decay(), rtol=1e-11)


def test_clock_ratio_is_true_time_over_the_files_and_spans_stay_on_the_files(
    tmp_path: Path,
) -> None:
    keys = "clock_ratio = 1.01\nexclude_s = [[0.2, 0.2]]"
    recording = load(tmp_path, keys).recordings[0]
    assert recording.interval == pytest.approx(2e-3 * 1.01)
    assert recording.used is not None and np.flatnonzero(~recording.used).tolist() == [100]


def test_an_uneven_clock_is_refused_with_the_remedy_and_resampled_with_it(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    times = np.arange(600) * 2e-3 + rng.uniform(-4e-4, 4e-4, 600)
    times[300:] += 0.05  # and a gap
    wave = lambda t: -6e-3 * np.cos(2 * np.pi * 6.4 * t)  # noqa: E731
    text = "time_s,displacement_m\n" + "".join(
        f"{t:.9g},{y:.12g}\n" for t, y in zip(times, wave(times), strict=True)
    )
    with pytest.raises(InputError, match="resample = true"):
        load(tmp_path, "", text)
    recording = load(tmp_path, "resample = true", text).recordings[0]
    assert recording.used is not None and 20 <= (~recording.used).sum() <= 26
    even = times[0] + recording.times
    error = recording.samples - wave(even)
    assert np.abs(error[recording.used]).max() < 1e-6


def test_millisecond_stamps_keep_the_readings(tmp_path: Path) -> None:
    times = np.round(np.arange(600) * 2.048e-3, 3)
    text = "time_s,displacement_m\n" + "".join(
        f"{t:.3f},{y:.12g}\n" for t, y in zip(times, decay(), strict=True)
    )
    recording = load(tmp_path, "resample = true", text).recordings[0]
    np.testing.assert_allclose(recording.samples, decay(), rtol=1e-11)
    assert recording.interval == pytest.approx(2.048e-3, rel=3e-5)


def test_a_skipped_recording_is_left_out_with_its_reason(tmp_path: Path) -> None:
    toml = ONE + '[[recording]]\nfile = "gone.csv"\nskip = "the probe came loose"\n'
    campaign = load_campaign(write(tmp_path, toml))
    assert [r.name for r in campaign.recordings] == ["a"]
    assert dict(campaign.skipped) == {"gone": "the probe came loose"}
    with pytest.raises(InputError, match="one recording without skip"):
        load_campaign(write(tmp_path, ONE + 'skip = "why"\n'))


def test_no_filter_at_all_can_be_stated(tmp_path: Path) -> None:
    campaign = load(tmp_path, '[measurement]\nsmoothing = "none"')
    assert campaign.measurement.unfiltered and campaign.measurement.smoothing is None
    assert not load(tmp_path).measurement.unfiltered


def test_faults_can_be_kept(tmp_path: Path) -> None:
    assert not load(tmp_path).keep_faults
    assert load(tmp_path, head='faults = "keep"\n' + HEAD).keep_faults


@pytest.mark.parametrize(
    ("keys", "named"),
    [
        ("exclude_s = [[0.3, 0.2]]", "exclude_s: found a span from 0.3 to 0.2 s"),
        ("exclude_s = [[5.0, 6.0]]", "exclude_s: found no sample from 5 to 6 s"),
        ("exclude_s = [[0.01, 1.19]]", "exclude_s: found 9 of 600 samples left"),
        ("exclude_s = [[0.1]]", "key exclude_s: found a list"),
        ("exclude_s = 0.1", "key exclude_s: found 0.1"),
        ("scale = 0", "key scale: found 0"),
        ("clock_ratio = 0.0", "key clock_ratio: found 0"),
        ('invert = "yes"', 'key invert: found the text "yes"'),
        ("skip = true", "key skip: found true"),
        ('[measurement]\nsmoothing = "some"', "smoothing"),
    ],
)
def test_what_is_refused(tmp_path: Path, keys: str, named: str) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, keys)
    assert named in str(caught.value)
