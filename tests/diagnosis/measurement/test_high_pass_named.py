"""A high-pass that campaign.toml does not state is told, alone and beside physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.start import find_start
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.diagnosis.faults.recording_faults import cleaned_campaign
from bayesimpact.diagnosis.measurement.high_pass import behind_high_pass, through_high_pass
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED
from bayesimpact.trial.rig.measuring_chain import MeasuringChain

NOISE = {"displacement": 5e-6, "acceleration": 2e-2}
FINER = 8
DRAG = {"quadratic_drag": {"coefficient": 0.05}}
CUBIC = {"spring_cubic": {"stiffness": 3e6}}
NEAR = tuple(
    BY_ID[i]
    for i in (
        "sensor_high_pass", "sensor_drift", "sensor_quadratic", "quadratic_drag", "spring_cubic",
        "stiffness_drift", "coulomb_friction", "gap_wear", "contact_damping_indentation",
    )
)  # fmt: skip


def recorded(
    corner: float, held: float = 1.0, quantity: str = "displacement", effects: dict | None = None
) -> Campaign:
    """The small rig through a high-pass that had settled on a share of where the mass was held."""
    planted = dict(effects or {})
    at = {r.name: held * r.y0 if quantity == "displacement" else 0.0 for r in small_rig.RELEASES}
    if corner:
        rates = {name: 2 * np.pi * corner * y for name, y in at.items()}
        planted["sensor_high_pass"] = {"corner": corner, "rate": rates}
    rate = 1000.0 * FINER  # in the rig, too, a filter sees jumps of an acceleration at its samples
    fine = small_rig.record(2, planted, chain=MeasuringChain(), rate=rate, quantity=quantity)
    rng, thin = np.random.default_rng(2), []
    for r in fine.recordings:
        samples = r.samples[::FINER]
        noise = NOISE[quantity] * rng.standard_normal(samples.size)
        thin.append(replace(r, samples=samples + noise, interval=FINER * r.interval))
    return replace(fine, recordings=tuple(thin))


def first_look(campaign: Campaign) -> float | None:
    """The corner that is told before anything else; None where none is."""
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    found = through_high_pass(fit, SEARCHED)
    return None if found is None else found.value("sensor_high_pass.corner")


@pytest.mark.parametrize("held", [0.0, 1.0])
def test_a_first_look_finds_the_corner(held: float) -> None:
    assert first_look(recorded(0.5, held)) == pytest.approx(0.5, rel=5e-3)


def test_a_first_look_at_a_failed_fit_finds_it_beside_physics() -> None:
    assert first_look(recorded(0.5, effects=DRAG)) == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("effects", [None, DRAG, CUBIC])
def test_a_first_look_takes_nothing_else_for_it(effects: dict | None) -> None:
    assert first_look(recorded(0.0, effects=effects)) is None


def test_one_that_is_stated_is_not_looked_for() -> None:
    campaign = recorded(0.5)
    stated = tuple(replace(r, high_pass=1.5) for r in campaign.recordings)
    assert first_look(replace(campaign, recordings=stated)) is None


def test_a_start_that_only_the_filter_makes_is_none() -> None:
    """Of a mass that was held long enough the first reading is that at rest, and the motion grows
    from it.
    """
    campaign = recorded(1.5)
    rng = np.random.default_rng(0)
    cleaned = cleaned_campaign(campaign, rng=rng, search=False)
    assert "recording_start" in [f.id for f in cleaned.own]
    whole, passed = behind_high_pass(cleaned, campaign, SEARCHED, rng=rng, search=False)
    assert passed is not None and passed.value("sensor_high_pass.corner") == pytest.approx(
        1.5, 5e-3
    )
    assert "recording_start" not in [f.id for f in whole.own]
    sizes = [r.samples.size for r in passed.density.oscillator.campaign.recordings]
    assert sizes == [r.samples.size for r in campaign.recordings]
    stated = tuple(replace(r, high_pass=1.5) for r in campaign.recordings)
    assert not [f for r in stated for f in find_start(r)]


@pytest.mark.long
@pytest.mark.parametrize(
    ("corner", "quantity", "effects"),
    [
        (0.5, "displacement", {}),
        (1.0, "acceleration", {}),
        (0.5, "displacement", DRAG),
    ],
)
def test_it_is_named(corner: float, quantity: str, effects: dict) -> None:
    campaign = recorded(corner, quantity=quantity, effects=effects)
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=NEAR, search=False)
    assert found.verdict == "named"
    assert {e.id for e in found.effects} == {"sensor_high_pass", *effects}
    place = found.after.names.index("sensor_high_pass.corner")
    assert abs(found.after.mode[place] - corner) < 3.5 * found.after.sd[place] < 0.05 * corner
    assert not (found.corrected and found.corrected.faults)
