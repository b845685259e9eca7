"""False alarms: how often is something missed in campaigns in which nothing is missing?

Only the question "is anything missing?" is asked, which is cheap: the scan over the catalogue, the
test for an unknown force, the search for an undeclared filter. Their p-values should be uniform,
whatever the rig and the noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from benchmarks.uniformity import critical_tail, smallest_tail

from bayesimpact.diagnosis.measurement.smoothing import proved_smoothing
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import base_candidate
from bayesimpact.diagnosis.residual_force.gaussian_process import missing_drift, missing_force
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.diagnosis.selection.outcome import ExaminedModel
from bayesimpact.inference.identify import identify
from bayesimpact.model.effects import SEARCHED
from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.score.summary import rate

LEVEL = 0.99


def alarm(settings: Settings, seed: int) -> dict[str, Any]:
    """One control: its p-values and whether anything answers."""
    drawn = draw(settings, seed)
    assert not drawn.truth["planted"]
    rng = np.random.default_rng([seed, 1])
    fit = identify(drawn.campaign, rng=rng, search=False).fit
    scales = campaign_scales(fit)
    scanned = scan(fit, SEARCHED, scales, rng=rng)
    force = missing_force(fit, scales, rng=rng)
    drift = missing_drift(fit, scales, rng=rng)
    alone = ExaminedModel(base_candidate(fit), scanned, force, drift)
    filtered = proved_smoothing(drawn.campaign) is not None
    return {
        "seed": seed,
        "rig_kind": drawn.truth["rig_kind"],
        "noise": drawn.truth["noise_kind"],
        "scan_p": scanned.p_value,
        "force_p": force.p_value,
        "drift_p": drift.p_value,
        "filter": filtered,
        "best": scanned.best()[0].effect.id if scanned.scores else None,
        "alarm": filtered or not alone.is_white,
    }


def false_alarms(rows: Sequence[Mapping[str, Any]], rng: np.random.Generator) -> dict[str, Any]:
    """Alarms in all and by noise and rig; are the p-values uniform, or at least not too small?"""
    critical = critical_tail(len(rows), LEVEL, rng)
    result: dict[str, Any] = {"controls": len(rows), "alarms": _rate(rows)}
    for key in ("noise", "rig_kind"):
        kinds = sorted({row[key] for row in rows})
        result[f"by_{key}"] = {k: _rate([r for r in rows if r[key] == k]) for k in kinds}
    for key in ("scan_p", "force_p", "drift_p"):
        values = np.array([row[key] for row in rows])
        result[key] = {
            "uniform": bool(smallest_tail(values) >= critical),
            "below_0.05": rate(int(np.sum(values < 0.05)), values.size),
            "smallest": float(values.min()),
        }
    result["alarming"] = [row for row in rows if row["alarm"]]
    return result


def _rate(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return rate(sum(row["alarm"] for row in rows), len(rows))
