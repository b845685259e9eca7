"""A made-up diagnosis: the content of diagnosis.json, and arrays for its figures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from synthetic import make_results

from bayesimpact.report.diagnosis.force_arrays import POINTS
from bayesimpact.report.figures.diagnosis import DRAWERS
from bayesimpact.report.results import Array, Results


def estimate(median: float, half: float, unit: str) -> dict[str, Any]:
    return {"unit": unit, "median": median, "ci90": [median - half, median + half]}


DIAGNOSIS = {
    "verdict": "named",
    "summary": "Dry friction is missing <here>.",
    "location": {
        "regime": "free", "share": 0.93, "displacement_m": [-0.006, 0.003],
        "velocity_m_s": [-0.25, 0.25], "time_s": [0.0, 6.0], "recordings": ["run_0"],
        "cases": ["1", "2"], "force_rms_n": 1.4e-4,
    },
    "effects": [
        {
            "id": "coulomb_friction", "family": "free damping", "statement": "It rubs.",
            "probability": 0.9998, "delta_log_evidence": 812.34,
            "parameters": {"coulomb_friction.force": estimate(1.6e-4, 1e-5, "N")},
        }
    ],
    "alternatives": [{"id": "obstacle_mass", "probability": 0.01, "delta_log_evidence": 770.0}],
    "fit": {
        "before": {"rms_m": 5.4e-6, "reduced_chi2": 1.17, "whiteness_p": 1e-9,
                   "held_out_log_score": 1000.0},
        "after": {"rms_m": 5e-6, "reduced_chi2": 1.002, "whiteness_p": 0.4,
                  "held_out_log_score": 1320.0},
        "held_out_gain": {"value": 320.0, "se": 79.0},
    },
    "parameters": {"before": {"k1": estimate(808.6, 0.005, "N/m")},
                   "after": {"k1": estimate(808.556, 0.006, "N/m")}},
    "limits": [{"id": "quadratic_drag", "parameter": "coefficient", "unit": "N s2/m2",
                "upper95": 1e-4}],
}  # fmt: skip

MODELS = [
    {"effects": ["coulomb_friction"], "log_odds": 800.0},
    {"effects": ["obstacle_mass"], "log_odds": 797.0},
    {"effects": ["quadratic_drag", "spring_cubic"], "log_odds": 640.0},
    *({"effects": ["sensor_cubic", f"effect_{i}"], "log_odds": 500.0 - i} for i in range(20)),
]
LIMITS = [
    {"id": "quadratic_drag", "parameter": "coefficient", "unit": "N s2/m2", "upper95": 1e-4,
     "detection_limit": 4e-4, "practical_size": 1e-2, "answer": "absent",
     "hidden_bias": {"parameter": "c1", "sd": 3.2, "k2_sd": 0.4}},
    {"id": "contact_relaxation", "parameter": "stiffness", "unit": "N/m", "upper95": 95.0,
     "detection_limit": 330.0, "practical_size": 20.0, "answer": "cannot tell",
     "hidden_bias": {"parameter": "c2", "sd": 78.0, "k2_sd": 1.0}},
]  # fmt: skip


def force(name: str, y: Array, peak: float) -> dict[str, Array]:
    """A conservative bump beyond the gap, and its spread."""
    bump = peak * np.exp(-((1e3 * y - 2.0) ** 2))
    flat = np.full_like(y, 0.1 * peak)
    parts = {"a": bump, "b": bump / 2, "a_sd": flat, "b_sd": flat, "ab": 0.0 * y}
    return {f"{name}_{key}": values for key, values in parts.items()}


def made_up_arrays(count: int, cases: int) -> dict[str, Array]:
    """All arrays of a diagnosis of `count` recordings."""
    rng = np.random.default_rng(4)
    y = np.linspace(-6.5e-3, 3.5e-3, POINTS)
    fast = 0.26 * np.sqrt(1 - ((y + 1.5e-3) / 6e-3).clip(-1, 1) ** 2) + 1e-3
    frequency = np.geomspace(0.3, 450, 20)
    ones = np.ones(20)
    impacts = rng.uniform(0, 5, (count, 12))
    impacts[0, 8:] = np.nan
    scores = rng.uniform(500, 520, count)
    return {
        "force_y": y, "force_v_low": -fast, "force_v_high": fast, "gap": np.array([1.1e-3]),
        **force("force", y, 2e-3), **force("left", y, 1e-4),
        "gain": rng.uniform(-1, 20, (count, 24)), "impact_gain": impacts,
        "before_chi2": rng.uniform(1.0, 1.1, count),
        "spectrum": np.stack([frequency, 2 * ones, ones, 0.8 * ones, 1.2 * ones], axis=1),
        "held_out_recordings": np.stack([scores, scores + 7], axis=1),
        "held_out_cases": np.full((cases, 2), 900.0),
        "before_mode": np.array([808.6]), "before_covariance": np.array([[2.5e-5]]),
    }  # fmt: skip


def diagnosed(count: int = 3, cases: int = 2, *, sampled: bool = True, **changes: Any) -> Results:
    """Results of a diagnosis; `changes` are of diagnosis.json."""
    results = make_results(count, cases, sampled=sampled)
    content = {**DIAGNOSIS, "limits": LIMITS, **changes}
    content.setdefault("evidence", {"models": MODELS, "decisive": 5.5})
    before = results.draws if sampled else None
    return replace(
        results,
        before=before,
        before_backbone=results.backbone,
        diagnosis=content,
        diagnosis_arrays=made_up_arrays(count, cases),
    )


def diagnosis_figures(results: Results) -> dict[str, Figure]:
    """What the drawers of a diagnosis draw."""
    return {name: figure for draw in DRAWERS for name, figure in draw(results).items()}
