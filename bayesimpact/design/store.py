"""Rivals as plain text and named arrays, and back: in the results of a diagnosis, never pickled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Smoothing
from bayesimpact.design.hypotheses import FittedModel, PastRelease, Rivalry
from bayesimpact.diagnosis.residual_force.learned import (
    LEARNED,
    knots_of,
    learned_contact,
    learned_drift,
    learned_force,
)
from bayesimpact.errors import InputError
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects.effect import Effect

Array = NDArray[np.float64]
Content = Mapping[str, Any]
ARRAY = "hypothesis_{}_{}"


def rivals_content(rivals: Rivalry) -> tuple[dict[str, Any], dict[str, Array]]:
    """What JSON can say of the rivals, and their arrays by name."""
    noise = asdict(replace(rivals.noise, forces=None))  # of recordings that were made
    del noise["forces"]
    content = {
        "noise": {k: noise[k] for k in ("correlation", "others", "smoothing", "scales", "source")},
        "repetition": rivals.repetition,
        "mass": rivals.mass,
        "stop": rivals.stop,
        "quantity": rivals.quantity,
        "releases": [asdict(r) for r in rivals.releases],
        "models": [
            {
                "effects": list(h.ids),
                "learned": [_knots(e) for e in h.effects if e.id == LEARNED],
                "names": list(h.names),
                "log_odds": h.log_odds,
            }
            for h in rivals.hypotheses
        ],
    }
    arrays = {}
    for i, h in enumerate(rivals.hypotheses):
        arrays[ARRAY.format(i, "mode")] = h.mode
        arrays[ARRAY.format(i, "covariance")] = h.covariance
    return content, arrays


def rivals_from(
    verdict: Any, content: Content, arrays: Mapping[str, Array], effects: Sequence[Effect]
) -> Rivalry:
    """The rivals that `rivals_content` wrote; `effects` is where theirs are looked up.

    Raises
    ------
    InputError : an effect is not among them
    KeyError, TypeError, ValueError : the content is not what was written
    """
    noise = dict(content["noise"])
    if noise["smoothing"] is not None:
        noise["smoothing"] = Smoothing(**noise["smoothing"])
    noise["scales"] = tuple(map(float, noise["scales"]))
    noise["others"] = tuple((float(rho), float(share)) for rho, share in noise.get("others", ()))
    known = {e.id: e for e in effects}
    return Rivalry(
        verdict,
        tuple(
            FittedModel(
                tuple(_effect(i, model["learned"], known) for i in model["effects"]),
                tuple(model["names"]),
                np.asarray(arrays[ARRAY.format(k, "mode")], dtype=np.float64),
                np.asarray(arrays[ARRAY.format(k, "covariance")], dtype=np.float64),
                float(model["log_odds"]),
            )
            for k, model in enumerate(content["models"])
        ),
        Noise(**noise),
        float(content["repetition"]),
        float(content["mass"]),
        bool(content["stop"]),
        content["quantity"],
        tuple(PastRelease(**r) for r in content["releases"]),
    )


def _knots(effect: Effect) -> dict[str, float]:
    knots = knots_of(effect)
    return {"low": knots.low, "spacing": knots.spacing, "count": knots.count, "reach": knots.reach}


def _effect(effect_id: str, learned: Sequence[Content], known: Mapping[str, Effect]) -> Effect:
    """An effect by its id; a learned force, whose priors no longer matter, from its knots."""
    if effect_id == LEARNED:
        (knots,) = learned
        count, reach = int(knots["count"]), float(knots["reach"])
        high = float(knots["low"]) + float(knots["spacing"]) * (count - 3)
        if reach < 0.0:
            return learned_contact(high, 1.0, 1.0, count)
        if reach > 0.0:
            return learned_drift(high, reach, 1.0, 1.0, count)
        return learned_force(float(knots["low"]), high, 1.0, 1.0, count)
    if effect_id not in known:
        found = f"the effect {effect_id}, which is not of the catalogue"
        raise InputError("next", found, "its file: --effects FILE.py, as for the diagnosis")
    return known[effect_id]
