"""The likelihood against dense Gaussians; its linearisation against extrapolated differences."""

from __future__ import annotations

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID
from scipy import stats
from scipy.linalg import toeplitz

from bayesimpact.data.campaign import Smoothing
from bayesimpact.inference import likelihood as module
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import Oscillator, build_oscillator

SAVGOL = Smoothing("savgol", window=11, polyorder=2)
NOISES = {
    "white": Noise(),
    "ar1": Noise(correlation=0.7),
    "smoothed": Noise(smoothing=SAVGOL),
    "both": Noise(correlation=0.4, smoothing=SAVGOL),
}
ADDED = {
    "coulomb_friction.force": 3e-3,
    "quadratic_drag.coefficient": 0.02,
    "contact_power_law.exponent": 1.03,
    "contact_relaxation.stiffness": 80.0,
    "contact_relaxation.time": 0.01,
    "obstacle_mass.mass": 2e-3,
    "gap_wear.step": 2e-6,
    "sensor_cubic.gain": 30.0,
    "sensor_drift.rate": 2e-5,
    "sensor_hum.amplitude": 2e-5,
    "sensor_hum.frequency": 17.0,
}


def campaign(duration: float = 0.3):
    return small_rig.record(duration=duration)


def build(noise: Noise, effects=(), *, duration=0.3, sigma_per_recording=False) -> Likelihood:
    oscillator = build_oscillator(
        campaign(duration),
        [BY_ID[e] for e in effects],
        smoothing=noise.smoothing,
        sigma_per_recording=sigma_per_recording,
    )
    return Likelihood(oscillator, noise)


def start(likelihood: Likelihood) -> np.ndarray:
    """The true parameters; added ones at small but noticeable sizes."""
    layout, values = likelihood.oscillator.layout, small_rig.true_values() | ADDED
    for i, name in enumerate(layout.names):
        if name.startswith("sigma["):
            values[name] = 4e-6 * (1 + 0.2 * i)
        if ".c2[" in name:
            values[name] = small_rig.RIG.c2 * (1 + 0.01 * i)
        if ".g[" in name:
            values[name] = small_rig.RIG.g * (1 + 0.001 * i)
        if "phase[" in name:
            values[name] = 0.2 + i
    return small_rig.vector(layout, values)


@pytest.mark.parametrize("per_recording", [False, True])
@pytest.mark.parametrize("noise", ["white", "ar1"])
def test_density_is_the_dense_gaussian(noise, per_recording):
    likelihood = build(NOISES[noise], sigma_per_recording=per_recording)
    theta = start(likelihood)
    found = likelihood.per_recording(theta)[0]
    rows = zip(
        likelihood.oscillator.campaign.recordings,
        likelihood.oscillator.predict(theta),
        strict=True,
    )
    for r, (recording, mean) in enumerate(rows):
        name = f"sigma[{recording.name}]" if per_recording else "sigma"
        sigma = theta[likelihood.oscillator.layout.index(name)]
        covariance = sigma**2 * toeplitz(NOISES[noise].correlation ** np.arange(mean.size))
        expected = stats.multivariate_normal(mean, covariance).logpdf(recording.samples)
        assert found[r] == pytest.approx(expected, rel=1e-10)
    assert likelihood(theta)[0] == pytest.approx(found.sum())


@pytest.mark.parametrize("noise", ["smoothed", "both"])
def test_density_of_smoothed_recordings_is_that_of_the_whitened_numbers(noise):
    likelihood = build(NOISES[noise])
    theta = start(likelihood)
    sigma = theta[likelihood.oscillator.layout.index("sigma")]
    residuals = [
        recording.samples - mean
        for recording, mean in zip(
            likelihood.oscillator.campaign.recordings,
            likelihood.oscillator.predict(theta),
            strict=True,
        )
    ]
    white = [NOISES[noise].whiten(x, 1e-3) for x in residuals]
    assert [w.size for w in white] == list(likelihood.sizes)
    expected = [stats.norm(0, sigma).logpdf(w).sum() for w in white]
    np.testing.assert_allclose(likelihood.per_recording(theta)[0], expected, rtol=1e-12)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("effects", [(), ("quadratic_drag",)])
def test_a_batch_is_its_rows_and_memory_is_cut_in_chunks(noise, effects, monkeypatch):
    likelihood = build(NOISES[noise], effects)
    rng = np.random.default_rng(0)
    theta = start(likelihood) * (1 + 1e-4 * rng.standard_normal((5, start(likelihood).size)))
    whole = likelihood.per_recording(theta)
    assert whole.shape == (5, 3)
    rows = np.concatenate([likelihood.per_recording(row) for row in theta])
    np.testing.assert_allclose(whole, rows, rtol=1e-9)
    monkeypatch.setattr(module, "_CHUNK_SAMPLES", 2 * 300)
    np.testing.assert_allclose(likelihood.per_recording(theta), whole, rtol=1e-9)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("effects", [(), ("quadratic_drag",)])
def test_what_is_inadmissible_has_no_density(noise, effects):
    likelihood = build(NOISES[noise], effects)
    layout = likelihood.oscillator.layout
    theta = np.repeat(start(likelihood)[None], 5, axis=0)
    theta[0, layout.index("k2[2]")] = -1.0  # the obstacle of the last recording only
    theta[1, layout.index("sigma")] = 0.0
    theta[2, layout.index("sigma")] = -1e-6
    theta[3, layout.index("k1")] = np.nan
    value = likelihood.per_recording(theta)
    assert np.isfinite(value[0, :2]).all() and value[0, 2] == -np.inf
    assert np.all(value[1:4] == -np.inf)
    assert np.isfinite(value[4]).all()
    assert list(np.isfinite(likelihood(theta))) == [False] * 4 + [True]
    sums = likelihood.misfit(theta)
    assert sums[0, 2] == np.inf and np.all(sums[3] == np.inf) and np.isfinite(sums[4]).all()


def extrapolated(likelihood: Likelihood, theta: np.ndarray, i: int, step: float):
    """Derivative of the whitened predictions by parameter i, error O(step^4), and its own error."""

    def central(h: float) -> list[np.ndarray]:
        sides = []
        for sign in (1, -1):
            moved = theta.copy()
            moved[i] += sign * h
            sides.append(likelihood.oscillator.predict(moved))
        noise = likelihood.noise
        return [noise.whiten((b - a) / (2 * h), 1e-3) for b, a in zip(*sides, strict=True)]

    coarse, fine = central(step), central(step / 2)
    return [(4 * f - c) / 3 for c, f in zip(coarse, fine, strict=True)]


def check_jacobian(
    likelihood: Likelihood, steps: np.ndarray | None, tolerance: float, *, roughly: bool = False
) -> None:
    theta = start(likelihood)
    parts = likelihood.linearise(theta, steps, roughly=roughly)
    rows = zip(
        likelihood.oscillator.campaign.recordings,
        likelihood.oscillator.predict(theta),
        strict=True,
    )
    for part, (recording, mean) in zip(parts, rows, strict=True):
        expected = likelihood.noise.whiten(recording.samples - mean, recording.interval)
        np.testing.assert_allclose(part.residual, expected, atol=1e-12)
    scale = {"y0": 1e-3, "v0": 1e-1, "of": 1e-3}
    for i, parameter in enumerate(likelihood.oscillator.layout.parameters):
        step = 3e-4 * max(abs(theta[i]), scale.get(parameter.name[:2], 0.0))
        expected = extrapolated(likelihood, theta, i, step)
        for r, part in enumerate(parts):
            column = np.flatnonzero(part.columns == i)
            if column.size == 0:
                assert not expected[r].any()
                continue
            error = np.linalg.norm(part.jacobian[:, column[0]] - expected[r])
            assert error <= tolerance * np.linalg.norm(expected[r]), parameter.name


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("effects", [(), ("contact_damping_per_case", "gap_per_recording")])
def test_exact_derivatives(noise, effects):
    check_jacobian(build(NOISES[noise], effects), None, 2e-6)


@pytest.mark.parametrize(
    ("noise", "effects"),
    [
        ("white", ("sensor_cubic", "sensor_drift", "sensor_hum")),
        ("both", ("sensor_cubic", "contact_damping_per_case")),
        ("ar1", ("quadratic_drag", "contact_power_law")),
        ("smoothed", ("contact_relaxation", "gap_per_recording")),
        ("white", ("coulomb_friction", "obstacle_mass", "gap_wear")),
    ],
)
def test_derivatives_by_differences(noise, effects):
    likelihood = build(NOISES[noise], effects, duration=0.2)
    theta = start(likelihood)
    floor = [1e-2 if n.startswith("v0") else 1e-4 for n in likelihood.oscillator.layout.names]
    steps = 1e-5 * np.maximum(np.abs(theta), floor)
    check_jacobian(likelihood, steps, 3e-5)


def test_rough_derivatives_are_of_first_order_and_half_as_dear(monkeypatch):
    likelihood = build(Noise(), ("quadratic_drag", "contact_power_law"), duration=0.2)
    theta, tried = start(likelihood), []
    floor = [1e-2 if n.startswith("v0") else 1e-4 for n in likelihood.oscillator.layout.names]
    steps = 1e-5 * np.maximum(np.abs(theta), floor)
    check_jacobian(likelihood, steps, 3e-3, roughly=True)
    predict = Oscillator.predict_recording
    monkeypatch.setattr(
        Oscillator, "predict_recording", lambda o, r, x: (tried.append(len(x)), predict(o, r, x))[1]
    )
    likelihood.linearise(theta, steps, [0], roughly=True)
    likelihood.linearise(theta, steps, [0])
    assert tried[0] - 1 == (tried[1] - 1) / 2


def test_differences_at_a_bound_look_inward():
    """Drag at zero, friction a step away from it: values beyond the bound are never tried."""
    likelihood = build(Noise(), ("quadratic_drag", "coulomb_friction"), duration=0.2)
    layout, theta = likelihood.oscillator.layout, start(likelihood)
    drag = layout.index("quadratic_drag.coefficient")
    theta[drag], steps = 0.0, 1e-5 * np.maximum(np.abs(theta), 1e-4)
    steps[drag] = 1e-4
    part = likelihood.linearise(theta, steps)[0]
    inside = theta.copy()
    inside[drag] = 1e-4
    centred = extrapolated(likelihood, inside, drag, 1e-4)[0]  # at 1e-4, all points inside
    found = part.jacobian[:, list(part.columns).index(drag)]
    assert np.linalg.norm(found - centred) < 1e-2 * np.linalg.norm(centred)
    inside[drag] = 1e-5  # towards the bound the difference shrinks: it is the curvature's
    steps[drag] = 1e-5
    nearer = likelihood.linearise(theta, steps)[0].jacobian[:, list(part.columns).index(drag)]
    centred = extrapolated(likelihood, inside, drag, 1e-5)[0]
    assert np.linalg.norm(nearer - centred) < 1e-3 * np.linalg.norm(centred)


def test_added_effects_need_steps():
    likelihood = build(Noise(), ("quadratic_drag",))
    with pytest.raises(ValueError, match="difference steps"):
        likelihood.linearise(start(likelihood))


@pytest.mark.parametrize("noise", NOISES)
def test_linearisation_where_nothing_can_be_simulated_is_not_finite(noise):
    likelihood = build(NOISES[noise])
    theta = start(likelihood)
    theta[likelihood.oscillator.layout.index("k2[2]")] = -1.0
    parts = likelihood.linearise(theta)
    assert np.isfinite(parts[0].residual).all() and np.isfinite(parts[0].jacobian).all()
    assert np.isnan(parts[2].residual).all()
