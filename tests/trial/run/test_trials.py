"""The proof in small: blind trials, end to end, with the real diagnosis and the full catalogue.

A force from outside is diagnosed in tests/diagnosis/candidates/test_likely_terms.py, and such
answers are scored in test_formula_score.py and test_score.py: the search for a formula takes
minutes here.
"""

from __future__ import annotations

import copy
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.run.trials import run_trials
from bayesimpact.trial.score.summary import summarise
from bayesimpact.trial.score.table import summary_text

pytestmark = pytest.mark.long

# One of each kind: seed s draws kinds[s % 3]. Sizes are far above the limits, for this rig is short
# and tells less than the paper's.
SETTINGS = Settings(
    effects=(
        "sensor_quadratic",
        "stiffness_drift",
        "coulomb_friction",
        "spring_cubic",
        "contact_hardening",
    ),
    kinds=("control", "single", "pair"),
    strength=(6.0, 10.0),
    rig_kinds=("small",),
    noises=("white",),
    search=False,
)
SEEDS = range(3)


def timeless(result: dict) -> dict:
    """A stored trial without what the clock says."""
    content = copy.deepcopy(result)
    for part in ("answer", "score"):
        content[part].pop("seconds")
    content.pop("processor_s")
    return content


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> list[dict]:
    return run_trials(SETTINGS, SEEDS, tmp_path_factory.mktemp("trials"))


def test_every_kind_is_answered_right(results: list[dict]) -> None:
    """Nothing is called wrong or left undecided."""
    assert not [r["failed"] for r in results if "failed" in r]
    outcomes = {
        kind: Counter(r["score"]["outcome"] for r in results if r["truth"]["kind"] == kind)
        for kind in SETTINGS.kinds
    }
    assert outcomes["control"] == {"quiet": 1}
    assert outcomes["single"] == outcomes["pair"] == {"named": 1}
    places = [r["score"]["place"] for r in results if r["truth"]["planted"]]
    assert np.mean(places) >= 0.9


def test_what_ignoring_an_effect_costs(results: list[dict]) -> None:
    """The base fit looks right, its parameters are wrong; with the effect named they are right."""
    single = results[1]["score"]
    assert single["concealed"] < 0.2 and single["held_out_gain"] > 0
    before = [row["before_error"] for row in single["coverage"].values()]
    after = [row["after_error"] for row in single["coverage"].values()]
    assert max(map(abs, before)) > 5
    assert max(map(abs, after)) < 4.5  # six normal numbers


def test_one_trial_again_bit_for_bit(results: list[dict], tmp_path: Path) -> None:
    (again,) = run_trials(SETTINGS, range(1, 2), tmp_path)
    assert timeless(again) == timeless(results[1])


def test_the_summary(results: list[dict]) -> None:
    summary = summarise(results)
    assert summary["trials"] == len(SEEDS) and not summary["failed"] and not summary["misses"]
    assert summary["confident_wrong_names"]["hits"] == 0
    assert "controls called adequate         100.0 %" in summary_text(summary)
