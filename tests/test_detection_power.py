"""Power: theory against simulation, and the bookkeeping of observed trials."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.detection_power import (
    STRENGTHS,
    Power,
    bundled_design,
    critical_score,
    observed,
    power,
    power_text,
    reaching,
)
from benchmarks.detection_power_figures import limits_figure, power_figure

from bayesimpact.diagnosis.selection.outcome import DECISIVE
from bayesimpact.trial.draw.designs import draw_rig_design
from bayesimpact.trial.draw.sensitivity import Sensitivity

pytestmark = pytest.mark.long

ONE = Power("spring_cubic", "stiffness", 100.0, 1.0, 0.5, "spring_quadratic")
CRITICAL = 3.8


def test_the_law_of_detection_and_selection() -> None:
    """Monte Carlo of what the law states: a score, and a likelihood ratio against the rival."""
    rng, n = np.random.default_rng(0), 200_000
    for strength in (0.8, 1.2, 2.0):
        z = 5 * strength
        seen = np.mean(z + rng.standard_normal(n) > CRITICAL)
        d = z * ONE.distinct
        # log likelihood ratio of two models a distance d apart, the first being true
        ratio = 0.5 * d**2 + d * rng.standard_normal(n)
        wins = np.mean(ratio > DECISIVE)
        error = 4 * 0.5 / np.sqrt(n)
        x = np.array([strength])
        assert ONE.detected(x, CRITICAL)[0] == pytest.approx(seen, abs=error)
        assert ONE.named(x, CRITICAL)[0] == pytest.approx(seen * wins, abs=2 * error)


def test_where_a_curve_reaches_ninety_per_cent() -> None:
    curve = ONE.detected(STRENGTHS, CRITICAL)
    # Phi(5 s - 3.8) = 0.9 at s = (3.8 + 1.2816) / 5; the grid is 1.3 % fine
    assert reaching(curve) == pytest.approx((3.8 + 1.281552) / 5, rel=0.014)
    assert reaching(0.5 * curve) is None
    assert reaching(np.ones(STRENGTHS.size)) == STRENGTHS[0]
    assert ONE.size(2.0) == 200.0


def test_the_critical_score() -> None:
    """Above that of one test, below Bonferroni's for three hundred; alarms at its rate."""
    rng = np.random.default_rng(1)
    sensitivity = Sensitivity(draw_rig_design("small", "white", rng), rng)
    assert 4.0 < critical_score(sensitivity, rng) < 5.5
    found = power(sensitivity, "sensor_drift", rng)
    assert (
        found is not None
        and found.size_name == "rate"
        and found.exponent == pytest.approx(1, abs=0.05)
    )
    response = sensitivity.response({"sensor_drift": {"rate": found.limit}})
    assert np.linalg.norm(response) == pytest.approx(5.0, rel=0.02)
    assert power(sensitivity, "contact_no_tension", rng) is None


def test_the_bundled_design() -> None:
    design = bundled_design(27)
    assert len({r.name for r in design.releases}) == 27
    assert [r.case for r in design.releases[:3]] == ["1", "2", "3"]
    assert design.releases[:9] == bundled_design().releases


def trial(strength: float, outcome: str, verdict: str) -> dict:
    truth = {"kind": "single", "planted": [{"id": "gap_wear", "strength": strength}]}
    return {"truth": truth, "score": {"outcome": outcome, "verdict": verdict}}


def test_observed_shares() -> None:
    results = [
        trial(1.0, "missed", "adequate"),
        trial(1.02, "named", "named"),
        trial(2.0, "wrong name", "named"),
        {"failed": "Traceback", "truth": {}},
    ]
    table = observed(results)["gap_wear"]
    assert set(table) == {"1.00", "2.00"}
    assert (table["1.00"]["detected"]["hits"], table["1.00"]["named"]["hits"]) == (1, 1)
    assert (table["2.00"]["detected"]["hits"], table["2.00"]["named"]["hits"]) == (1, 0)
    assert table["2.00"]["wrong_name"]["hits"] == 1


def test_figures_and_table() -> None:
    x = np.array([0.5, 1.0, 2.0])
    row = {
        "size": "stiffness", "limit": 1.0, "nearest": "gap_wear", "distinct": 0.5,
        "detected_90_size": 1.1, "named_90_size": None,
        "detected": ONE.detected(x, CRITICAL).tolist(), "named": ONE.named(x, CRITICAL).tolist(),
    }  # fmt: skip
    seen = observed([trial(1.0, "named", "named")])
    document = {
        "strengths": x.tolist(),
        "effects": {"gap_wear": row, "spring_cubic": row},
        "observed": seen,
        "limit_by_recordings": {"gap_wear": {"3": 1.7, "9": 1.0}},
    }
    panels = [a for a in power_figure(document).axes if a.axison]
    assert [a.get_title(loc="left") for a in panels] == ["gap wear", "spring cubic"]
    assert len(panels[0].lines) == len(panels[1].lines) + 4  # two points and their intervals
    (axis,) = limits_figure(document).axes
    assert axis.lines[0].get_ydata().tolist() == [1.7, 1.0]
    text = power_text(document)
    assert "gap_wear (50 % apart)" in text and "3: 1.70" in text
