"""What can be ruled out: how large an effect that was not found could be, and what it would do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import special, stats

from bayesimpact.diagnosis.score_test.scan import Scan
from bayesimpact.diagnosis.score_test.scores import Score
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Scales
from bayesimpact.model.parameters import unit_for

PRACTICAL = 0.1  # of the prior scale: a size that would matter in practice
DETECTED = 3.5  # standard errors at which the corrected test answers
Answer = Literal["present", "absent", "negligible", "cannot tell"]


@dataclass(frozen=True, eq=False)
class Limit:
    """What the recordings say of an effect that was not found.

    Attributes
    ----------
    effect_id, parameter, unit : which size
    upper95 : with 95 % probability the size (its magnitude where both signs are admissible) is
        below
    detection : size that would stand out by five standard errors
    power : probability that the practical size would have been detected
    answer : in a word
    bias : largest shift that a size at the limit would put on a parameter, in its standard
        deviations
    biased : which parameter that is
    k2_bias : the same for the obstacles' stiffnesses, 0 without a stop
    """

    effect_id: str
    parameter: str
    unit: str
    upper95: float
    detection: float
    power: float
    answer: Answer
    bias: float
    biased: str
    k2_bias: float


def limits(fit: Fit, scan: Scan, scales: Scales) -> tuple[Limit, ...]:
    """Limits of all effects in a scan."""
    scored = {id(s) for s in scan.scores[: len(scan.groups)]}
    chosen = [s for s in scan.best() if id(s) in scored and "." in s.names[0]]
    return tuple(_limit(fit, score, scan, scales) for score in chosen)


def _limit(fit: Fit, score: Score, scan: Scan, scales: Scales) -> Limit:
    direction = next(d for d, s in zip(scan.found, scan.scores, strict=True) if s is score)
    name = score.names[0].split(".", 1)[1].split("[")[0]
    parameter = score.effect.parameter(name)
    alike = [n.split(".", 1)[1].split("[")[0] == name for n in score.names]
    size, sd = np.atleast_1d(score.size)[alike], np.atleast_1d(score.size_sd)[alike]
    upper = float(
        np.max([upper_limit(m, s, direction.one_sided) for m, s in zip(size, sd, strict=True)])
    )
    practical = PRACTICAL * parameter.scale(scales)
    power = float(stats.norm.sf(DETECTED - practical / sd[0]))
    column = scan.groups[scan.scores.index(score)][0]
    shift = np.abs(scan.projection.absorbed[:, column]) * upper / fit.sd
    shared = fit.density.oscillator.layout.roles("physical")
    worst = int(shared[np.argmax(shift[shared])])
    k2 = [i for i in shared if fit.names[i].startswith("k2")]
    return Limit(
        score.effect.id,
        name,
        unit_for(fit.density.oscillator.campaign, score.effect, parameter.unit),
        upper,
        score.limit,
        power,
        _answer(score, upper, practical, power),
        float(shift[worst]),
        fit.names[worst],
        float(shift[k2].max()) if k2 else 0.0,
    )


def upper_limit(mean: float, sd: float, one_sided: bool, probability: float = 0.95) -> float:
    """Quantile of the size's magnitude, normal about `mean`, cut at zero when one-sided."""
    z = mean / sd
    if one_sided:  # in logs: far below zero nothing else is left of the tail
        return float(mean - sd * special.ndtri_exp(np.log1p(-probability) + special.log_ndtr(z)))
    if abs(z) > 8:  # the other sign is out of reach
        return float(abs(mean) + sd * stats.norm.ppf(probability))
    return float(sd * stats.foldnorm.ppf(probability, abs(z)))


def _answer(score: Score, upper: float, practical: float, power: float) -> Answer:
    if abs(score.z) > DETECTED:
        return "present" if abs(float(score.size[0])) >= practical else "negligible"
    return "absent" if upper < practical and power >= 0.8 else "cannot tell"
