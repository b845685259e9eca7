"""The rig without effects against exact motions, its own tolerances and its conventions."""

from __future__ import annotations

import ast
import cmath
from math import acos, asin, hypot, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import bayesimpact.trial
from bayesimpact.errors import InputError
from bayesimpact.trial.bundle import PAPER_RIG
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Release, Rig, make_campaign, motion, record

PLAIN = Rig(mass=0.503, c1=0.148, k1=808.556)
LOSSLESS = Rig(mass=0.5, c1=0.0, k1=800.0, c2=0.0, g=1e-3, k2={"1": 5000.0})


def test_it_imports_nothing_of_the_simulators():
    folder = Path(bayesimpact.trial.__file__).parent
    allowed = ("bayesimpact.data", "bayesimpact.errors", "bayesimpact.trial.rig")
    seen = 0
    for file in [*folder.glob("rig/*.py"), folder / "bundle.py"]:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            ours = [name for name in names if name.startswith("bayesimpact")]
            assert all(name.startswith(allowed) for name in ours), (file, ours)
            seen += len(ours)
    assert seen > 10


def test_free_decay_is_the_damped_cosine():
    run = motion(PLAIN, Release("r", "", -6e-3, 0.05), rate=1000, duration=6)
    b = PLAIN.c1 / PLAIN.mass / 2
    w = sqrt(PLAIN.k1 / PLAIN.mass - b * b)
    t = np.arange(6000) / 1000
    exact = np.exp(-b * t) * (-6e-3 * np.cos(w * t) + (0.05 - b * 6e-3) / w * np.sin(w * t))
    assert np.abs(run.displacement - exact).max() < 1e-12
    assert run.onsets == ()


def linear_motion(c, k, load, mass, y, v):
    """Solution of m y'' + c y' + k y = load by its two complex exponentials: h -> (y, v)."""
    root = cmath.sqrt((c / mass) ** 2 / 4 - k / mass)
    fast, slow = -c / mass / 2 - root, -c / mass / 2 + root
    u = y - load / k
    a = (v - slow * u) / (fast - slow)

    def at(h):
        one, two = a * cmath.exp(fast * h), (u - a) * cmath.exp(slow * h)
        return (one + two).real + load / k, (fast * one + slow * two).real

    return at


def exact_bilinear(rig, case, y, v, times):
    """Displacement from one exact linear motion to the next; touches by root finding."""
    k2, out, t, contact = rig.k2[case], np.empty(times.size), 0.0, False
    while t <= times[-1]:
        c, k = (rig.c1 + rig.c2, rig.k1 + k2) if contact else (rig.c1, rig.k1)
        at = linear_motion(c, k, k2 * rig.g if contact else 0.0, rig.mass, y, v)
        # contacts last more than 5 ms: two neighbouring points of this grid cannot hide one
        grid = 2e-3 * np.arange(1, 200)
        beyond = [h for h in grid if (at(h)[0] > rig.g) != contact][:1]
        h = times[-1] + 1 - t
        if beyond:
            ends = beyond[0] - 2e-3, beyond[0]
            h = brentq(lambda s, at=at: at(s)[0] - rig.g, *ends, xtol=1e-16, rtol=9e-16)
        here = (times >= t) & (times < t + h)
        out[here] = [at(s - t)[0] for s in times[here]]
        y, v, t, contact = rig.g, at(h)[1], t + h, not contact
    return out


def test_impacts_follow_the_exact_piecewise_linear_motion():
    release = Release("r", "2", -6.2e-3, 0.02)
    run = motion(PAPER_RIG, release, rate=500, duration=1.5)
    exact = exact_bilinear(PAPER_RIG, "2", release.y0, release.v0, run.times)
    assert len(run.onsets) == 13
    assert np.abs(run.displacement - exact).max() < 1e-12


def test_period_with_an_elastic_stop():
    """T = (pi + 2 asin(g/A))/w1 + (2/w2) acos(d/a2), d = g k1/(k1 + k2), a2 = hypot(d, vg/w2)."""
    m, k1, k2, g, amplitude = 0.5, 800.0, 5000.0, 1e-3, 5e-3
    w1, w2 = sqrt(k1 / m), sqrt((k1 + k2) / m)
    vg = w1 * sqrt(amplitude**2 - g**2)
    d = g * k1 / (k1 + k2)
    period = (pi + 2 * asin(g / amplitude)) / w1 + 2 / w2 * acos(d / hypot(d, vg / w2))
    run = motion(LOSSLESS, Release("r", "1", -amplitude), rate=100, duration=6)
    gaps = np.diff(run.onsets)
    assert gaps.size > 30
    assert np.abs(gaps - period).max() < 1e-11
    assert np.abs(np.diff(run.ends) - period).max() < 1e-11


@pytest.mark.parametrize(("excess", "touches"), [(1e-9, 7), (-1e-9, 0)])
def test_grazing_contact_shorter_than_any_step_is_seen(excess, touches):
    """It lasts 2 sqrt(2 x 1e-9) / w1 = 2 us; the integrator's steps are milliseconds."""
    run = motion(LOSSLESS, Release("r", "1", -1e-3 * (1 + excess)), rate=100, duration=1.1)
    assert len(run.onsets) == touches
    lasting = np.subtract(run.ends, run.onsets)
    assert np.allclose(lasting, 2 * sqrt(2e-9) / 40, rtol=0.02)


@pytest.mark.parametrize("case", ["1", "3"])
def test_tighter_tolerances_change_less_than_a_picometre(case):
    release = Release("r", case, -6.5e-3)
    run = motion(PAPER_RIG, release, rate=1000, duration=6)
    tight = motion(PAPER_RIG, release, rate=1000, duration=6, rtol=3e-14, atol=1e-17)
    assert np.abs(run.displacement - tight.displacement).max() < 1e-12
    assert np.abs(run.velocity - tight.velocity).max() < 1e-10


def test_sampling_rate_does_not_change_the_motion():
    release = Release("r", "1", -5e-3)
    slow = motion(PAPER_RIG, release, rate=100, duration=2)
    fast = motion(PAPER_RIG, release, rate=1000, duration=2)
    assert np.abs(fast.displacement[::10] - slow.displacement).max() < 1e-13


def test_recording_that_starts_beyond_the_gap_starts_in_contact():
    run = motion(PAPER_RIG, Release("r", "1", 2e-3, -0.01), rate=1000, duration=0.1)
    assert run.onsets[0] == 0.0
    k2 = PAPER_RIG.k2["1"]
    force = PAPER_RIG.k1 * 2e-3 + k2 * 0.9e-3 - 0.01 * (PAPER_RIG.c1 + PAPER_RIG.c2)
    slope = (run.velocity[1] - run.velocity[0]) / 1e-3
    assert slope == pytest.approx(-force / PAPER_RIG.mass, rel=0.03)


def test_preloaded_stop_comes_to_rest_in_contact():
    rig = Rig(mass=0.5, c1=2.0, k1=800.0, c2=10.0, g=-1e-3, k2={"1": 5000.0})
    run = motion(rig, Release("r", "1", -4e-3), rate=1000, duration=4)
    assert len(run.onsets) == len(run.ends) + 1
    assert run.displacement[-1] == pytest.approx(-1e-3 * 5000 / 5800, abs=1e-9)


def test_overdamped_contact():
    rig = Rig(mass=0.5, c1=0.0, k1=800.0, c2=400.0, g=1e-3, k2={"1": 5000.0})
    run = motion(rig, Release("r", "1", -5e-3), rate=200, duration=0.4)
    exact = exact_bilinear(rig, "1", -5e-3, 0.0, run.times)
    assert np.abs(run.displacement - exact).max() < 1e-12


def test_same_generator_state_same_bits_and_order_matters():
    releases = [Release("a", "1", -5e-3), Release("b", "3", -4e-3)]
    chain = MeasuringChain(noise=5e-6, correlation=0.3, offsets={"a": 1e-5})

    def campaign(seed, order):
        rng = np.random.default_rng(seed)
        return make_campaign("c", PAPER_RIG, order, chain=chain, rate=1000, duration=0.5, rng=rng)

    first, again = campaign(3, releases), campaign(3, releases)
    for one, other in zip(first.recordings, again.recordings, strict=True):
        assert one.name == other.name
        assert np.array_equal(one.samples, other.samples)
    turned = campaign(3, releases[::-1])
    assert not np.array_equal(first.recordings[0].samples, turned.recordings[1].samples)
    # recording by recording gives the same as the whole campaign
    rng = np.random.default_rng(3)
    alone = [record(PAPER_RIG, r, {}, chain, rate=1000, duration=0.5, rng=rng) for r in releases]
    assert np.array_equal(alone[1], first.recordings[1].samples)
    assert first.mass == PAPER_RIG.mass
    assert first.recordings[0].interval == 1e-3


def test_rig_without_obstacle_makes_a_campaign_without_stop():
    rng = np.random.default_rng(0)
    campaign = make_campaign("c", PLAIN, [Release("a", "", 1e-3)], rate=50, duration=2, rng=rng)
    assert not campaign.stop
    assert campaign.cases == ()
    assert campaign.recordings[0].samples.size == 100


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"spring_qubic": {"stiffness": 1.0}}, "spring_qubic"),
        ({"spring_cubic": {"stifness": 1.0}}, "stiffness"),
        ({"spring_cubic": {}}, "no parameters"),
        ({"spring_cubic": {"stiffness": float("nan")}}, "finite"),
        ({"gap_per_recording": {"g": {"other": 1e-3}}}, "a value for r"),
        ({"spring_cubic": {"stiffness": {"r": 1.0}}}, "spring_cubic.stiffness"),
    ],
)
def test_what_cannot_be_planted_is_refused(effects, message):
    with pytest.raises(InputError, match=message):
        motion(PAPER_RIG, Release("r", "1", -5e-3), effects, rate=100, duration=0.1)


def test_bad_rigs_and_releases_are_refused():
    with pytest.raises(InputError, match="mass"):
        Rig(mass=0.0, c1=0.1, k1=800.0)
    with pytest.raises(InputError, match="gap"):
        Rig(mass=0.5, c1=0.1, k1=800.0, k2={"1": 5000.0})
    with pytest.raises(InputError, match="1, 2, 3"):
        motion(PAPER_RIG, Release("r", "4", -5e-3), rate=100, duration=0.1)
    with pytest.raises(InputError, match="without an obstacle"):
        effects = {"contact_hardening": {"stiffness": 1.0}}
        motion(PLAIN, Release("r", "", -5e-3), effects, rate=100, duration=0.1)
