"""What is named beside a remainder has a size by its own interval."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID

from bayesimpact.diagnosis.intervals import NINETY, intervals
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import fit_from
from bayesimpact.diagnosis.selection.decision import Decision, Verdict
from bayesimpact.diagnosis.selection.told_sizes import of_told_size
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify

CUBIC, DRIFT = BY_ID["spring_cubic"], BY_ID["stiffness_drift"]


@pytest.fixture(scope="module")
def found() -> Fit:
    campaign = small_rig.record(
        3,
        {"spring_cubic": {"stiffness": 4e6}},
        rig=small_rig.PLAIN,
        releases=small_rig.PLAIN_RELEASES,
    )
    fit = identify(campaign, rng=np.random.default_rng(0), search=False).fit
    return fit_from(fit, (CUBIC, DRIFT), {}, campaign_scales(fit)).fit


@pytest.mark.parametrize(
    ("sd", "verdict", "named", "kept"),
    [
        (0.9, "partly", "partly", ["spring_cubic", "stiffness_drift"]),
        (1.1, "partly", "partly", ["spring_cubic"]),
        (1.1, "named", "named", ["spring_cubic", "stiffness_drift"]),
    ],
)
def test_an_effect_is_not_named_whose_interval_holds_none(
    found: Fit, sd: float, verdict: Verdict, named: str, kept: list[str]
) -> None:
    """A drift was needed by every likely model, and its interval held none."""
    ranges = intervals(found)
    i = found.names.index("stiffness_drift.rate")
    mean, covariance = ranges.mean.copy(), ranges.covariance.copy()
    covariance[i, i] = (sd * mean[i] / NINETY) ** 2
    wide = replace(ranges, mean=mean, covariance=covariance)
    told = of_told_size(Decision(verdict, (CUBIC, DRIFT)), wide, found)
    assert told.verdict == named and [e.id for e in told.effects] == kept


def test_without_any_nothing_is_known(found: Fit) -> None:
    ranges = intervals(found)
    wide = replace(ranges, covariance=1e12 * ranges.covariance)
    told = of_told_size(Decision("partly", (CUBIC,)), wide, found)
    assert told.verdict == "unknown" and told.effects == ()
