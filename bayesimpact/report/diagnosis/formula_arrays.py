"""The likeliest formula beside the learned force that it was found from, as arrays."""

from __future__ import annotations

import numpy as np

from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.residual_force.learned import LEARNED, knots_of
from bayesimpact.diagnosis.selection.unknown import coefficient_names
from bayesimpact.report.diagnosis.force_arrays import POINTS, Rest
from bayesimpact.report.results import Array


def formula_arrays(d: Diagnosis) -> dict[str, Array]:
    """Arrays by name, (POINTS,); {} where no force of the displacement was learned.

    reference_y : displacement, m
    reference_a, ... : parts of the learned force, their standard deviations and covariance
    formula_a, formula_b : the same of the formula, as a learned force would show it: what base
        parameters imitate is taken out of both, and |v| v shows as the b(y) v that fits it best
    """
    if d.formulas is None:
        return {}
    fit = d.formulas.reference
    learned = [e for e in fit.density.oscillator.effects if e.id == LEARNED]
    if not learned or (knots := knots_of(learned[0])).reach != 0.0:
        return {}
    y = np.linspace(knots.low, knots.low + knots.spacing * (knots.count - 3), POINTS)
    rest = Rest(knots, fit, y)
    at = [fit.names.index(n) for n in coefficient_names(knots.count)]
    parts = rest.parts("reference", fit.mode[at], fit.covariance[np.ix_(at, at)])
    seen = {f"formula_{part}": rest.maps[part] @ d.formulas.seen_as for part in "ab"}
    return {"reference_y": y, **parts, **seen}
