"""What a formula may have made idle: only what a refit could show to be."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis.formulas import refits as formula_refits
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.thresholds import DECISIVE


@pytest.mark.parametrize(
    ("repetition", "tried"), [(1.0, {"spring_cubic"}), (9.0, {"spring_cubic", "quadratic_drag"})]
)
def test_what_surely_is_needed_is_not_left_out_to_see(monkeypatch, repetition, tried):
    """By the linear loss, each independent sample counted once."""
    losses = {"spring_cubic": 0.0, "quadratic_drag": 8 * formula_refits.SURE * DECISIVE}
    effects = tuple(BY_ID[i] for i in losses)
    left_out = set()

    def without(candidate, effect, scales, *, enough):
        assert enough.goal == -DECISIVE  # an end below the decisive odds decides nothing
        left_out.add(effect.id)
        return Candidate(tuple(e for e in effects if e is not effect), None, -100.0)

    monkeypatch.setattr(formula_refits, "loss_without", lambda fit, effect: losses[effect.id])
    monkeypatch.setattr(formula_refits, "without", without)
    question = SimpleNamespace(scores=SimpleNamespace(terms=()), scales=None)
    selection = SimpleNamespace(
        repetition=repetition, log_odds=lambda c: c.log_evidence, goal=lambda least: least
    )
    subset = SimpleNamespace(terms=())
    found = formula_refits._without_one(question, selection, subset, Candidate(effects, None, 0.0))
    assert found is None and left_out == tried
