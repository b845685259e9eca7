"""Parameters moving between models of one campaign by name; sizes of a campaign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.refits.extend import (
    base_value,
    campaign_scales,
    difference_steps,
    extend,
    owner,
    replaced_slot,
    transfer,
)
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.prior import HalfCauchy, Normal, Uniform


def effects(*ids: str):
    return tuple(BY_ID[i] for i in ids)


def pretend(small, ids: tuple[str, ...], values: dict[str, float]) -> Fit:
    """A fit of the model with these effects, its values set by hand."""
    scales = campaign_scales(small.fit)
    density = extend(small.fit, effects(*ids), scales)
    mode = transfer(small.fit, density.oscillator.layout, effects(*ids), scales, {})
    for name, value in values.items():
        mode[density.oscillator.layout.index(name)] = value
    covariance = np.diag(np.full(mode.size, 1e-8))
    return replace(small.fit, density=density, mode=mode, covariance=covariance)


def test_sizes_of_the_campaign(small):
    scales, rig = campaign_scales(small.fit), small_rig.RIG
    truth = small.fit.density.oscillator.predict(small.fit.mode)
    depth = max(float(m.max()) for m in truth) - rig.g
    assert scales.mass == rig.mass and scales.interval == 1e-3
    assert scales.stiffness == pytest.approx(rig.k1, rel=1e-3)
    assert scales.damping == pytest.approx(rig.c1, rel=0.02)
    mean_k2 = (2 * rig.k2["1"] + rig.k2["2"]) / 3
    assert scales.contact_stiffness == pytest.approx(mean_k2, rel=1e-3)
    assert scales.amplitude == pytest.approx(6.5e-3, rel=0.01)
    assert scales.speed == pytest.approx(6.5e-3 * np.sqrt(rig.k1 / rig.mass), rel=0.01)
    assert scales.indentation == pytest.approx(depth, abs=5e-5)
    assert scales.gap == pytest.approx(rig.g, rel=0.01)
    assert (scales.cases, scales.recordings) == (2, 3)
    crossings = [np.sum((m[:-1] < rig.g) & (m[1:] >= rig.g)) for m in truth]
    assert abs(scales.impacts - max(crossings)) <= 1
    assert scales.duration == pytest.approx(1.999)


def test_shared_parameters_keep_their_values_and_priors(small):
    scales = campaign_scales(small.fit)
    chosen = effects("coulomb_friction", "contact_relaxation")
    density = extend(small.fit, chosen, scales)
    layout = density.oscillator.layout
    shapes = {"contact_relaxation.time": 0.02}
    theta = transfer(small.fit, layout, chosen, scales, shapes)
    values = dict(zip(layout.names, theta, strict=True))
    for name, value in zip(small.fit.names, small.fit.mode, strict=True):
        assert values.pop(name) == value
        old = small.fit.density.priors.parameters[small.fit.names.index(name)]
        assert density.priors.parameters[layout.index(name)] is old
    assert values == {
        "coulomb_friction.force": 0.0,
        "contact_relaxation.stiffness": 0.0,
        "contact_relaxation.time": 0.02,
    }
    friction = density.priors.parameters[layout.index("coulomb_friction.force")]
    assert friction == HalfCauchy(BY_ID["coulomb_friction"].parameters[0].scale(scales))
    time = BY_ID["contact_relaxation"].parameter("time").scale(scales)
    without = transfer(small.fit, layout, chosen, scales, {})
    assert without[layout.index("contact_relaxation.time")] == time
    assert density.likelihood.noise is small.fit.density.likelihood.noise


def test_a_split_parameter_starts_at_the_shared_value(small):
    scales = campaign_scales(small.fit)
    chosen = effects("contact_damping_per_case", "gap_per_recording")
    density = extend(small.fit, chosen, scales)
    layout = density.oscillator.layout
    theta = transfer(small.fit, layout, chosen, scales, {})
    for name, value, prior in zip(layout.names, theta, density.priors.parameters, strict=True):
        if "." in name:
            shared = small.fit.value("c2" if ".c2[" in name else "g")
            assert value == pytest.approx(shared)
            assert isinstance(prior, Normal) and prior.mean == pytest.approx(shared)


def test_a_shared_parameter_comes_back_as_the_mean_of_what_had_replaced_it(small):
    """Also beside parameters whose names merely begin alike (g and gain)."""
    gaps = {f"gap_per_recording.g[{n}]": 1e-3 * (1 + 0.1 * i) for i, n in enumerate("abc")}
    fit = pretend(small, ("gap_per_recording", "sensor_quadratic"), gaps | {
        "sensor_quadratic.gain": 7.0})  # fmt: skip
    scales = campaign_scales(small.fit)
    chosen = effects("sensor_quadratic")
    density = extend(fit, chosen, scales)
    layout = density.oscillator.layout
    theta = transfer(fit, layout, chosen, scales, {})
    assert theta[layout.index("g")] == pytest.approx(1.1e-3) == base_value(fit, "g")
    assert theta[layout.index("sensor_quadratic.gain")] == 7.0
    before = small.fit.density.priors.parameters[small.fit.names.index("g")]
    assert density.priors.parameters[layout.index("g")] == before


def test_names_with_dots_are_no_effects():
    """Recordings `run 1.5.csv`, obstacles of `2.5 mm`: still y0 and k2."""
    from bayesimpact.inference.identify import identify

    campaign = small_rig.record(3, duration=1.0)
    renamed = tuple(
        replace(r, name=f"run 1.5 {r.name}", case=f"{r.case}.5 mm") for r in campaign.recordings
    )
    fit = identify(
        replace(campaign, recordings=renamed), rng=np.random.default_rng(0), search=False
    ).fit
    scales = campaign_scales(fit)
    chosen = effects("contact_damping_per_case", "coulomb_friction")
    density = extend(fit, chosen, scales)
    layout = density.oscillator.layout
    theta = transfer(fit, layout, chosen, scales, {})
    assert theta[layout.index("k2[1.5 mm]")] == fit.value("k2[1.5 mm]")
    assert theta[layout.index("y0[run 1.5 a]")] == fit.value("y0[run 1.5 a]")
    assert theta[layout.index("contact_damping_per_case.c2[2.5 mm]")] == pytest.approx(
        fit.value("c2")
    )
    assert isinstance(density.priors.parameters[layout.index("v0[run 1.5 b]")], Uniform)


def test_owners_and_slots():
    chosen = effects("contact_damping_per_case", "coulomb_friction", "spring_cubic")
    effect, parameter = owner(chosen, "contact_damping_per_case.c2[1.5 mm]")
    assert (effect.id, parameter.name) == ("contact_damping_per_case", "c2")
    assert replaced_slot(effect, parameter) == "c2"
    assert replaced_slot(*owner(chosen, "coulomb_friction.force")) is None
    with pytest.raises(KeyError):
        owner(chosen, "quadratic_drag.coefficient")


def test_steps_are_a_fraction_of_the_deviations(small):
    density = extend(small.fit, effects("coulomb_friction"), campaign_scales(small.fit))
    steps = difference_steps(small.fit, density, {"coulomb_friction.force": 2e-5})
    names = density.oscillator.layout.names
    for name, step in zip(names, steps, strict=True):
        if "." in name:
            assert step == pytest.approx(1e-6)
        else:
            assert step == pytest.approx(0.05 * small.fit.sd[small.fit.names.index(name)])
