"""Rivals are read back as they were written."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from rivals import base_rivalry

from bayesimpact.data.campaign import Smoothing
from bayesimpact.design.store import rivals_content, rivals_from
from bayesimpact.diagnosis.residual_force.learned import (
    knots_of,
    learned_contact,
    learned_drift,
    learned_force,
)
from bayesimpact.errors import InputError
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects import EFFECTS

LEARNED = (
    learned_force(-7e-3, 4e-3, 1.0, 2.0, 12),
    learned_drift(6.0, 7e-3, 1.0, 2.0),
    learned_contact(3e-3, 1.0, 2.0),
)


@pytest.mark.parametrize("force", LEARNED, ids=lambda e: e.equation)
def test_they_come_back_as_they_were(small: Identification, force: object) -> None:
    rivals = base_rivalry(small)
    friction = next(e for e in EFFECTS if e.id == "coulomb_friction")
    model = replace(rivals.hypotheses[0], effects=(friction, force))  # type: ignore[arg-type]
    others = ((0.0, 0.4), (0.99, 0.1))
    noise = Noise(0.3, Smoothing("savgol", 19, 2), scales=(1.0, 2.0, 3.0), others=others)
    kept = replace(rivals, hypotheses=(model,), noise=noise, verdict="unknown", repetition=2.5)
    content, arrays = rivals_content(kept)
    back = rivals_from("unknown", json.loads(json.dumps(content)), arrays, EFFECTS)
    assert back.noise == noise and back.repetition == 2.5 and back.releases == kept.releases
    (found,) = back.hypotheses
    assert found.effects[0] is friction and found.names == model.names
    assert knots_of(found.effects[1]) == knots_of(model.effects[1])
    assert np.array_equal(found.covariance, model.covariance)


def test_an_effect_of_ones_own_must_be_given(small: Identification) -> None:
    rivals = base_rivalry(small)
    friction = next(e for e in EFFECTS if e.id == "coulomb_friction")
    own = replace(friction, id="own_friction")
    model = replace(rivals.hypotheses[0], effects=(own,))
    content, arrays = rivals_content(replace(rivals, hypotheses=(model,)))
    with pytest.raises(InputError, match=r"own_friction.*--effects"):
        rivals_from("named", content, arrays, EFFECTS)
    back = rivals_from("named", content, arrays, (*EFFECTS, own))
    assert back.hypotheses[0].effects == (own,)
