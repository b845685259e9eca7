"""A model that contains another one never ends below it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from effect_rigs import BY_ID

from bayesimpact.diagnosis import models
from bayesimpact.diagnosis.models import Models
from bayesimpact.diagnosis.refit import Candidate


def candidate(ids: str, reached: float) -> Candidate:
    fit = SimpleNamespace(log_likelihood=reached, converged=True, reduced_chi2=1.0)
    return Candidate(tuple(BY_ID[i] for i in ids.split()), fit, reached)


@pytest.mark.parametrize(("reached", "again"), [(90.0, True), (130.0, False)])
def test_a_set_reaches_no_less_than_what_it_contains(monkeypatch, reached, again):
    begun: list[tuple[str, ...]] = []

    def grown(smaller, effects, scales):
        begun.append(smaller.ids)
        return candidate(" ".join(e.id for e in effects), 125.0)

    monkeypatch.setattr(models, "grown", grown)
    monkeypatch.setattr(models, "leaves_something", lambda fit: False)
    monkeypatch.setattr(models, "is_refuted", lambda fit: False)
    monkeypatch.setattr(models, "shakes_in_own_band", lambda fit, remains: False)
    search = Models((), None, np.random.default_rng(0), lambda words: None)
    search.keep(candidate("spring_cubic", 120.0))
    search.keep(candidate("coulomb_friction", 50.0))
    larger = search.keep(candidate("spring_cubic quadratic_drag", reached))
    found = search.no_worse(larger)
    assert begun == ([("spring_cubic",)] if again else [])
    assert found.fit.log_likelihood == (125.0 if again else reached)
    assert search.tried[frozenset(found.ids)] is found
