"""A stop on either side, declared in campaign.toml: read, identified, and diagnosed beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.data.campaign import SECOND_STOP, Campaign
from bayesimpact.data.read import load_campaign
from bayesimpact.diagnosis.diagnose import diagnose
from bayesimpact.errors import InputError
from bayesimpact.inference.identify import identify
from bayesimpact.model.parameters import build_layout

SECOND = {"stiffness": 4000.0, "gap": 1.5e-3}
STIFF = {"stiffness": 1100.0, "gap": 0.7e-3}
DRAG = 0.6


def recorded(second: dict[str, float], rig: small_rig.Rig, **effects: dict[str, float]) -> Campaign:
    campaign = small_rig.record(3, {"opposite_stop": second, **effects}, rig=rig, duration=1.5)
    return replace(campaign, declared=(SECOND_STOP,))


@pytest.mark.parametrize(
    ("second", "rig"),
    [
        (SECOND, small_rig.RIG),
        (STIFF, replace(small_rig.RIG, g=2.0e-3, k2={"1": 26000.0, "2": 40000.0})),
    ],
    ids=["paper", "stiff"],
)
def test_the_mode_is_the_truth(second: dict[str, float], rig: small_rig.Rig) -> None:
    found = identify(recorded(second, rig), rng=np.random.default_rng(0), search=False)
    fit = found.fit
    assert found.agree and fit.converged
    truth = {"c1": rig.c1, "k1": rig.k1, "c2": rig.c2, "g": rig.g}
    truth |= {f"k2[{case}]": value for case, value in rig.k2.items()}
    truth |= {f"opposite_stop.{name}": value for name, value in second.items()}
    off = [(fit.value(n) - value) / fit.sd[fit.names.index(n)] for n, value in truth.items()]
    assert np.abs(off).max() < 4.0
    assert fit.reduced_chi2 == pytest.approx(1.0, abs=0.15)


def test_a_prior_beyond_all_estimates_is_searched() -> None:
    """And not left, however bad the fit: no estimate puts k1 above 40 kN/m."""
    prior = {"distribution": "uniform", "lower": 1e5, "upper": 2e5}
    campaign = replace(recorded(SECOND, small_rig.RIG), priors={"k1": prior})
    short = replace(campaign, recordings=tuple(r.part(0, 400) for r in campaign.recordings))
    found = identify(short, rng=np.random.default_rng(0), search=False)
    assert 1e5 <= found.fit.value("k1") <= 2e5


def test_what_is_missing_is_named_beside_both_stops() -> None:
    campaign = recorded(SECOND, small_rig.RIG, quadratic_drag={"coefficient": DRAG})
    effects = tuple(BY_ID[i] for i in ("opposite_stop", "quadratic_drag", "spring_cubic"))
    found = diagnose(campaign, rng=np.random.default_rng(0), effects=effects, search=False)
    assert found.verdict == "named" and [e.id for e in found.effects] == ["quadratic_drag"]
    assert all("opposite_stop" not in c.ids for c in found.naming.tried)
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


def test_only_decays_of_a_displacement_have_two_stops(tmp_path: Path) -> None:
    file = recorded(SECOND, small_rig.RIG).save(tmp_path)
    text = file.read_text(encoding="utf-8").replace("[[recording]]", '[[recording]]\nunit = "mm/s"')
    file.write_text(text, encoding="utf-8")
    for csv in tmp_path.glob("*.csv"):
        csv.write_text(csv.read_text().replace("displacement_m", "speed"), encoding="utf-8")
    with pytest.raises(InputError, match=r"key stop.*a, a velocity"):
        load_campaign(tmp_path)
