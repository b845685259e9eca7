"""Real recordings, where they are at hand: what is known of them is found."""

from __future__ import annotations

import os
import runpy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.data.read import load_campaign
from bayesimpact.diagnosis.diagnose import diagnose

pytestmark = pytest.mark.long

HERE = Path(__file__).resolve()
REAL = Path(os.environ.get("BAYESIMPACT_RECORDINGS", HERE.parents[3] / "shared" / "recordings"))


@pytest.fixture(scope="module")
def script() -> Mapping[str, Any]:
    if not REAL.exists():
        pytest.skip("the real recordings are not here")
    return runpy.run_path(str(HERE.parents[1] / "benchmarks" / "real_recordings.py"))


def test_the_pendulum_is_one_and_rubs(script: Mapping[str, Any]) -> None:
    """Told from other laws of large swings and of damping; the script looks for all that is known,
    which takes minutes.
    """
    names = (
        "pendulum_sine", "pendulum_with_spring", "spring_cubic", "spring_quintic",
        "coulomb_friction", "quadratic_drag", "power_damping", "structural_damping",
        "sensor_quadratic", "sensor_drift",
    )  # fmt: skip
    pendulum = diagnose(
        load_campaign(REAL / "pendulum"),
        rng=np.random.default_rng(0),
        effects=tuple(BY_ID[name] for name in names),
        search=False,
    )
    assert pendulum.verdict == "partly"
    assert {e.id for e in pendulum.effects} == {"pendulum_sine", "coulomb_friction"}
    assert script["residual_percent"](pendulum, "free_swing_3") < 1.2 * 0.83
    assert pendulum.remains is not None


@pytest.mark.slow
def test_the_ship_is_dragged(script: Mapping[str, Any]) -> None:
    ship = script["main"]([str(REAL), "--only", "ship_roll"])["ship_roll"]
    assert ship.verdict in ("partly", "unknown") and ship.remains is not None
    assert {e.id for e in ship.effects} <= {"quadratic_drag", "spring_cubic", "coulomb_friction"}
    assert ship.after.reduced_chi2 < ship.before.reduced_chi2


def test_what_is_absent_is_skipped(script: Mapping[str, Any], tmp_path: Path) -> None:
    assert script["main"]([str(tmp_path)]) == {}
