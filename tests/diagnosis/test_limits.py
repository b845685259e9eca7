"""Limits of effects that were not found: quantiles, power, answers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID
from scipy import stats

from bayesimpact.diagnosis.limits import Limit, _answer, limits, upper_limit
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.report.diagnosis.document import _detectable


@pytest.mark.parametrize("mean", [-3.0, -0.5, 0.0, 1.2, 6.0])
def test_upper_limit_is_a_quantile(mean):
    sd = 0.7
    cut = stats.truncnorm(-mean / sd, np.inf, mean, sd)
    assert cut.cdf(upper_limit(mean, sd, True)) == pytest.approx(0.95, abs=1e-9)
    assert cut.cdf(upper_limit(mean, sd, True, 0.6)) == pytest.approx(0.6, abs=1e-9)
    upper = upper_limit(mean, sd, False)
    inside = stats.norm(mean, sd).cdf(upper) - stats.norm(mean, sd).cdf(-upper)
    assert inside == pytest.approx(0.95, abs=1e-9)


def test_upper_limit_far_on_the_wrong_side_is_small_and_positive():
    """A size that wants to be 30 deviations below zero: an exponential tail of sd / 30 is left."""
    for z in (10.0, 30.0, 300.0):
        found = upper_limit(-z, 1.0, True)
        assert found == pytest.approx(-np.log(0.05) / z, rel=0.03)
    assert upper_limit(-30.0, 1.0, False) == pytest.approx(30.0 + 1.6449, abs=1e-3)


@pytest.mark.parametrize(
    ("z", "practical", "expected"),
    [
        (5.0, 3.0, "present"),
        (5.0, 30.0, "negligible"),
        (0.3, 6.0, "absent"),
        (0.3, 1.0, "cannot tell"),
        (3.0, 4.5, "cannot tell"),  # power enough, but such a size is not excluded
        (-2.0, 2.0, "cannot tell"),  # excluded by luck, but there was no power to see it
    ],
)
def test_answers(z, practical, expected):
    """Sizes in units of their standard error."""
    score = SimpleNamespace(z=z, size=np.array([z]))
    power = stats.norm.sf(3.5 - practical)
    assert _answer(score, upper_limit(z, 1.0, True), practical, power) == expected


@pytest.fixture(scope="module")
def found(small):
    scales = campaign_scales(small.fit)
    effects = [BY_ID[e] for e in ("coulomb_friction", "spring_cubic", "gap_wear", "sensor_drift")]
    effects += [BY_ID["contact_no_tension"], BY_ID["contact_damping_per_case"]]
    result = scan(small.fit, effects, scales, rng=np.random.default_rng(0))
    return small.fit, result, scales, limits(small.fit, result, scales)


def test_one_limit_for_every_effect_with_a_size(found):
    _, result, scales, rows = found
    assert {x.effect_id for x in rows} == {
        "coulomb_friction", "spring_cubic", "gap_wear", "sensor_drift", "contact_damping_per_case",
    }  # fmt: skip
    for x in rows:
        score = next(s for s in result.best() if s.effect.id == x.effect_id)
        sd = score.size_sd[0]
        assert x.upper95 > 0 and x.upper95 < 5 * score.size_sd.max()
        assert x.detection == pytest.approx(5 * sd)
        scale = BY_ID[x.effect_id].parameter(x.parameter).scale(scales)
        assert x.power == pytest.approx(stats.norm.sf(3.5 - 0.1 * scale / sd))
        assert x.unit == BY_ID[x.effect_id].parameter(x.parameter).unit


def test_hidden_bias_is_what_the_limit_would_do(found):
    fit, result, _, rows = found
    friction = next(x for x in rows if x.effect_id == "coulomb_friction")
    at = [s.effect.id for s in result.scores].index("coulomb_friction")
    shift = result.projection.absorbed[:, result.groups[at][0]] * friction.upper95
    physical = fit.density.oscillator.layout.roles("physical")
    sizes = np.abs(shift / fit.sd)[physical]
    assert friction.bias == pytest.approx(sizes.max())
    assert friction.biased == fit.names[int(np.argmax(sizes))]
    k2 = [i for i, n in enumerate(fit.names) if n.startswith("k2")]
    assert friction.k2_bias == pytest.approx(np.abs(shift / fit.sd)[k2].max())


@pytest.mark.parametrize(
    ("stop", "told"),
    [
        ("one-sided", "k2 by at most 2.8 %, 0.7 of its standard deviations"),
        (False, "k1 by at most 0.64 %, 3.2 of"),
    ],
)
def test_what_could_hide_moves_a_parameter_that_is_there(stop, told: str) -> None:
    """By so much of it, and of what it is uncertain by; of several obstacles the largest share."""
    one = Limit("gap_wear", "rate", "m/s", 1.0, 1.0, 1.0, "absent", 3.2, "k1", 0.7)
    oscillator = SimpleNamespace(campaign=SimpleNamespace(stop=stop))
    before = SimpleNamespace(
        density=SimpleNamespace(oscillator=oscillator),
        names=("k1", "k2[1]", "k2[2]"),
        mode=np.array([500.0, 1000.0, 2000.0]),
        sd=np.array([1.0, 40.0, 50.0]),
    )
    words = _detectable(SimpleNamespace(limits=(one,), before=before))
    assert f"moves {told}" in words
