"""A stop on either side, declared in campaign.toml: read, identified, and diagnosed beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_rig
from driven_twin import QUANTITIES, driven_states
from effect_rigs import BY_ID

from bayesimpact.data.campaign import SECOND_STOP, Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.quantity import Quantity
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.errors import InputError
from bayesimpact.inference.declared import campaign_sizes, usual_cycle
from bayesimpact.inference.identify import identify
from bayesimpact.inference.initial.rough import rough_estimates
from bayesimpact.model.parameters import build_layout

SECOND = {"stiffness": 4000.0, "gap": 1.5e-3}
STIFF = {"stiffness": 1100.0, "gap": 0.7e-3}
DRAG = 0.6


NOISE: dict[Quantity, float] = {"displacement": 5e-6, "velocity": 1e-3, "acceleration": 0.1}


def recorded(
    second: dict[str, float],
    rig: small_rig.Rig,
    quantity: Quantity = "displacement",
    **effects: dict[str, float],
) -> Campaign:
    noise = NOISE[quantity]
    chain = small_rig.MeasuringChain(
        noise=noise, offsets={"a": 3 * noise, "b": -2 * noise, "c": 0.0}
    )
    added = {"opposite_stop": second, **effects}
    campaign = small_rig.record(3, added, rig=rig, chain=chain, duration=1.5, quantity=quantity)
    return replace(campaign, declared=(SECOND_STOP,))


FAR_AND_STIFF = replace(small_rig.RIG, g=2.0e-3, k2={"1": 26000.0, "2": 40000.0})


@pytest.mark.parametrize(
    ("second", "rig", "quantity"),
    [
        (SECOND, small_rig.RIG, "displacement"),
        (SECOND, small_rig.RIG, "acceleration"),
        pytest.param(STIFF, FAR_AND_STIFF, "velocity", marks=pytest.mark.long),
    ],
)
def test_the_mode_is_the_truth(
    second: dict[str, float], rig: small_rig.Rig, quantity: Quantity
) -> None:
    campaign = recorded(second, rig, quantity)
    found = identify(campaign, rng=np.random.default_rng(0), search=False)
    fit = found.fit
    assert found.agree and fit.converged
    assert found.from_search is not None
    ends = found.from_search.log_posterior, found.from_guess.log_posterior
    assert ends[0] == pytest.approx(ends[1], abs=1e-3)  # 1e-2 where differences took long steps
    truth = {"c1": rig.c1, "k1": rig.k1, "c2": rig.c2, "g": rig.g}
    truth |= {f"k2[{case}]": value for case, value in rig.k2.items()}
    truth |= {f"opposite_stop.{name}": value for name, value in second.items()}
    off = [(fit.value(n) - value) / fit.sd[fit.names.index(n)] for n, value in truth.items()]
    assert np.abs(off).max() < 4.0
    assert fit.reduced_chi2 == pytest.approx(1.0, abs=0.15)


def test_sizes_of_a_rig_are_those_of_its_motion_whatever_is_read() -> None:
    """Between two buffers that are met in every half cycle accelerations say nothing of the free
    frequency: as an oscillation of that they were many times the motion, and no gap of a search
    was as small as the rig's.
    """
    rig = small_rig.Rig(0.25, 0.25, 300.0, 3.0, 1e-3, {"1": 9000.0})
    second = {"stiffness": 14000.0, "gap": 1.4e-3, "damping": 4.0}
    releases = [small_rig.Release("a", "1", -2e-4, 0.35), small_rig.Release("b", "1", -2e-4, -0.3)]
    found = {}
    for quantity, noise in NOISE.items():
        chain = small_rig.MeasuringChain(noise=noise, offsets=dict.fromkeys("ab", 0.0))
        campaign = small_rig.record(
            5, {"spring_piecewise": second}, rig=rig, quantity=quantity, rate=5000.0,
            duration=0.6, releases=releases, chain=chain,
        )  # fmt: skip
        campaign = replace(campaign, declared=(SECOND_STOP,))
        estimates = rough_estimates(campaign)
        found[quantity] = campaign_sizes(campaign, estimates).amplitude, usual_cycle(campaign)
        assert estimates.v0["a"] == pytest.approx(0.35, rel=0.2)
        assert estimates.v0["b"] == pytest.approx(-0.3, rel=0.2)
    reach, cycle = found.pop("displacement")
    for other in found.values():
        assert other == pytest.approx((reach, cycle), rel=0.2)
    assert cycle < 0.4 * 2 * np.pi * np.sqrt(rig.mass / rig.k1)


def test_the_second_stop_has_a_damper_of_its_own() -> None:
    """Against the independent rig, which knows it as a second spring with damping."""
    second = {**SECOND, "damping": 4.0}
    chain = small_rig.MeasuringChain(noise=5e-6, offsets={"a": 1e-5, "b": 0.0, "c": 0.0})
    campaign = small_rig.record(3, {"spring_piecewise": second}, chain=chain, duration=1.5)
    fit = identify(
        replace(campaign, declared=(SECOND_STOP,)), rng=np.random.default_rng(0), search=False
    ).fit
    names = [f"opposite_stop.{name}" for name in second]
    sd = [fit.sd[fit.names.index(name)] for name in names]
    off = [(fit.value(n) - v) / s for n, v, s in zip(names, second.values(), sd, strict=True)]
    assert np.abs(off).max() < 4.0 and fit.reduced_chi2 == pytest.approx(1.0, abs=0.15)
    assert sd[-1] < 0.1 * second["damping"]


def test_a_prior_beyond_all_estimates_is_searched() -> None:
    """And not left, however bad the fit: no estimate puts k1 above 40 kN/m."""
    prior = {"distribution": "uniform", "lower": 1e5, "upper": 2e5}
    campaign = replace(recorded(SECOND, small_rig.RIG), priors={"k1": prior})
    short = replace(campaign, recordings=(campaign.recordings[0].part(0, 200),))
    found = identify(short, rng=np.random.default_rng(0), search=False)
    assert 1e5 <= found.fit.value("k1") <= 2e5


@pytest.mark.long
@pytest.mark.usefixtures("catalogue_alone")
def test_what_is_missing_is_named_beside_both_stops() -> None:
    campaign = recorded(SECOND, small_rig.RIG, quadratic_drag={"coefficient": DRAG})
    effects = tuple(BY_ID[i] for i in ("opposite_stop", "quadratic_drag", "spring_cubic"))
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["quadratic_drag"]
    assert all("opposite_stop" not in c.ids for c in found.selection.tried)
    name = "quadratic_drag.coefficient"
    sd = found.after.sd[found.after.names.index(name)]
    assert abs(found.after.value(name) - DRAG) < 4.0 * sd
    assert "opposite_stop.gap" in found.after.names


def test_campaign_toml_declares_it(tmp_path: Path) -> None:
    campaign = recorded(SECOND, small_rig.RIG)
    file = campaign.save(tmp_path)
    text = file.read_text(encoding="utf-8")
    assert 'stop = "two-sided"' in text
    again = load_campaign(tmp_path)
    assert again.stop and again.declared == (SECOND_STOP,) and "two-sided" in repr(again)
    file.write_text(text.replace("two-sided", "one-sided"), encoding="utf-8")
    assert load_campaign(tmp_path).stop and not load_campaign(tmp_path).declared
    for wrong in ('"three-sided"', "1"):
        file.write_text(text.replace('"two-sided"', wrong), encoding="utf-8")
        with pytest.raises(InputError, match="key stop: found"):
            load_campaign(tmp_path)


def test_an_unknown_effect_cannot_be_declared() -> None:
    campaign = replace(recorded(SECOND, small_rig.RIG), declared=("oposite_stop",))
    with pytest.raises(InputError, match="declared: found oposite_stop"):
        build_layout(campaign)


@pytest.mark.parametrize(
    ("kind", "quantity", "noise"),
    [
        ("sweep", "acceleration", 2e-2),
        pytest.param("noise", "displacement", 5e-6, marks=pytest.mark.long),
    ],
)
def test_driven_against_both_stops(kind: str, quantity: Any, noise: float) -> None:
    """By DOP853, beginning at rest: the search looks where the motion is large."""
    n, interval = 1500, 2e-3
    truth = {"c1": 0.6, "k1": 800.0, "c2": 2.0, "g": 1.1e-3, "k2": 5000.0}
    rng = np.random.default_rng(5)
    t = interval * np.arange(n)
    force = 1.5 * np.sin(2 * np.pi * (4.0 * t + 1.2 * t**2)) * np.minimum(t, 1.0)
    if kind == "noise":
        force = 7.0 * np.convolve(rng.standard_normal(n), np.ones(5) / 5, "same")

    def second(y: float, v: float, touching: bool) -> float:
        return STIFF["stiffness"] * min(y + STIFF["gap"], 0.0)

    values = {"mass": 0.5, "y0": 0.0, "v0": 0.0, **truth}
    states, events = driven_states(values, force, interval, second)
    assert events > 8 and states[0].min() < -1.5 * STIFF["gap"]
    samples = states[QUANTITIES.index(quantity)] + 40 * noise + noise * rng.standard_normal(n)
    recording = Recording("one", "1", samples, interval, quantity=quantity, input=Input(force))
    campaign = Campaign("rig", 0.5, (recording,), declared=(SECOND_STOP,))
    found = identify(campaign, rng=np.random.default_rng(0), search=False)
    fit = found.fit
    assert found.agree and fit.converged
    assert found.from_search is not None
    ends = found.from_search.log_posterior, found.from_guess.log_posterior
    assert ends[0] == pytest.approx(ends[1], abs=1e-3)  # 1e-2 where differences took long steps
    truth["k2[1]"] = truth.pop("k2")
    truth |= {f"opposite_stop.{name}": value for name, value in STIFF.items()}
    off = [(fit.value(n) - value) / fit.sd[fit.names.index(n)] for n, value in truth.items()]
    assert np.abs(off).max() < 4.0
    assert fit.rms == pytest.approx(noise, rel=0.1)
