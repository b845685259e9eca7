"""Every fault is found where it was put, and nothing is found where there is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter, savgol_filter

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.faults.clipped import find_clipped
from bayesimpact.data.faults.fault import Fault
from bayesimpact.data.faults.find import find_faults, recording_faults, set_aside
from bayesimpact.data.faults.flat import reading_step
from bayesimpact.data.faults.local import FORMS, predict_sides, rounding_error
from bayesimpact.data.faults.slip import find_slips
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording

NOISE = 5e-6
Change = Callable[[np.ndarray], np.ndarray]


@pytest.fixture(scope="module")
def paper() -> Campaign:
    """A recording per stop: each is looked at by itself, or against the others for copies."""
    campaign = load_campaign(bundled_campaign("paper"))
    return replace(campaign, recordings=campaign.recordings[1::3])


def spoiled(campaign: Campaign, change: Change, number: int = 1) -> Campaign:
    recordings = list(campaign.recordings)
    samples = change(recordings[number].samples.copy())
    recordings[number] = replace(recordings[number], samples=samples)
    return replace(campaign, recordings=tuple(recordings))


def only(campaign: Campaign, number: int = 1) -> Fault:
    faults = [f for f in find_faults(campaign) if f.action != "notice"]
    assert [(f.recording, len(faults)) for f in faults] == [(campaign.recordings[number].name, 1)]
    return faults[0]


def covered(fault: Fault) -> set[int]:
    return {i for a, b in fault.spans for i in range(a, b)}


@pytest.mark.parametrize("name", ["paper", "concealed"])
def test_good_recordings_have_none(name: str) -> None:
    campaign = load_campaign(bundled_campaign(name))
    assert find_faults(campaign) == ()
    assert set_aside(campaign)[0] is campaign


@pytest.mark.parametrize("width", [1, 3])
@pytest.mark.parametrize("size", [2e-3, 2e-4])
def test_spikes(paper: Campaign, size: float, width: int) -> None:
    places = [812, 1500, 2222, 3340, 5001]

    def change(x: np.ndarray) -> np.ndarray:
        for k, i in enumerate(places):
            x[i : i + width] += size * (-1) ** k
        return x

    fault = only(spoiled(paper, change))
    assert fault.id == "recording_spikes"
    assert covered(fault) == {i + k for i in places for k in range(width)}
    assert fault.size == pytest.approx(size, rel=0.2)
    assert fault.remedy.startswith("exclude_s = [[0.8116, ")


def pendulum_with_spikes(size: float) -> Recording:
    """A slow decay under coloured noise with three spikes of three samples, in units of noise."""
    rng, n = np.random.default_rng(4), 3800
    noise = lfilter([1.0], [1.0, -0.48], 3.4e-5 * rng.standard_normal(n + 50))[50:]
    t = 0.01 * np.arange(n)
    x = -0.04 * np.exp(-0.02 * t) * np.cos(2 * np.pi * t / 1.04) + noise
    for place, sign in ((830, 1), (1910, -1), (3410, 1)):
        x[place : place + 3] += sign * size * 3.9e-5
    return Recording("decay", "", x, 0.01)


def test_what_lies_behind_a_spike_is_no_slip() -> None:
    """The motion goes on behind it where it would have gone."""
    for size in (15.0, 25.0, 60.0):
        assert "recording_slip" not in {f.id for f in recording_faults(pendulum_with_spikes(size))}


def test_an_impact_is_no_spike_however_short() -> None:
    """A mass thrown back within three samples, at every period: corners, always at one place."""
    rng = np.random.default_rng(1)
    t = np.arange(4000) * 1e-3
    phase = (2 * np.pi * 6.4 * t) % np.pi
    x = -6e-3 * np.exp(-0.1 * t) * np.sin(phase) + NOISE * rng.standard_normal(t.size)
    recording = Recording("r", "1", x, 1e-3)
    assert find_faults(Campaign("c", 0.5, (recording,))) == ()


@pytest.mark.parametrize("count", [20, 200])
def test_held_readings(paper: Campaign, count: int) -> None:
    def change(x: np.ndarray) -> np.ndarray:
        x[2500 : 2500 + count] = x[2499]
        return x

    fault = only(spoiled(paper, change))
    assert fault.id == "recording_held" and fault.spans == ((2499, 2500 + count),)
    assert f"{count + 1} readings held at " in fault.statement


@pytest.mark.parametrize("seed", [100, 132, 136])
def test_rounded_readings_that_repeat_where_a_smoothed_motion_turns_are_none(seed: int) -> None:
    """Behind a filter noise does not part readings: three of 260 such decays were called held."""
    rng = np.random.default_rng(seed)
    t = np.arange(5600) * 2.5e-3
    noise = 5.6e-5 * lfilter([1.0], [1.0, -0.2], rng.standard_normal(t.size))
    motion = 25e-3 * np.exp(-0.15 * t) * np.cos(2 * np.pi * 1.6 * t)
    x = np.round(savgol_filter(motion + noise, 11, 2) / 9.7e-6) * 9.7e-6
    assert recording_faults(Recording("a", "", x, 2.5e-3)) == []


@pytest.mark.parametrize("form", FORMS)
def test_rounding_moves_a_prediction_no_further_than_its_bound(form: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    x, step = np.cumsum(rng.standard_normal(4000)), 0.7
    exact, rounded = (predict_sides(y, form, 0, -0.5) for y in (x, np.round(x / step) * step))
    error = np.abs(rounded.before - exact.before)
    bound = rounding_error(form, -0.5, step)
    assert 0.5 * bound < np.nanmax(error) <= bound


def test_zeros(paper: Campaign) -> None:
    def change(x: np.ndarray) -> np.ndarray:
        x[2500:2530] = 0.0
        return x

    fault = only(spoiled(paper, change))
    assert fault.id == "recording_held" and fault.spans == ((2500, 2530),)
    assert "zeros" in fault.statement


def test_a_dead_tail_is_cut(paper: Campaign) -> None:
    def change(x: np.ndarray) -> np.ndarray:
        x[4000:] = x[3999]
        return x

    campaign = spoiled(paper, change)
    fault = only(campaign)
    assert (fault.id, fault.action) == ("recording_held", "cut")
    assert set_aside(campaign)[0].recordings[1].samples.size == 3999
    assert fault.remedy == "end_s = 3.9984"


def test_clipping_from_the_first_sample_on_is_no_rest(paper: Campaign) -> None:
    x = paper.recordings[1].samples
    limit = 0.98 * float(x[80:220].min())  # the second turning point on the side of the release
    fault = only(spoiled(paper, lambda x: np.maximum(x, limit)))
    assert fault.id == "recording_clipped" and fault.size == limit
    assert fault.spans[0][0] == 0 and len(fault.spans) == 2


@pytest.mark.parametrize("low", [True, False])
def test_clipping(paper: Campaign, low: bool) -> None:
    x = paper.recordings[1].samples
    limit = 0.8 * (x.min() if low else x.max())
    cut: Change = (lambda x: np.maximum(x, limit)) if low else (lambda x: np.minimum(x, limit))
    fault = only(spoiled(paper, cut))
    assert fault.id == "recording_clipped" and fault.size == limit
    assert covered(fault) == set(np.flatnonzero((x <= limit) if low else (x >= limit)))


def test_what_a_filter_made_of_clipped_readings_is_set_aside_with_them(paper: Campaign) -> None:
    """Every kept reading that the likelihood weighs is the filter's of readings that were whole."""
    x, window = paper.recordings[1].samples, 9
    limit = 0.8 * float(x.min())
    average = lambda x: savgol_filter(x, window, 0, mode="interp").round(9)  # noqa: E731
    campaign = spoiled(paper, lambda x: average(np.maximum(x, limit)))
    declared = replace(campaign.measurement, smoothing=Smoothing("savgol", window, 0))
    cleaned, faults = set_aside(replace(campaign, measurement=declared))
    assert [f.id for f in faults] == ["recording_clipped"]
    used, reach = cleaned.recordings[1].used, window // 2
    assert used is not None
    weighed = np.convolve(~used, np.ones(2 * reach + 1), mode="same") < 0.5  # see `Noise`
    spoilt = np.abs(average(np.maximum(x, limit)) - average(x)) > 0.0
    near = np.zeros(x.size, bool)  # cuts shorter than the window leave no two readings alike
    for first, end in faults[0].spans:
        near[max(first - window, 0) : end + window] = True
    assert (spoilt & near).sum() > 2 * window and not np.any(weighed & spoilt & near)
    assert weighed.mean() > 0.9


def scattered(x: np.ndarray, limit: float, scatter: float) -> np.ndarray:
    """Readings cut at both ends of a range that scatter there, as an accelerometer's do."""
    ends = limit - scatter * np.random.default_rng(1).exponential(size=x.size)
    return np.clip(x, -ends, ends)


def free_decay(case: str) -> Recording:
    t = np.arange(1500) * 1e-3
    noise = np.random.default_rng(2).normal(0.0, 0.005, t.size)
    samples = 10.0 * np.exp(-t) * np.cos(2 * np.pi * 20.0 * t) + noise
    return Recording("swing", case, samples, 1e-3, quantity="acceleration")


def test_clipping_at_ends_that_scatter() -> None:
    free = free_decay("")
    faults = find_clipped(replace(free, samples=scattered(free.samples, 8.0, 0.01)))
    assert [f.size for f in faults] == pytest.approx([8.0, -8.0], abs=0.01)
    largest = set(np.flatnonzero(free.samples > 8.1))
    assert largest <= covered(next(f for f in faults if f.size > 0.0))
    assert not find_clipped(free)


def test_what_an_obstacle_may_have_stopped_is_not_clipped() -> None:
    free = free_decay("a")
    assert not find_clipped(replace(free, samples=scattered(free.samples, 8.0, 0.01)))


@pytest.mark.parametrize("count", [15, 3])
def test_lost_samples(paper: Campaign, count: int) -> None:
    at = 2036
    fault = only(spoiled(paper, lambda x: np.delete(x, np.arange(at, at + count))))
    assert fault.id == "recording_slip"
    assert fault.start_s <= at * 1e-3 <= fault.end_s + 1e-9
    assert fault.remedy == "start_s = 2.0356"  # the longer part stays


def ringing_stop(release: float) -> np.ndarray:
    """6 s of a mass that meets a stop of 60 g on its own spring (70 Hz), which chatters and rings;
    symplectic Euler, 40 steps a millisecond, contact by a stiff spring.
    """
    own, y, v, x, u = 0.06 * (2 * np.pi * 70.0) ** 2, release, 0.0, 0.0, 0.0
    step, found = 1e-3 / 40, np.empty(6000)
    for i in range(found.size):
        found[i] = y
        for _ in range(40):
            force = max(4e5 * (y - 1.1e-3 - x) + 6.0 * (v - u), 0.0) if y - 1.1e-3 > x else 0.0
            v -= step * (806.0 * y + 0.6 * v + force) / 0.503
            u += step * (force - own * x - 1.06 * u) / 0.06
            y, x = y + step * v, x + step * u
    return found


@pytest.mark.parametrize("release", [-8e-3, -7e-3])
def test_chatter_on_a_ringing_stop_is_no_slip(release: float) -> None:
    noise = 3e-6 * np.random.default_rng(0).standard_normal(6000)
    recording = Recording("rings", "1", ringing_stop(release) + noise, 1e-3)
    assert find_slips(recording) == []


def test_samples_written_twice(paper: Campaign) -> None:
    at = 2036
    fault = only(spoiled(paper, lambda x: np.concatenate([x[:at], x[at - 10 :]])))
    assert fault.id == "recording_slip" and fault.start_s <= at * 1e-3 <= fault.end_s


def test_rest_and_pull_before_the_release(paper: Campaign) -> None:
    rng = np.random.default_rng(2)

    def rest(x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[0] + NOISE * rng.standard_normal(500), x])

    def pull(x: np.ndarray) -> np.ndarray:
        way = x[0] * np.clip((np.arange(1300) - 300) / 800, 0, 1)
        return np.concatenate([way + NOISE * rng.standard_normal(1300), x])

    for change, length in ((rest, 500), (pull, 1300)):
        campaign = spoiled(paper, change)
        fault = only(campaign)
        assert (fault.id, fault.action) == ("recording_start", "cut")
        assert length <= fault.spans[0][1] <= length + 12
        kept = set_aside(campaign)[0].recordings[1]
        assert kept.start == pytest.approx(fault.spans[0][1] * 1e-3)


def test_a_rest_under_smoothed_noise(paper: Campaign) -> None:
    """What a filter leaves of the noise is slow: differences tell a small part of it."""
    noise = 1e-4 * np.random.default_rng(3).standard_normal(180)
    slow = np.convolve(noise, np.full(21, 1 / 21), mode="valid")
    fault = only(spoiled(paper, lambda x: np.concatenate([x[0] + slow, x])))
    assert fault.id == "recording_start"
    assert slow.size <= fault.spans[0][1] <= slow.size + 12


@pytest.mark.parametrize("samples", [8.0, 16.0, 31.0])
def test_a_free_decay_of_few_samples_a_period_begins_at_once(samples: float) -> None:
    """Nothing that is done against spikes may bend it."""
    t = np.arange(800) / samples
    x = 5e-3 * np.exp(-0.02 * t) * np.cos(2 * np.pi * t)
    x += 5e-6 * np.random.default_rng(1).standard_normal(t.size)
    found = recording_faults(Recording("decay", "", x, 0.01))
    assert [f for f in found if f.action != "notice"] == []


def test_noise_that_rises_for_a_while(paper: Campaign) -> None:
    rng = np.random.default_rng(3)

    def change(x: np.ndarray) -> np.ndarray:
        x[3000:4000] += 4 * NOISE * rng.standard_normal(1000)
        return x

    fault = only(spoiled(paper, change))
    assert fault.id == "recording_noise"
    assert set(range(3000, 4000)) <= covered(fault) <= set(range(2600, 4400))


@pytest.mark.parametrize("first", [0, 777])
def test_one_recording_given_twice(paper: Campaign, first: int) -> None:
    one = paper.recordings[2]
    again = replace(one, name="again", samples=one.samples[first:])
    campaign = replace(paper, recordings=(*paper.recordings, again))
    fault = only(campaign, -1)
    assert (fault.id, fault.action) == ("recording_duplicate", "skip")
    assert one.name in fault.statement
    cleaned = set_aside(campaign)[0]
    assert [r.name for r in cleaned.recordings] == [r.name for r in paper.recordings]
    assert "again" in cleaned.skipped


def test_the_readings_step_is_told_and_enters_nothing_else(paper: Campaign) -> None:
    coarse = spoiled(paper, lambda x: np.round(x / 2e-4) * 2e-4)
    faults = find_faults(coarse)
    assert [(f.id, f.action) for f in faults] == [("recording_quantised", "notice")]
    assert faults[0].size == pytest.approx(2e-4)
    assert reading_step(paper.recordings[0].samples) == 0.0
    assert set_aside(coarse)[0] is coarse


def test_two_faults_at_once_keep_the_samples_numbers_of_the_file(paper: Campaign) -> None:
    rng = np.random.default_rng(4)

    def change(x: np.ndarray) -> np.ndarray:
        x = np.concatenate([x[0] + NOISE * rng.standard_normal(500), x])
        x[3000] += 1e-3
        x[4000:4030] = 0.0
        return x

    campaign = spoiled(paper, change)
    found = {f.id: f.spans for f in find_faults(campaign)}
    assert set(found) == {"recording_held", "recording_spikes", "recording_start"}
    assert found["recording_spikes"] == ((3000, 3001),)
    assert found["recording_held"] == ((4000, 4030),)
    cleaned = set_aside(campaign)[0].recordings[1]
    start = found["recording_start"][0][1]
    assert cleaned.used is not None
    gone = set(np.flatnonzero(~cleaned.used) + start)
    assert gone == {3000, *range(4000, 4030)}


def test_what_campaign_toml_set_aside_is_not_found_again(paper: Campaign) -> None:
    def change(x: np.ndarray) -> np.ndarray:
        x[2500] += 1e-3
        return x

    cleaned, faults = set_aside(spoiled(paper, change))
    assert len(faults) == 1 and find_faults(cleaned) == ()


def test_faults_are_kept_where_campaign_toml_says_so(paper: Campaign) -> None:
    def change(x: np.ndarray) -> np.ndarray:
        x[2500] += 1e-3
        return x

    campaign = replace(spoiled(paper, change), keep_faults=True)
    same, faults = set_aside(campaign)
    assert same is campaign and len(faults) == 1


@pytest.mark.parametrize("rest", [60, 150, 700])
def test_a_rest_behind_a_hum_is_found(paper: Campaign, rest: int) -> None:
    """Shorter than a period (about 150 samples), a hum of 90 um on readings of noise 5 um."""

    def change(x: np.ndarray) -> np.ndarray:
        noise = 5e-6 * np.random.default_rng(1).standard_normal(rest)
        whole = np.concatenate([x[0] + noise, x])
        return whole + 9e-5 * np.sin(2 * np.pi * 50.03 * 1e-3 * np.arange(whole.size) + 1.0)

    campaign = spoiled(paper, change)
    fault = only(campaign)
    assert fault.id == "recording_start"
    assert fault.spans[0][1] == pytest.approx(rest, abs=8)  # a turning point rests that long
    (notice,) = [f for f in find_faults(campaign) if f.action == "notice"]
    assert notice.id == "recording_hum" and "50.03 Hz" in notice.statement
    assert notice.size == pytest.approx(9e-5, rel=0.02)


def test_a_swing_to_the_other_side_is_no_hand() -> None:
    """Held on one side, let go: the first swing may read a little larger about a rest that is not
    known yet.
    """
    t = np.arange(0.0, 40.0, 0.01)
    free = 2.4 * np.exp(-0.02 * np.maximum(t - 1.0, 0.0)) * np.cos(3.2 * np.maximum(t - 1.0, 0.0))
    samples = (
        free + 0.15 * np.exp(-0.1 * t) + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    )
    fault = recording_faults(Recording("p", "", samples, 0.01, quantity="angle"))[0]
    assert fault.id == "recording_start" and "at rest" in fault.statement
    assert fault.end_s == pytest.approx(1.0, abs=0.12)
