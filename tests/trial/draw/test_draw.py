"""Draws: the same seed gives the same trial, sizes are what they claim, every kind of rig works."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data.campaign import Smoothing
from bayesimpact.errors import InputError
from bayesimpact.model.effects import EFFECTS
from bayesimpact.trial.draw.designs import NOISES, RIG_DESIGNS, depth, draw_rig_design
from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.planted_effects import PLANTED_EFFECTS, EffectForm
from bayesimpact.trial.draw.planted_outside import OUTSIDE_EFFECTS
from bayesimpact.trial.draw.sensitivity import Sensitivity, clean_readings, true_parameters
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.draw.sizing import Unsuitable, outside, pair, single, solve
from bayesimpact.trial.rig.catalogue import CATALOGUE
from bayesimpact.trial.rig.outside import OUTSIDE
from bayesimpact.trial.rig.recordings import Release, motion, record
from bayesimpact.trial.run.blind import campaign_files, sealed_text

pytestmark = pytest.mark.long

SMALL = Settings(rig_kinds=("small",), noises=("white",))


@pytest.fixture(scope="module")
def sensitivity() -> Sensitivity:
    rng = np.random.default_rng(2)
    design = draw_rig_design("small", "white", rng)
    return Sensitivity(replace(design, duration=1.2, releases=design.releases[::2]), rng)


def test_every_effect_can_be_planted() -> None:
    """And under the ids that the catalogue of the package uses."""
    assert set(PLANTED_EFFECTS) == set(CATALOGUE) - {"noise_correlated"}
    assert set(OUTSIDE_EFFECTS) == set(OUTSIDE) - {"resonator"}  # which is base_motion
    decays = {e.id for e in EFFECTS} - {"input_delay"}  # the rig is never driven
    assert decays - {"noise_correlated"} <= set(PLANTED_EFFECTS)
    for first, second in ((a, b) for a in EFFECTS for b in EFFECTS if a.id < b.id):
        if first.excludes(second) or (first.replaces and first.replaces == second.replaces):
            assert set(PLANTED_EFFECTS[first.id].slots) & set(PLANTED_EFFECTS[second.id].slots)


@pytest.mark.parametrize("effect", [*PLANTED_EFFECTS, *OUTSIDE_EFFECTS])
def test_forms_are_what_the_rig_takes(effect: str) -> None:
    rng = np.random.default_rng(4)
    design = draw_rig_design("small", "white", rng)
    entry = PLANTED_EFFECTS.get(effect) or OUTSIDE_EFFECTS[effect]
    form = entry.form(design, rng)
    release = design.releases[0]
    planted = {effect: form.build(form.start)}
    reading = record(design.rig, release, planted, rate=design.rate, duration=0.2, rng=rng)
    assert np.isfinite(reading).all()
    assert form.start < form.largest


@pytest.mark.parametrize("rig_kind", RIG_DESIGNS)
@pytest.mark.parametrize("noise", (*NOISES, "slow"))
def test_kinds_of_rigs(rig_kind: str, noise: str) -> None:
    for seed in range(5):
        design = draw_rig_design(rig_kind, noise, np.random.default_rng(seed))
        rig = design.rig
        assert len(design.releases) == max(len(rig.k2), 1) * RIG_DESIGNS[rig_kind].releases
        assert len({r.name for r in design.releases}) == len(design.releases)
        assert all(r.y0 < 0 for r in design.releases)
        lowest = min(abs(r.y0) for r in design.releases)
        assert not rig.k2 or 0 < rig.g < 0.7 * lowest  # every recording hits the obstacle
        assert round(design.rate * design.duration) <= 40_000
        assert (design.chain.correlation != 0) == (noise in ("ar1", "slow"))
        assert (design.chain.white > 0) == (noise == "slow")
        assert (design.measurement.smoothing is not None) == (noise == "smoothed")
        assert design.chain.smoothing == design.measurement.smoothing
        assert any(design.chain.offsets.values()) and design.chain.rounding > 0
        if noise == "smoothed":
            smoothing = design.measurement.smoothing
            assert isinstance(smoothing, Smoothing) and smoothing.window % 2 == 1


def test_deepest_indentation() -> None:
    """By energy; the rig without damping gets there."""
    design = draw_rig_design("small", "white", np.random.default_rng(0))
    rig = replace(design.rig, c1=0.0, c2=0.0)
    start = Release("a", "1", -design.amplitude)
    moved = motion(rig, start, rate=20_000.0, duration=0.25)
    reached = float(moved.displacement.max()) - rig.g
    # at 20 kHz the peak of a 6 Hz motion is met within (pi 6 / 20000)^2 / 2 of it
    assert depth(rig.k1, rig.k2["1"], rig.g, design.amplitude) == pytest.approx(reached, rel=1e-4)
    assert depth(1.0, 2.0, 1.0, 0.5) == 0.0


def test_kinds_and_effects_come_in_turn() -> None:
    settings = replace(SMALL, effects=("sensor_drift", "sensor_hum"), kinds=("control", "single"))
    truths = [draw(settings, seed).truth for seed in (6, 7, 9)]
    assert [t["kind"] for t in truths] == ["control", "single", "single"]
    assert [[p["id"] for p in t["planted"]] for t in truths] == [
        [],
        ["sensor_hum"],
        ["sensor_drift"],
    ]


def test_the_same_seed_gives_the_same_bits() -> None:
    settings = replace(SMALL, effects=("spring_cubic",), kinds=("single",))
    first, second = draw(settings, 3), draw(settings, 3)
    assert sealed_text(first.truth) == sealed_text(second.truth)
    rounding = first.truth["rounding_m"]
    files = campaign_files(first.campaign, rounding)
    assert files == campaign_files(second.campaign, rounding)
    one, other = (draw(replace(SMALL, kinds=("control",)), seed).truth for seed in (3, 4))
    assert one["parameters"] != other["parameters"]
    for text in files.values():  # nothing that is shown tells the truth
        assert "spring" not in text and "single" not in text
    truth = json.loads(sealed_text(first.truth))
    clean = clean_of(settings, 3)
    assert truth["parameters"] == clean
    (planted,) = truth["planted"]
    assert planted["score"] == pytest.approx(5 * planted["strength"])
    assert settings.strength[0] * 0.95 <= planted["strength"] <= settings.strength[1] * 1.05


def clean_of(settings: Settings, seed: int) -> dict[str, float]:
    """True base parameters of a first attempt."""
    rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
    rig_kind, noise = str(rng.choice(settings.rig_kinds)), str(rng.choice(settings.noises))
    return true_parameters(draw_rig_design(rig_kind, noise, rng))


def test_files_hold_the_recordings(tmp_path) -> None:
    from bayesimpact.data.read import load_campaign

    drawn = draw(replace(SMALL, kinds=("control",)), 0)
    rounding = drawn.truth["rounding_m"]
    for name, text in campaign_files(drawn.campaign, rounding).items():
        (tmp_path / name).write_text(text)
    loaded = load_campaign(tmp_path)
    for mine, read in zip(drawn.campaign.recordings, loaded.recordings, strict=True):
        assert np.max(np.abs(mine.samples - read.samples)) <= 0.01 * rounding
        assert (mine.name, mine.case) == (read.name, read.case)


def test_a_score_is_the_misfit_that_a_refit_leaves(sensitivity: Sensitivity) -> None:
    """Against least squares by SciPy, with the rig itself as the base model."""
    from scipy.optimize import least_squares

    design, strength = sensitivity.design, 3.0
    sized = single(sensitivity, "spring_cubic", strength, 1.0, np.random.default_rng(1))
    assert sized.strength == pytest.approx(strength, rel=0.05)
    target = clean_readings(design, {"spring_cubic": sized.numbers})
    truth = true_parameters(design)
    names = list(truth)
    scale = np.array([max(abs(truth[n]), 1e-3) for n in names])

    def misfit(x: np.ndarray) -> np.ndarray:
        values = dict(zip(names, np.array(list(truth.values())) + scale * x, strict=True))
        shared = {n: values[n] for n in ("c1", "k1", "c2", "g")}
        rig = replace(design.rig, **shared, k2={c: values[f"k2[{c}]"] for c in design.rig.k2})
        releases = tuple(
            replace(r, y0=values[f"y0[{r.name}]"], v0=values[f"v0[{r.name}]"])
            for r in design.releases
        )
        offsets = {r.name: values[f"offset[{r.name}]"] for r in releases}
        other = replace(
            design, rig=rig, releases=releases, chain=replace(design.chain, offsets=offsets)
        )
        readings = clean_readings(other, {})
        return np.concatenate(readings) - np.concatenate(target)

    found = least_squares(misfit, np.zeros(len(names)), diff_step=1e-6, max_nfev=5, xtol=1e-12)
    score = np.sqrt(2 * found.cost) / design.chain.noise
    assert score == pytest.approx(sized.score, rel=2e-3)


def test_pairs_stand_out_beside_each_other(sensitivity: Sensitivity) -> None:
    ids = ("sensor_drift", "quadratic_drag")
    found = pair(sensitivity, ids, [2.0, 4.0], 1.0, np.random.default_rng(1))
    alone = [sensitivity.response({one.effect: one.numbers}) for one in found]
    for one, other, strength in ((0, 1, 2.0), (1, 0, 4.0)):
        unit = alone[other] / np.linalg.norm(alone[other])
        left = alone[one] - unit * (unit @ alone[one])
        assert np.linalg.norm(left) == pytest.approx(5 * strength, rel=0.15)
    with pytest.raises(Unsuitable, match="look alike"):
        pair(
            sensitivity, ("sensor_drift", "sensor_drift"), [2.0, 2.0], 1.0, np.random.default_rng(1)
        )


def test_outside_forces_are_sized_by_their_distance(sensitivity: Sensitivity) -> None:
    sized = outside(sensitivity, "detent", 2.0, np.random.default_rng(1))
    assert sized.distinct == pytest.approx(10.0, rel=0.05)
    assert sized.score >= sized.distinct and sized.form.place is not None


def test_an_effect_is_no_distance_from_itself(sensitivity: Sensitivity) -> None:
    sized = single(sensitivity, "sensor_quadratic", 2.0, 1.0, np.random.default_rng(1))
    response = sensitivity.response({"sensor_quadratic": sized.numbers})
    left, nearest = sensitivity.distinct(response)
    assert nearest == "sensor_quadratic" and left < 0.02 * sized.score
    assert sized.distinct is not None and sized.distinct > left and sized.nearest != nearest


def test_the_wrong_sign_imitates_nothing(sensitivity: Sensitivity) -> None:
    """Friction cannot give energy."""
    form = PLANTED_EFFECTS["coulomb_friction"].form(sensitivity.design, np.random.default_rng(0))
    response = sensitivity.response({"coulomb_friction": form.build(form.start)})
    rival = next(r for r in sensitivity._catalogue() if r.effect == "coulomb_friction")
    whole = float(np.linalg.norm(response))
    assert rival.left(response) < 0.2 * whole
    assert rival.left(-response) == pytest.approx(whole)


def test_sizes_are_found_on_curves() -> None:
    form = EffectForm(lambda size: {}, start=1e-3, largest=10.0)
    for power in (0.7, 1.0, 2.0):
        size = solve(lambda s, p=power: 50 * s**p, form, 10.0)
        assert 50 * size**power == pytest.approx(10.0, rel=0.05)
    with pytest.raises(Unsuitable, match="large"):
        solve(lambda s: 0.5 * s, form, 10.0)
    with pytest.raises(Unsuitable, match="seen"):
        solve(lambda s: 0.0, form, 10.0)


def test_no_rig_for_the_effect() -> None:
    settings = Settings(kinds=("single",), effects=("gap_wear",), rig_kinds=("plain",))
    with pytest.raises(InputError, match="trial, rig"):
        draw(settings, 0)
