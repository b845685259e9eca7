"""What models predict of a recording: against the simulator, a refit and recordings made so."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from rivals import base_rivalry, fitted, rivalry_of
from scipy.optimize import least_squares

from bayesimpact.design.candidates import PlannedRecording, first_designs
from bayesimpact.design.hypotheses import Rivalry
from bayesimpact.design.odds import expected_odds
from bayesimpact.design.response import Response, noise_at, odds_between, response
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.exact.simulate import simulate


@pytest.fixture(scope="module")
def damped(small: Identification) -> Rivalry:
    """Two laws, either as large as would stand out by fifteen standard deviations."""
    made = rivalry_of(fitted(small, "coulomb_friction", "quadratic_drag"))
    large = [
        replace(h, mode=h.mode + 15 * h.sd * np.array(["." in n for n in h.names]))
        for h in made.hypotheses
    ]
    return replace(made, hypotheses=tuple(large))


def release(rivals: Rivalry) -> PlannedRecording:
    (found,) = [d for d in first_designs(rivals) if d.case == "1" and d.kind == "release"][3:4]
    return found


def test_the_base_model_predicts_what_the_simulator_does(small: Identification) -> None:
    rivals = base_rivalry(small)
    design, value = release(rivals), small.fit.value
    found = response(rivals.hypotheses[0], design, rivals)
    made = simulate(
        mass=rivals.mass, c1=value("c1"), k1=value("k1"), c2=value("c2"), g=value("g"),
        k2=value("k2[1]"), y0=design.y0, v0=0.0, interval=design.interval, n=design.samples,
    )  # fmt: skip
    assert found.predicted(found.mean) * found.sigma == pytest.approx(made.displacement, abs=1e-12)
    removed = response(rivals.hypotheses[0], replace(design, stop=False), rivals)
    free = simulate(
        mass=rivals.mass, c1=value("c1"), k1=value("k1"), y0=design.y0, v0=0.0,
        interval=design.interval, n=design.samples,
    )  # fmt: skip
    assert removed.predicted(removed.mean) * removed.sigma == pytest.approx(
        free.displacement, abs=1e-12
    )


def test_without_the_stop_nothing_of_a_contact_acts(small: Identification) -> None:
    """Not even an effect that acts at some indentation."""
    rivals = rivalry_of(fitted(small, "contact_damping_indentation"))
    model = rivals.hypotheses[0]
    strong = replace(model, mode=np.where(np.char.find(model.names, ".") >= 0, 1e3, model.mode))
    design = replace(release(rivals), stop=False)
    made = response(strong, design, rivals)
    weak = response(replace(model, effects=(), names=model.names), design, rivals)
    assert made.predicted(made.mean) == pytest.approx(weak.predicted(weak.mean), abs=1e-3)


def test_a_stop_that_is_moved_is_a_parameter_of_the_recording(small: Identification) -> None:
    rivals = base_rivalry(small)
    moved = response(rivals.hypotheses[0], replace(release(rivals), gap_shift=1e-3), rivals)
    names = moved.likelihood.oscillator.layout.names
    assert "g" in [names[i] for i in moved.own]
    assert moved.mean[names.index("g")] == pytest.approx(small.fit.value("g") + 1e-3)


def test_the_criterion_holds_where_the_problem_is_not_linear(small: Identification) -> None:
    """A rival with its stop far off: its parameters must move by many standard deviations."""
    rivals = base_rivalry(small)
    first = rivals.hypotheses[0]
    at = first.known["g"]
    wide = first.covariance.copy()
    wide[at, :] = wide[:, at] = 0.0
    wide[at, at] = 1e-4**2
    off = replace(first, mode=first.mode + 1.5e-4 * (np.arange(first.mode.size) == at))
    design = replace(release(rivals), duration=0.5)
    one = response(first, design, rivals)
    two = response(replace(off, covariance=wide), design, rivals)
    draws = np.zeros((1, one.shared.size))
    found = odds_between(one, two, draws)
    linear = expected_odds(one.prediction, two.prediction, draws)
    left = imitated(one, two)
    assert left < 0.5 * linear_criterion(one, two)
    assert 2 * (found.mean - linear.mean) + linear_criterion(one, two) == pytest.approx(left, abs=3)


def linear_criterion(right: Response, other: Response) -> float:
    """T of the linear problem."""
    difference = right.prediction.mean - other.prediction.mean
    return float(difference @ other.prediction.weighed(difference))


def imitated(right: Response, other: Response) -> float:
    """The sum of squares that is left when SciPy refits the other model to the right one."""
    values, vectors = np.linalg.eigh(other.prior / np.outer(*2 * (np.sqrt(np.diag(other.prior)),)))
    scale = np.sqrt(np.diag(other.prior))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))

    def misfit(u: np.ndarray) -> np.ndarray:
        theta = other.mean.copy()
        theta[other.moving] += root @ u
        return np.concatenate([right.prediction.mean - other.predicted(theta), u])

    start = np.zeros(other.prior.shape[0])
    return float(2 * least_squares(misfit, start, x_scale="jac", xtol=1e-12).cost)


def test_the_criterion_is_what_a_refit_leaves(damped: Rivalry) -> None:
    """With T known, the rest of the expected odds follows in closed form."""
    one, two = (response(h, release(damped), damped) for h in damped.hypotheses)
    draws = np.zeros((1, one.shared.size))
    found = odds_between(one, two, draws)
    linear = expected_odds(one.prediction, two.prediction, draws)
    rest = linear.mean - 0.5 * linear_criterion(one, two)
    assert linear_criterion(one, two) > 10
    assert 2 * (found.mean - rest) == pytest.approx(imitated(one, two), rel=0.02, abs=0.02)


def test_a_rival_imitates_within_its_bounds(damped: Rivalry) -> None:
    """Friction does not become negative to look like another model."""
    friction = damped.hypotheses[0]
    made = response(friction, release(damped), damped)
    names = made.likelihood.oscillator.layout.names
    at = names.index("coulomb_friction.force")
    shift = np.where(made.moving == at, -1e3 * made.mean[at], 0.0)
    assert made.mean[at] > 0.0 and made.admissible(shift)[at] == 0.0
    shift = 0.1 * np.sqrt(np.diag(made.prior))
    assert made.admissible(shift)[made.moving] == pytest.approx(made.mean[made.moving] + shift)


def test_noise_keeps_its_correlation_in_time(small: Identification) -> None:
    rivals = replace(base_rivalry(small), noise=Noise(correlation=0.5))
    interval = rivals.releases[0].interval
    assert noise_at(interval / 2, rivals).correlation == pytest.approx(sqrt(0.5))
    assert noise_at(interval, rivals).correlation == pytest.approx(0.5)
    slow = replace(rivals, noise=Noise(correlation=0.5, others=((0.0, 0.3), (0.81, 0.2))))
    assert noise_at(interval / 2, slow).parts == ((sqrt(0.5), 0.5), (0.0, 0.3), (0.9, 0.2))
