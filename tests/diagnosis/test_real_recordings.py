"""Real recordings, where they are at hand: what is known of them is found."""

from __future__ import annotations

import os
import runpy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from bayesimpact.diagnosis.loop import Diagnosis

HERE = Path(__file__).resolve()
REAL = Path(os.environ.get("BAYESIMPACT_RECORDINGS", HERE.parents[3] / "shared" / "recordings"))


@pytest.fixture(scope="module")
def script() -> Mapping[str, Any]:
    if not REAL.exists():
        pytest.skip("the real recordings are not here")
    return runpy.run_path(str(HERE.parents[1] / "benchmarks" / "real_recordings.py"))


@pytest.fixture(scope="module")
def found(script: Mapping[str, Any]) -> Mapping[str, Diagnosis]:
    return script["main"]([str(REAL)])


def test_the_pendulum_softens_and_rubs(
    script: Mapping[str, Any], found: Mapping[str, Diagnosis]
) -> None:
    pendulum = found["pendulum"]
    assert pendulum.verdict == "named"
    assert {e.id for e in pendulum.effects} == {"spring_cubic", "coulomb_friction"}
    ratio, sd = script["softening"](pendulum)
    assert abs(ratio + 1 / 6) < 1.645 * sd < 0.01
    assert script["residual_percent"](pendulum, "free_swing_3") < 1.2 * 0.83
    assert pendulum.remains


def test_the_ship_is_dragged(script: Mapping[str, Any], found: Mapping[str, Diagnosis]) -> None:
    ship = found["ship_roll"]
    assert {e.id for e in ship.effects} >= {"quadratic_drag", "spring_cubic"}
    assert not {e.id for e in ship.effects} & {"harmonic_forcing", "opposite_stop"}
    assert script["residual_percent"](ship, "roll_21338") < 1.2 * 2.0
    assert ship.remains


def test_what_is_absent_is_skipped(script: Mapping[str, Any], tmp_path: Path) -> None:
    assert script["main"]([str(tmp_path)]) == {}
