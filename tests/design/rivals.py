"""Two laws of damping fitted to one small campaign: rivals as a diagnosis leaves them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.design.hypotheses import FittedModel, Rivalry, releases
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.refits.refit import Candidate, base_candidate, refit
from bayesimpact.diagnosis.score_test.scan import scan
from bayesimpact.inference.identify import Identification
from bayesimpact.model.effects import EFFECTS


def base_rivalry(small: Identification) -> Rivalry:
    """The base model alone, with nothing missing."""
    return rivalry_of([base_candidate(small.fit)], "adequate")


def fitted(small: Identification, *ids: str) -> list[Candidate]:
    """Models with one effect each, fitted."""
    scales = campaign_scales(small.fit)
    effects = [e for i in ids for e in EFFECTS if e.id == i]
    found = scan(small.fit, effects, scales, rng=np.random.default_rng(0))
    best = {s.effect.id: s for s in reversed(found.best())}
    return [refit(small.fit, [best[i]], scales) for i in ids]


def rivalry_of(models: list[Candidate], verdict: str = "ambiguous") -> Rivalry:
    """Fitted models as rivals of equal odds."""
    first = models[0].fit.density
    campaign = first.oscillator.campaign
    made = Rivalry(
        "ambiguous",
        tuple(
            FittedModel(m.effects, m.fit.names, m.fit.mode, m.fit.covariance, 0.0) for m in models
        ),
        first.likelihood.noise,
        1.0,
        campaign.mass,
        campaign.stop,
        campaign.recordings[0].quantity,
        releases(models[0]),
    )
    return replace(made, verdict=verdict)
