"""Initial estimates over many random rigs, and over the special ones."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from rigs import PAPER, Rig, paper_motion, random_rig
from scipy.signal import lfilter, savgol_filter

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.gaps import without
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.initial.estimates import Estimates, estimate

STIFFNESS = {"1": 5350.156, "2": 4776.275, "3": 2959.249}


def wrong(rig: Rig, found: Estimates) -> set[str]:
    """Kinds of parameters that are further off than a start of the identification may be."""
    values, bad = found.values, set()
    for name, true in rig.truth.items():
        kind, ratio = name.split("[")[0], values[name] / true if true else np.nan
        size, speed = rig.amplitude, rig.amplitude * np.sqrt(rig.truth["k1"] / rig.campaign.mass)
        good = {
            "k1": lambda r=ratio: abs(r - 1) < 0.03,
            "c1": lambda r=ratio: 1 / 3 < r < 3,
            "c2": lambda r=ratio: 1 / 3 < r < 3,
            "k2": lambda r=ratio: 1 / 2 < r < 2,
            "g": lambda n=name, t=true: abs(values[n] - t) < max(0.3 * abs(t), 3 * rig.noise),
            "y0": lambda n=name, t=true, s=size: abs(values[n] - t) < 0.03 * s + 4 * rig.noise,
            "v0": lambda n=name, t=true, v=speed: abs(values[n] - t) < 0.1 * v,
            "offset": lambda n=name, t=true, s=size: abs(values[n] - t) < 0.01 * s + rig.noise,
        }[kind]
        if not good():
            bad.add(kind)
    return bad


Found = list[tuple[Rig, Estimates]]


def all_of(rigs: list[Rig]) -> Found:
    return [(rig, estimate(rig.campaign)) for rig in rigs]


def failures(found: Found) -> dict[str, int]:
    return dict(Counter(kind for pair in found for kind in wrong(*pair)))


@pytest.fixture(scope="module")
def many() -> Found:
    return all_of([random_rig(seed) for seed in range(20)])


def paper_campaign(
    n: int = 6000, sigma: float = 5e-6, smooth: bool = False, **changed: float
) -> Campaign:
    """Nine recordings like the paper's, (optionally) smoothed as its authors did."""
    rng = np.random.default_rng(5)
    recordings = []
    for case, k2 in STIFFNESS.items():
        for name, y0 in (("a", -6.5e-3), ("b", -5e-3), ("c", -4e-3)):
            motion = paper_motion(n, k2=k2, y0=y0, **changed)
            samples = motion + 1e-5 + sigma * rng.standard_normal(n)
            if smooth:
                samples = savgol_filter(samples, 19, 2)
            recordings.append(Recording(f"case{case}_{name}", case, samples, 1e-3))
    return Campaign("paper", PAPER["mass"], tuple(recordings))


@pytest.mark.long
def test_many_random_rigs(many: Found) -> None:
    """One of 200 rigs drawn like this missed one parameter (c2) when the test was written."""
    counts = failures(many)
    assert all(count <= 1 for count in counts.values()), counts


@pytest.mark.long
def test_the_errors_are_of_the_size_they_say(many: Found) -> None:
    """Standardised errors neither vanish nor explode; floors make them rather too large."""
    ratios = np.array(
        [
            abs(found.values[name] - true) / found.sd[name]
            for rig, found in many
            for name, true in rig.truth.items()
            if name in ("k1", "c1", "g") or name.startswith("k2")
        ]
    )
    assert 0.02 < np.median(ratios) < 1.5
    assert np.mean(ratios > 6) < 0.05


def test_random_rigs_without_a_stop() -> None:
    found = all_of([random_rig(seed, stop=False) for seed in range(20)])
    assert not failures(found)
    first = found[0][1]
    assert first.g == np.inf
    assert first.c2 == 0.0
    assert not first.k2
    assert "g" not in first.values


def test_random_rigs_without_a_gap() -> None:
    counts = failures(all_of([random_rig(seed, gap=0.0) for seed in range(12)]))
    assert all(count <= 1 for count in counts.values()), counts


def test_random_preloaded_rigs() -> None:
    """Harder: at rest the mass touches, and flights are few. Most must still be right."""
    rigs = [random_rig(seed, gap=-0.05) for seed in range(15)]
    found = [estimate(rig.campaign) for rig in rigs]
    off = [abs(e.k1 / rig.truth["k1"] - 1) for e, rig in zip(found, rigs, strict=True)]
    assert np.sum(np.array(off) > 0.03) <= 3
    assert np.median(off) < 0.01
    below = [e.g < 0 for e in found]
    assert np.mean(below) > 0.8


@pytest.mark.parametrize("g", [-1e-3, -3e-3])
def test_a_preloaded_rig_in_detail(g: float) -> None:
    """Seen in the mirror it is an ordinary rig, and as well determined."""
    rng = np.random.default_rng(0)
    recordings = tuple(
        Recording(name, "1", paper_motion(g=g, y0=y0) + 5e-6 * rng.standard_normal(6000), 1e-3)
        for name, y0 in (("a", -6.5e-3), ("b", -5e-3))
    )
    found = estimate(Campaign("preloaded", PAPER["mass"], recordings))
    assert found.k1 == pytest.approx(PAPER["k1"], rel=0.005)
    assert found.g == pytest.approx(g, rel=0.02)
    assert found.k2["1"] == pytest.approx(PAPER["k2"], rel=0.005)
    assert found.c2 == pytest.approx(PAPER["c2"], rel=0.1)
    assert found.offset["a"] == pytest.approx(0.0, abs=2e-5)
    assert found.y0["b"] == pytest.approx(-5e-3, abs=3e-5)


def test_few_noisy_half_cycles() -> None:
    """Flights alone tell k1 to 4 % here, since the rest reading is open; the cycles settle both."""
    off = []
    for seed in range(12):
        noise = 6e-5 * np.random.default_rng(seed).standard_normal(1000)
        recording = Recording("a", "1", paper_motion(1000) + noise, 1e-3)
        off.append(estimate(Campaign("few", PAPER["mass"], (recording,))).k1 / PAPER["k1"] - 1)
    assert np.sqrt(np.mean(np.square(off))) < 0.007


def test_random_rigs_that_never_touch() -> None:
    for seed in range(8):
        rig = random_rig(seed, gap=1.2)
        if any(rig.truth[n] > 0.6 * rig.amplitude for n in rig.truth if n.startswith("y0")):
            continue  # released from inside the stop
        found = estimate(rig.campaign)
        # The whole recording is one free tail.
        assert abs(found.k1 / rig.truth["k1"] - 1) < 1e-3
        assert abs(found.c1 / rig.truth["c1"] - 1) < 0.02
        reached = max(
            float((r.samples - rig.truth[f"offset[{r.name}]"]).max())
            for r in rig.campaign.recordings
        )
        assert found.g == pytest.approx(reached, abs=0.02 * rig.amplitude)
        assert all(np.isinf(found.sd[n]) for n in ("g", "c2", "k2[0]"))
        assert sum(found.impacts.values()) == 0


def test_paper_campaign() -> None:
    found = estimate(paper_campaign())
    assert found.k1 == pytest.approx(PAPER["k1"], rel=1e-4)
    assert found.c1 == pytest.approx(PAPER["c1"], rel=0.02)
    assert found.g == pytest.approx(PAPER["g"], rel=1e-3)
    assert found.c2 == pytest.approx(PAPER["c2"], rel=0.03)
    for case, k2 in STIFFNESS.items():
        assert found.k2[case] == pytest.approx(k2, rel=5e-3)
    for name, value in found.offset.items():
        assert value == pytest.approx(1e-5, abs=1e-6)
        assert found.noise[name] == pytest.approx(5e-6, rel=0.1)
        assert 20 < found.impacts[name] < 45
    assert found.y0["case1_a"] == pytest.approx(-6.5e-3, abs=1e-5)
    assert found.v0["case1_a"] == pytest.approx(0.0, abs=5e-4)


def test_smoothed_recordings() -> None:
    """The paper's filter clips the contacts by 10 um: the estimates bear it."""
    found = estimate(paper_campaign(sigma=1e-5, smooth=True))
    assert found.k1 == pytest.approx(PAPER["k1"], rel=1e-3)
    assert found.g == pytest.approx(PAPER["g"], rel=0.02)
    for case, k2 in STIFFNESS.items():
        assert found.k2[case] == pytest.approx(k2, rel=0.05)


def test_impacts_to_the_end_of_the_recording() -> None:
    found = estimate(paper_campaign(n=1200))
    assert found.k1 == pytest.approx(PAPER["k1"], rel=2e-3)
    assert found.g == pytest.approx(PAPER["g"], rel=0.02)
    assert found.k2["1"] == pytest.approx(STIFFNESS["1"], rel=0.05)


def test_a_single_recording_of_three_periods() -> None:
    samples = paper_motion(450) + 5e-6 * np.random.default_rng(0).standard_normal(450)
    campaign = Campaign("short", PAPER["mass"], (Recording("a", "1", samples, 1e-3),))
    found = estimate(campaign)
    assert found.k1 == pytest.approx(PAPER["k1"], rel=0.03)
    assert found.g == pytest.approx(PAPER["g"], rel=0.3)
    assert STIFFNESS["1"] / 2 < found.k2["1"] < STIFFNESS["1"] * 2


def test_different_rates_and_lengths_in_one_campaign() -> None:
    rng = np.random.default_rng(1)
    recordings = tuple(
        Recording(
            str(i), "1", paper_motion(n, dt) + 5e-6 * rng.standard_normal(n), dt, start=3.0 * i
        )
        for i, (n, dt) in enumerate([(1200, 5e-3), (3000, 1e-3), (40_000, 5e-5)])
    )
    found = estimate(Campaign("mixed", PAPER["mass"], recordings))
    assert found.k1 == pytest.approx(PAPER["k1"], rel=1e-3)
    assert found.k2["1"] == pytest.approx(PAPER["k2"], rel=0.05)


def test_a_case_that_never_touches_is_said_so() -> None:
    rng = np.random.default_rng(2)
    recordings = tuple(
        Recording(case, case, paper_motion(y0=y0) + 5e-6 * rng.standard_normal(6000), 1e-3)
        for case, y0 in (("hit", -6e-3), ("miss", -1e-3))
    )
    found = estimate(Campaign("two", PAPER["mass"], recordings))
    assert np.isfinite(found.sd["k2[hit]"])
    assert np.isinf(found.sd["k2[miss]"])
    assert found.k2["miss"] == pytest.approx(found.k2["hit"])
    assert found.impacts["miss"] == 0


@pytest.mark.parametrize("unit", [1e-6, 1e3])
def test_the_unit_does_not_matter(unit: float) -> None:
    """Lengths in another unit: k1, k2, c1, c2 stay, the others scale."""
    campaign = paper_campaign(n=1500)
    scaled = Campaign(
        "scaled",
        campaign.mass,
        tuple(
            Recording(r.name, r.case, unit * np.asarray(r.samples), r.interval)
            for r in campaign.recordings
        ),
    )
    one, other = estimate(campaign), estimate(scaled)
    for name, value in one.values.items():
        factor = 1.0 if name[:2] in ("k1", "c1", "k2", "c2") else unit
        assert other.values[name] == pytest.approx(factor * value, rel=1e-3, abs=1e-6 * factor)


@pytest.mark.parametrize("stop", [True, False])
def test_noise_alone_is_refused(stop: bool) -> None:
    noise = 1e-6 * np.random.default_rng(0).standard_normal(2000)
    campaign = Campaign("noise", 1.0, (Recording("a", "1", noise, 1e-3),), stop)
    with pytest.raises(InputError, match="no oscillation"):
        estimate(campaign)


def plain(samples: np.ndarray, interval: float) -> Campaign:
    return Campaign("p", 1.0, (Recording("p", "", samples, interval),), stop=False)


def test_two_slow_periods_are_an_oscillation() -> None:
    """Few half cycles are whole; a decaying sine explains the readings all the same."""
    t = np.arange(0.0, 36.0, 0.1)
    y = 0.04 * np.exp(-0.08 * t) * np.cos(0.71 * t + 0.4)
    y += 4e-3 * np.random.default_rng(3).standard_normal(t.size)
    assert estimate(plain(y, 0.1)).k1 == pytest.approx(0.71**2 + 0.08**2, rel=0.03)


@pytest.mark.parametrize("seed", range(4))
def test_a_line_in_much_noise_is_an_oscillation(seed: int) -> None:
    """A steady line of less than half of the variance; readings without it are refused."""
    t = np.arange(400) / 40.0
    noise = 2.6e-3 * np.random.default_rng(seed).standard_normal(t.size)
    y = 3e-3 * np.cos(2 * np.pi * 4.16 * t) + noise
    assert estimate(plain(y, 1 / 40)).k1 == pytest.approx((2 * np.pi * 4.16) ** 2, rel=0.02)
    with pytest.raises(InputError, match="no oscillation"):
        estimate(plain(noise, 1 / 40))


def test_many_modes_are_a_motion_and_what_wanders_is_none() -> None:
    """No line explains most of a ring of many modes, nor of a walk, whose steps are smooth too."""
    rng = np.random.default_rng(1)
    t = np.arange(4000) * 5e-6
    modes = zip((3900.0, 4400.0, 4700.0, 5100.0, 5600.0, 6300.0), rng.uniform(0, 6, 6), strict=True)
    ring = np.exp(-t / 4e-3) * sum(np.cos(2 * np.pi * f * t + p) for f, p in modes)
    assert 3500.0 < np.sqrt(estimate(plain(ring, 5e-6)).k1) / (2 * np.pi) < 6500.0
    for rho in (1.0, 0.98):
        x = lfilter([1.0], [1.0, -rho], rng.standard_normal(4000))
        with pytest.raises(InputError, match="no oscillation"):
            estimate(plain(x, 1e-3))


def test_a_beat_is_an_oscillation() -> None:
    t = np.arange(0.0, 6.6, 0.025)
    y = np.cos(14.2 * t) + 0.5 * np.cos(13.0 * t + 1.0) + 0.5 * np.cos(1.1 * t)
    y += 5e-3 * np.random.default_rng(3).standard_normal(t.size)
    assert estimate(plain(y, 0.025)).k1 == pytest.approx(14.2**2, rel=0.03)


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_no_frequency_beyond_half_the_sampling_rate(noise: float) -> None:
    """Noise about a rest before the motion passes as fast half cycles: their frequency is none."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 40.0, 0.1)
    y = 0.13 * np.exp(-0.08 * t) * np.cos(0.7 * t)
    hand = 0.12 * rng.choice([-1.0, 1.0], 12)
    y = np.concatenate([hand, y]) + noise * rng.standard_normal(t.size + 12)
    assert estimate(plain(y, 0.1)).k1 == pytest.approx(0.49, rel=0.2)


def test_a_plain_oscillator_passes_its_rest() -> None:
    """A tone that does not decay beside the motion: the centres of the swings lie elsewhere."""
    t = np.arange(600) * 2e-3
    swing = -6e-3 * np.exp(-0.15 * t) * np.cos(2 * np.pi * 6.4 * t) + 1e-3 * np.cos(80.4 * t)
    samples = swing + 5e-6 * np.random.default_rng(0).standard_normal(600)
    recording = Recording("a", "", samples, 2e-3)
    found = estimate(Campaign("rig", 0.503, (recording,), stop=False))
    assert found.k1 == pytest.approx(0.503 * (2 * np.pi * 6.4) ** 2, rel=0.01)
    assert abs(found.offset["a"]) < 1e-3


@pytest.mark.long
def test_what_stands_in_a_long_gap_is_no_motion(many: Found) -> None:
    """The estimates of a campaign with a quarter of one recording set aside are as good."""
    holed: Found = []
    for rig, _ in many[:20]:
        last = rig.campaign.recordings[-1]
        size = last.samples.size
        gap = without(last, [(int(0.3 * size), int(0.55 * size))])
        campaign = replace(rig.campaign, recordings=(*rig.campaign.recordings[:-1], gap))
        holed.append((rig, estimate(campaign)))
    worse = [
        rig
        for (rig, found), (_, before) in zip(holed, many[:20], strict=True)
        if wrong(rig, found) - wrong(rig, before)
    ]
    assert len(worse) <= 1
