"""Families of effects of which some are needed although no law of them is, on made-up evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_up_evidence import DRAG, FRICTION, candidate, examined, remaining, with_misfit

from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.selection.decision import Decision, decide
from bayesimpact.diagnosis.selection.outcome import ExaminedModel
from bayesimpact.diagnosis.thresholds import ALPHA, DECISIVE, EXCESS

CUBIC, DRIFT = "spring_cubic", "sensor_drift"
LEFT = 10.0  # reduced chi-squared of the chosen model
FAR = 1 + (LEFT - 1) * EXCESS + 0.1  # and of one that leaves just enough more


def fitted(ids: str, evidence: float, chi2: float) -> Candidate:
    return with_misfit(candidate(ids, evidence), chi2)


def leaving(chosen: Candidate) -> ExaminedModel:
    """A model beside which something remains."""
    return examined(chosen, p_force=ALPHA / 2, force_evidence=2 * DECISIVE)


def decided(*others: Candidate) -> Decision:
    """Two laws of damping, each of which the other does without, beside a cubic spring."""
    chosen = candidate(f"{FRICTION} {DRAG} {CUBIC}", 300.0)
    near = [fitted(f"{one} {CUBIC}", 298.0, LEFT + 1) for one in (FRICTION, DRAG)]
    stiff = fitted(f"{FRICTION} {DRAG}", 100.0, FAR)
    return decide(remaining(leaving(chosen), 900.0, LEFT, *near, stiff, *others))


WITHOUT = fitted(CUBIC, 100.0, FAR), fitted(f"{CUBIC} {DRIFT}", 120.0, FAR)


def test_a_family_is_needed_that_no_likely_model_does_without():
    said = decided(*WITHOUT)
    assert [e.id for e in said.effects] == [CUBIC]
    assert {f: {e.id for e in m} for f, m in said.families.items()} == {
        "free damping": {FRICTION, DRAG}
    }


@pytest.mark.parametrize("missing", [0, 1])
def test_what_was_not_compared_without_a_family_says_nothing_of_it(missing: int):
    assert not decided(WITHOUT[1 - missing]).families


@pytest.mark.parametrize(
    ("evidence", "chi2", "needed"),
    [
        (120.0, FAR, True),
        (120.0, FAR - 0.2, False),  # an imitation leaves no more
        (300.0 - DECISIVE, FAR, False),
    ],
)
def test_another_set_without_a_family_speaks_against_it(evidence: float, chi2: float, needed: bool):
    rival = fitted(f"{CUBIC} spring_quintic", evidence, chi2)
    assert bool(decided(*WITHOUT, rival).families) == needed


def test_a_refused_line_is_no_rival_of_a_family():
    line = fitted(f"{CUBIC} released_mode", 350.0, LEFT)
    refused = replace(line, log_evidence=-np.inf, refused=line.log_evidence)
    assert decided(*WITHOUT, refused).families and not decided(*WITHOUT, line).families


def test_a_family_of_which_an_effect_is_named_is_not_told_again():
    chosen = candidate(f"{FRICTION} {CUBIC}", 300.0)
    others = [fitted(CUBIC, 100.0, FAR), fitted(FRICTION, 100.0, FAR), WITHOUT[1]]
    said = decide(remaining(leaving(chosen), 900.0, LEFT, *others))
    assert {e.id for e in said.effects} == {FRICTION, CUBIC} and not said.families
