"""The search on a table of made-up evidences: no model is ever fitted."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_models import EFFECTS, Table

from bayesimpact.diagnosis.candidates.one_step import SteppedSet
from bayesimpact.diagnosis.selection import (
    asking,
    elimination,
    models,
    ranked,
    remaining,
    search,
    unlisted,
)


@pytest.fixture
def run(monkeypatch):
    def go(table: Table, effects=EFFECTS, repetition=1.0, refuted=None, free=None):
        monkeypatch.setattr(models, "refit", table.refit)
        monkeypatch.setattr(models, "without", table.without)
        monkeypatch.setattr(models, "exchanged", table.exchanged)
        monkeypatch.setattr(models, "fit_from", table.fit_from)
        monkeypatch.setattr(models, "Asked", table.asks)
        monkeypatch.setattr(models, "shakes_in_own_band", lambda fit, remains: False)
        monkeypatch.setattr(models, "leaves_something", lambda fit: False)
        for module in (asking, ranked, unlisted):
            monkeypatch.setattr(module, "leaves_something", lambda fit: fit.reduced_chi2 > 1.0)
        monkeypatch.setattr(unlisted, "above_noise", lambda fit: fit.reduced_chi2 - 1.0)
        monkeypatch.setattr(models, "is_refuted", lambda fit: fit.ids == refuted)
        monkeypatch.setattr(models, "scan", table.scan)
        monkeypatch.setattr(models, "profiled", table.profiled)
        for module in (search, models):
            monkeypatch.setattr(module, "model_evidence", lambda fit: fit.gain)
        for module in (ranked, remaining):
            monkeypatch.setattr(module, "discrepancy", lambda fit: None)
        monkeypatch.setattr(search, "missing_contact", table.contact)
        monkeypatch.setattr(search, "learn_force", lambda fit, force, scales: force.fit)
        monkeypatch.setattr(ranked, "residual_repetition", lambda fit: repetition)
        monkeypatch.setattr(remaining, "leaves_something", lambda fit: fit is not free)

        def with_force(candidate, *others, **near):
            beside_base = free is not None and not candidate.effects
            return replace(candidate, fit=free) if beside_base else candidate

        monkeypatch.setattr(remaining, "with_force", with_force)
        for rule in ("may_be_needed", "is_needed", "is_told_apart"):
            monkeypatch.setattr(remaining, rule, lambda selection, effect: True)
        monkeypatch.setattr(remaining, "is_imitated", lambda selection: False)
        monkeypatch.setattr(search, "promising_pairs", lambda scan, count: ())
        monkeypatch.setattr(search, "revised", lambda *about: None)
        monkeypatch.setattr(asking, "first_revision", lambda base, fit, say: None)
        monkeypatch.setattr(asking, "under_input_noise", lambda fit: None)
        monkeypatch.setattr(
            asking, "after_steps",
            lambda base, chosen, scales, steps, starts: SteppedSet(
                -table.gain([e.id for e in chosen.effects]), 0.0, chosen
            ),
        )  # fmt: skip
        monkeypatch.setattr(elimination, "is_at_an_end", lambda fit, effect: False)
        for force in ("missing_force", "missing_drift"):
            monkeypatch.setattr(models, force, table.missing)
        monkeypatch.setattr(
            search, "base_candidate", lambda fit: table.candidate((), table.gain(()))
        )
        fit = SimpleNamespace(reduced_chi2=1.0)
        return search.select_model(fit, effects, None, rng=np.random.default_rng(0))

    return go
