"""The noise of a measured input: how large, how it whitens, and what parameters are without it."""

from __future__ import annotations

import pickle
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from driven_rigs import DrivenRig, driven_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.measurement import input_noise as module
from bayesimpact.diagnosis.measurement.input_noise import (
    input_noise,
    under_input_noise,
    with_input_noise,
)
from bayesimpact.diagnosis.measurement.whiteness import whiteness_p
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.revision import revised
from bayesimpact.diagnosis.thresholds import LARGE
from bayesimpact.formula.responses import motion_of
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.noise.forces import RandomForces
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.linear_response.superposition import StateSpace, answers, state_space
from bayesimpact.report.diagnosis.words import noise_words

ERROR = 0.02  # of the input's rms
SEEDS = range(4)


def with_noisy_input(rig: DrivenRig, seed: int, error: float = ERROR) -> Campaign:
    (recording,) = rig.campaign.recordings
    given = recording.input
    assert given is not None
    size = error * float(np.sqrt(np.mean(given.samples**2)))
    noisy = given.samples + size * np.random.default_rng(seed).standard_normal(given.samples.size)
    noisy_input = Input(noisy, given.kind, given.free)
    return replace(rig.campaign, recordings=(replace(recording, input=noisy_input),))


def identified(campaign: Campaign) -> Identification:
    return identify(campaign, rng=np.random.default_rng(0), search=False)


def deviations(fit: Fit, rig: DrivenRig) -> list[float]:
    """Of the stiffness and the damping, in standard deviations."""
    names = ("k1", "c1")
    return [(fit.value(n) - rig.truth[n]) / fit.sd[fit.names.index(n)] for n in names]


def test_the_noise_of_a_sweep_is_told_and_widens_the_intervals() -> None:
    """Without it the truth lies far outside; with it within, over eight values of four rigs."""
    plain, wide = [], []
    for seed in SEEDS:
        rig = driven_rig(8 * seed + 4, "displacement", kind="sweep")  # without a stop
        before = identified(with_noisy_input(rig, seed))
        after = with_input_noise(before)
        assert after.noise.forces is not None
        assert after.noise.forces.share == pytest.approx(ERROR, rel=0.25)
        plain += deviations(before.fit, rig)
        wide += deviations(after.fit, rig)
    assert np.mean(np.square(plain)) > 10.0
    assert np.mean(np.square(wide)) < 1.0 + 3 * np.sqrt(2 / len(wide))


def test_a_clean_input_has_none() -> None:
    rig = driven_rig(4, "displacement", kind="sweep")
    assert input_noise(identified(rig.campaign).fit) is None


def hardening(y: float, v: float, touching: bool) -> float:
    return 3e6 * y**3


def stiff(y: float, v: float, touching: bool) -> float:
    return 3e7 * y**3


def test_a_missing_law_is_no_noise_of_a_clean_input() -> None:
    """What a law leaves asks for a large random force; the input's own floor holds none."""
    rig = driven_rig(4, "displacement", hardening, kind="sweep")
    found = identified(rig.campaign)
    assert found.fit.reduced_chi2 > 1.05
    assert input_noise(found.fit) is None


def test_an_input_that_fills_the_band_tells_nothing() -> None:
    rig = driven_rig(6, "displacement", kind="noise")
    (recording,) = rig.campaign.recordings
    white = Input(np.random.default_rng(0).standard_normal(recording.samples.size))
    campaign = replace(rig.campaign, recordings=(replace(recording, input=white),))
    fit = identified(campaign).fit
    assert input_noise(fit) is None


def path(n: int, seed: int = 2) -> StateSpace:
    """Of a motion whose free changes are renewed twice."""
    rng = np.random.default_rng(seed)
    transitions = np.tile(np.eye(2), (n, 1, 1))
    transitions[[n // 3, n // 2]] = rng.standard_normal((2, 2, 2))
    return StateSpace(rng.standard_normal((n, 2)), rng.standard_normal((n, 2)), transitions)


def moved_by(space: StateSpace, size: float) -> np.ndarray:
    """What a force of one standard deviation before every sample moves, (n, n), step by step."""
    n = space.readings.shape[0]
    moved = np.zeros((n, n))
    for k in range(1, n):
        state = np.zeros(2)
        for i in range(1, n):
            state = space.transitions[i] @ (state + (size * space.increments[i] if i == k else 0.0))
            moved[i, k] = space.readings[i] @ state
    return moved


def forces_along(space: StateSpace, size: float = 0.7) -> RandomForces:
    return RandomForces({"a": space}, {"a": size}, 0.1)


PARTS = [((0.0, 1.0),), ((0.6, 1.0),), ((0.0, 0.7), (0.9, 0.3))]


@pytest.mark.parametrize("parts", PARTS)
@pytest.mark.parametrize("used", [None, np.arange(30) % 7 != 3])
def test_whitening_is_that_of_the_covariance(used: np.ndarray | None, parts: Any) -> None:
    """Against the inverse and the determinant of the whole matrix."""
    n, space = 30, path(30)
    kept = np.ones(n, bool) if used is None else used
    moved, apart = moved_by(space, 0.7), np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    own = sum(share * rho**apart for rho, share in parts)
    covariance = (moved @ moved.T + own)[np.ix_(kept, kept)]
    x, y = np.random.default_rng(3).standard_normal((2, n))
    forces = forces_along(space)
    a, b = (forces.innovations("a", s, parts, used) for s in (x, y))
    assert a @ b == pytest.approx(x[kept] @ np.linalg.solve(covariance, y[kept]), rel=1e-9)
    volume = forces.log_determinant("a", n, parts, used)
    assert volume == pytest.approx(-0.5 * np.linalg.slogdet(covariance)[1], rel=1e-9)
    head = forces.innovations("a", x[:9], parts, None)  # of a recording cut short
    if used is None:
        np.testing.assert_array_equal(head, a[:9])


def test_draws_have_the_covariance() -> None:
    space = path(6)
    forces, rng = forces_along(space), np.random.default_rng(3)
    drawn = np.array([forces.drawn(rng, "a", 6) for _ in range(20_000)])
    moved = moved_by(space, 0.7)
    expected = moved @ moved.T
    sd = np.sqrt(np.diag(expected))
    error = np.sqrt((np.outer(sd, sd) ** 2 + expected**2) / 20_000)
    assert np.all(np.abs(np.cov(drawn.T) - expected) < 5 * error + 1e-9)
    assert not forces.drawn(rng, "b", 6).any()


def test_forces_along_a_motion_are_those_of_the_superposition() -> None:
    """A force that hardly changes from sample to sample; 0.5 % of its answer."""
    fit = identified(driven_rig(0, "displacement", kind="sweep").campaign).fit  # with a stop
    motion = motion_of(fit, 0)
    force = np.sin(9.0 * motion.t) + np.cos(31.0 * motion.t)
    space, at = state_space(motion), force[:: motion.factor]
    between = np.append(0.0, 0.5 * (at[1:] + at[:-1]))
    state, moved = np.zeros(2), np.zeros(at.size)
    for i in range(1, at.size):
        state = space.transitions[i] @ (state + space.increments[i] * between[i])
        moved[i] = space.readings[i] @ state
    exact = answers(motion, force[None])[0]
    assert np.std(moved - exact) < 0.005 * np.std(exact)


def test_noise_passes_forces_on() -> None:
    """Independent values of unit variance, once drawn readings are whitened; not without."""
    (recording,) = driven_rig(4, "displacement", kind="sweep").campaign.recordings
    n = recording.samples.size
    space = StateSpace(np.ones((n, 2)), np.full((n, 2), 0.2), np.tile(np.eye(2), (n, 1, 1)))
    plain = Noise(0.6, level=1.0)
    noise, rng = replace(plain, forces=forces_along(space)), np.random.default_rng(5)
    assert not noise.is_white and "measured input (10 % of it)" in noise.kind
    drawn = [noise.drawn(rng, recording, 1.0) for _ in range(9)]
    white, bare = (np.array([n.whitened(recording, x) for x in drawn]) for n in (noise, plain))
    assert np.var(white) == pytest.approx(1.0, abs=5 * np.sqrt(2 / white.size))
    assert np.var(bare) > 2.0
    volume = noise.forces.log_determinant("a", n, noise.parts, None) if noise.forces else 0.0
    assert noise.volume_of(recording) == volume


def test_beside_what_is_missing_it_is_told_by_the_model_that_holds_that() -> None:
    """The search begins once more under it, and names nothing else."""
    rig = driven_rig(4, "displacement", stiff, kind="sweep")
    campaign = with_noisy_input(rig, 1)
    effects = [BY_ID[i] for i in ("spring_cubic", "quadratic_drag", "stiffness_drift")]
    said: list[str] = []
    found = diagnose(
        campaign,
        rng=np.random.default_rng(0),
        effects=effects,
        search=False,
        progress=lambda words: said.append(str(words)),
    )
    assert found.before.reduced_chi2 > LARGE**2
    assert any("noise of the input matters" in words for words in said)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["spring_cubic"]
    forces = found.after.density.likelihood.noise.forces
    assert forces is not None and forces.share == pytest.approx(ERROR, rel=0.25)
    assert np.max(np.abs(deviations(found.after, rig))) < 4.0


def test_a_large_misfit_that_is_the_inputs_noise_alone_is_told_before_any_search() -> None:
    """Half of the input's bands are its floor, and no law is as likely."""
    rig = driven_rig(4, "displacement", kind="sweep")
    effects = [BY_ID[i] for i in ("spring_cubic", "quadratic_drag", "stiffness_drift")]
    campaign, said = with_noisy_input(rig, 1, error=0.15), list[str]()
    found = diagnose(
        campaign, rng=np.random.default_rng(0), effects=effects, search=False,
        progress=lambda words: said.append(str(words)),
    )  # fmt: skip
    assert identified(campaign).fit.reduced_chi2 > LARGE**2
    assert found.verdict == "adequate"
    assert not any(words.startswith("fitting spring_cubic") for words in said)
    assert np.max(np.abs(deviations(found.after, rig))) < 4.0


def test_beside_a_large_misfit_an_input_without_a_floor_tells_no_noise() -> None:
    """One that falls with frequency: its quietest bands would take what a missing law leaves."""
    rig = driven_rig(6, "displacement", stiff, kind="noise")
    (recording,) = rig.campaign.recordings
    assert recording.input is not None
    fit = identified(rig.campaign).fit
    assert fit.reduced_chi2 > LARGE**2
    assert input_noise(fit) is None and under_input_noise(fit) is None
    assert module._floor(recording, module.MANY) == 0.0 < module._floor(recording)


def with_slow_noise_of_its_own(rig: DrivenRig, campaign: Campaign, seed: int) -> Campaign:
    """Readings with as much AR(1) noise of correlation 0.8 as they have white noise."""
    (recording,) = campaign.recordings
    slow = Noise(0.8).coloured(np.random.default_rng(seed), 1500, recording.interval, rig.noise)
    return replace(campaign, recordings=(replace(recording, samples=recording.samples + slow),))


def test_slow_noise_of_the_readings_is_told_beside_that_of_the_input() -> None:
    """Both at once, of a model that the base fit misses by far: either alone leaves the other."""
    rig = driven_rig(4, "displacement", stiff, kind="sweep")
    campaign = with_slow_noise_of_its_own(rig, with_noisy_input(rig, 1), 7)
    base = identified(campaign).fit
    model = fit_from(base, [BY_ID["spring_cubic"]], {}, campaign_scales(base)).fit
    state: Any = SimpleNamespace(candidate=SimpleNamespace(fit=model), is_white=False)
    said: list[str] = []
    anew = revised(base, state, said.append)
    assert anew is not None and anew.first is not None and len(said) == 2
    noise = anew.first.density.likelihood.noise
    assert noise.forces is not None and noise.others
    assert noise.forces.share == pytest.approx(ERROR, rel=0.3)
    alone = input_noise(model)
    assert alone is not None and alone.forces is not None  # as large, N, over another level
    sizes = [n.forces.sizes["a"] * n.level for n in (noise, alone) if n.forces is not None]
    assert sizes[0] == pytest.approx(sizes[1], rel=0.01)
    assert noise.level > 1.05 * alone.level
    assert noise == anew.base.density.likelihood.noise
    assert anew.first.reduced_chi2 == pytest.approx(1.0, abs=0.05)
    assert whiteness_p(model) < 1e-6 < 0.01 < whiteness_p(anew.first)


def test_noise_with_forces_pickles() -> None:
    (recording,) = driven_rig(4, "displacement", kind="sweep").campaign.recordings
    n = recording.samples.size
    noise = Noise(level=1.0, forces=forces_along(path(n)))
    x = np.random.default_rng(1).standard_normal(n)
    white = noise.whitened(recording, x)
    again = pickle.loads(pickle.dumps(noise))
    np.testing.assert_array_equal(again.whitened(recording, x), white)
    assert repr(again) == repr(noise)


def test_the_noise_of_an_input_is_told() -> None:
    noise = Noise(level=1.0, forces=RandomForces({}, {}, 0.0123))
    assert "noise of the measured input (1.2 % of it)" in noise_words(noise)
    assert noise_words(Noise(level=1.0)) == ""
