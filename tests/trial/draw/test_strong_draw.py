"""Draws of the strong regime: reproducible, in their range, every effect needed."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bayesimpact.data.read import load_campaign
from bayesimpact.errors import InputError
from bayesimpact.inference.identify import identify
from bayesimpact.trial.draw.designs import draw_rig_design
from bayesimpact.trial.draw.drawn import DrawnTrial
from bayesimpact.trial.draw.identifiable import left_of, stand_outs
from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.sensitivity import Sensitivity
from bayesimpact.trial.draw.settings import Settings, settings_from, strong_settings
from bayesimpact.trial.draw.strong import LEAST, _ids, _rivals
from bayesimpact.trial.draw.strong_effects import (
    CATALOGUE_STRONG,
    SORTS,
    STRONG_OUTSIDE,
    TIMED,
    Chosen,
    chosen,
)
from bayesimpact.trial.draw.strong_rigs import (
    ENCODER_SD,
    GROUPS,
    STEPS,
    STRONG_RIGS,
    draw_rig,
    noise_range,
    with_noise,
)
from bayesimpact.trial.rig.recordings import Rig
from bayesimpact.trial.run.blind import campaign_files, sealed_text

pytestmark = pytest.mark.long

PENDULUM = strong_settings(kinds=("several",), rig_kinds=("one_pendulum",), rest=0.0)
DECAY = replace(PENDULUM, rig_kinds=("one_decay",))
SORT_OF = {effect: sort for sort, names in SORTS.items() for effect in names}


@pytest.fixture(scope="module")
def pendulum() -> DrawnTrial:
    return draw(PENDULUM, 0)


@pytest.fixture(scope="module")
def decay() -> DrawnTrial:
    return draw(DECAY, 1)


def test_every_sort_and_group_is_of_known_things() -> None:
    assert {b for names in GROUPS.values() for b in names} == set(STRONG_RIGS)
    assert set(CATALOGUE_STRONG) <= set(SORT_OF) and "pendulum_sine" in CATALOGUE_STRONG
    assert not set(CATALOGUE_STRONG) & set(STRONG_OUTSIDE)
    assert len(SORT_OF) == sum(map(len, SORTS.values()))  # an effect is of one sort


def test_the_same_seed_gives_the_same_bits(pendulum: DrawnTrial) -> None:
    again = draw(PENDULUM, 0)
    assert sealed_text(again.truth) == sealed_text(pendulum.truth)
    files = campaign_files(pendulum.campaign, pendulum.truth["rounding_m"])
    assert files == campaign_files(again.campaign, pendulum.truth["rounding_m"])
    assert "pendulum" not in "".join(files.values())


@pytest.mark.parametrize("name", ["pendulum", "decay"])
def test_the_misfit_is_what_the_truth_says(name: str, request: pytest.FixtureRequest) -> None:
    """The base model fitted to the recordings with their noise."""
    drawn = request.getfixturevalue(name)
    truth = drawn.truth
    found = identify(drawn.campaign, rng=np.random.default_rng(1), search=False).fit
    assert found.rms / truth["noise_rms_m"] == pytest.approx(truth["misfit"], rel=0.1)
    assert 2.9 <= truth["misfit"] <= 310
    assert 2 <= len(truth["planted"]) <= 4
    assert all(5 * p["strength"] >= 0.999 * LEAST for p in truth["planted"])
    assert isinstance(truth["rejected"], dict) and not truth["rest_s"]


def test_an_encoder_reads_steps(pendulum: DrawnTrial, tmp_path) -> None:
    truth = pendulum.truth
    step = truth["rounding_m"]
    assert STEPS[0] <= step <= STEPS[1] * (1 + 1e-9)
    assert truth["noise_rms_m"] == pytest.approx(ENCODER_SD * step)
    for name, text in campaign_files(pendulum.campaign, step).items():
        (tmp_path / name).write_text(text)
    (recording,) = load_campaign(tmp_path).recordings
    assert recording.quantity == "angle"
    turns = recording.samples / step
    assert np.abs(turns - np.round(turns)).max() < 0.02
    assert truth["planted"][0]["id"] == "pendulum_sine"
    assert truth["planted"][0]["parameters"]["stiffness"] == truth["parameters"]["k1"]


def test_noise_of_an_encoder_has_the_size_it_says() -> None:
    rng = np.random.default_rng(0)
    value = rng.uniform(-1, 1, 200_000)
    read = np.round(value + 0.2 * rng.standard_normal(value.size))
    assert np.std(read - value) == pytest.approx(ENCODER_SD, rel=0.01)
    design = with_noise(draw_rig("pendulums", "white", rng), 5e-4)
    assert design.chain.rounding * ENCODER_SD == pytest.approx(5e-4)
    assert design.noise_kind == "encoder" and noise_range(design)[0] < 5e-4
    other = with_noise(draw_rig("decays", "ar1", rng), 2e-5)
    assert (other.chain.noise, other.noise_kind) == (2e-5, "ar1") and other.chain.correlation > 0


@pytest.mark.parametrize("rig_kind", STRONG_RIGS)
@pytest.mark.parametrize("kind", ["several", "several_outside"])
def test_never_two_of_a_sort(rig_kind: str, kind: str) -> None:
    settings = strong_settings()
    rng = np.random.default_rng(5)
    design = draw_rig(rig_kind, "white", rng)
    counts = set()
    for resting in (False, True):
        for _ in range(40):
            ids = _ids(settings, kind, design, resting, rng)
            counts.add(len(ids))
            inside = [e for e in ids if e in CATALOGUE_STRONG]
            sorts = [SORT_OF[e] for e in inside]
            assert len(set(sorts)) == len(sorts)
            assert len(ids) - len(inside) == (kind == "several_outside")
            assert ("pendulum_sine" in ids) == (rig_kind in GROUPS["pendulum"])
            assert not resting or not set(ids) & set(TIMED)
    assert counts == {2, 3, 4}


def test_trials_begin_at_rest_when_asked() -> None:
    drawn = draw(replace(PENDULUM, rest=1.0), 0)
    ((name, seconds),) = drawn.truth["rest_s"].items()
    (recording,) = drawn.campaign.recordings
    held = round(seconds * drawn.truth["rate_hz"])
    assert held > 5 and recording.name == name
    step = drawn.truth["rounding_m"]
    assert np.ptp(recording.samples[:held]) <= 2.01 * step
    assert np.ptp(recording.samples[held:]) > 100 * step
    assert recording.samples.size - held == round(
        drawn.truth["duration_s"] * drawn.truth["rate_hz"]
    )


def test_what_no_column_can_imitate() -> None:
    """Against least squares."""
    rng = np.random.default_rng(3)
    response, columns = rng.standard_normal(50), [rng.standard_normal(50) for _ in range(4)]
    columns.append(columns[0] - columns[2])  # one too many
    matrix = np.stack(columns, axis=1)
    left = response - matrix @ np.linalg.lstsq(matrix, response, rcond=None)[0]
    assert left_of(response, columns) == pytest.approx(np.linalg.norm(left))
    assert left_of(matrix @ rng.standard_normal(5), columns) < 1e-12


@pytest.fixture(scope="module")
def small():
    rng = np.random.default_rng(2)
    design = draw_rig_design("small", "white", rng)
    return replace(design, duration=0.7, releases=design.releases[::2])


def _small(design, effect: str, size: float, seed: int = 0) -> Chosen:
    found = chosen(effect, design, np.random.default_rng(seed))
    return replace(found, size=size * found.form.start)


@pytest.mark.parametrize("effect", ["spring_cubic", "contact_damping_per_case"])
def test_a_small_effect_stands_out_by_what_a_refit_leaves(small, effect: str) -> None:
    """Against the base model fitted in full to what the rig records."""
    sensitivity = Sensitivity(small, np.random.default_rng(0))
    one = _small(small, effect, 3.0)
    left = sensitivity.response({effect: one.form.build(one.size)})
    (own,) = stand_outs(small, [one])
    assert own / small.chain.noise == pytest.approx(np.linalg.norm(left), rel=0.03)


def test_an_effect_is_hidden_by_its_like(small) -> None:
    drag = _small(small, "quadratic_drag", 30.0)
    alike = _small(small, "coulomb_friction", 30.0)
    other = _small(small, "sensor_quadratic", 30.0)
    (alone,) = stand_outs(small, [drag])
    beside_like, beside_other = (stand_outs(small, [drag, x])[0] for x in (alike, other))
    assert beside_like < 0.9 * alone
    assert beside_other == pytest.approx(alone, rel=0.1)


def test_a_force_from_outside_has_the_whole_catalogue_against_it(small) -> None:
    short = replace(small, duration=0.3)
    preload = _small(short, "contact_preload", 30.0)
    rivals = _rivals(short, ["contact_preload"], np.random.default_rng(0))
    assert {"contact_hardening", "coulomb_friction", "sensor_hum"} < set(rivals)
    assert set(rivals) == set(CATALOGUE_STRONG) - {"pendulum_sine"}
    few = {name: rivals[name] for name in ("contact_power_law", "obstacle_mass")}
    assert stand_outs(short, [preload], few)[0] < 0.9 * stand_outs(short, [preload])[0]


def test_settings_of_the_regime() -> None:
    settings = strong_settings(kinds=("several_outside",))
    assert settings_from(json.loads(json.dumps(settings.document()))) == settings
    old = {k: v for k, v in Settings().document().items() if k not in ("regime", "misfit", "rest")}
    assert settings_from(old) == Settings()
    for wrong, place in (
        ({"kinds": ("single",)}, "kinds"),
        ({"rig_kinds": ("paper",)}, "rig_kinds"),
        ({"misfit": (0.5, 3.0)}, "misfit"),
        ({"rest": 2.0}, "rest"),
    ):
        with pytest.raises(InputError, match=place):
            strong_settings(**wrong)
    with pytest.raises(InputError, match="regime"):
        Settings(regime="odd")
    with pytest.raises(InputError, match="effects"):
        _ids(
            strong_settings(effects=("spring_cubic",)),
            "several",
            replace(draw_rig("decays", "white", np.random.default_rng(0)), rig=Rig(1.0, 1.0, 1.0)),
            False,
            np.random.default_rng(0),
        )
