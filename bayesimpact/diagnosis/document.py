"""diagnosis.json: the diagnosis as scripts read it (schema bayesimpact/diagnosis/1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.certificate import Certificate
from bayesimpact.diagnosis.limits import PRACTICAL, Limit
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.naming import DECISIVE
from bayesimpact.diagnosis.refit import Candidate
from bayesimpact.diagnosis.size import size_in_words
from bayesimpact.diagnosis.smoothing import filter_parameters, filter_words
from bayesimpact.diagnosis.whiteness import whiteness_p
from bayesimpact.diagnosis.words import parameter_shifts, statement, summary
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.parameters import bare_name, is_added

Array = NDArray[np.float64]
NORMAL_90 = 1.6448536269514722


def document(
    diagnosis: Diagnosis,
    *,
    seed: int,
    seconds: float,
    versions: Mapping[str, str],
    draws_before: Array | None = None,
    draws_after: Array | None = None,
    certified: Certificate | None = None,
) -> dict[str, Any]:
    """The content of diagnosis.json.

    Parameters
    ----------
    draws_before, draws_after : posterior draws (S, d) of both models; None takes the normal
        approximation
    certified : how often the loop errs on campaigns of this design, where that was asked for
    """
    d = diagnosis
    noise = d.identification.noise
    statements = tuple(_statement(d, e) for e in d.effects)
    shifts = parameter_shifts(d.before, d.after) if d.verdict != "adequate" else {}
    alternatives = tuple(" + ".join(c.ids) or "nothing at all" for c in d.alternatives)
    return {
        "schema": "bayesimpact/diagnosis/1",
        "verdict": d.verdict,
        "summary": summary(
            d.verdict,
            d.effects,
            statements,
            d.location,
            alternatives,
            shifts,
            _detectable(d),
            _remains(d),
            angle=d.before.target.oscillator.campaign.recordings[0].quantity == "angle",
            drifts=d.naming.unknown.reach > 0,
        ),
        "location": _location(d),
        "effects": [
            _effect(d, e, text, draws_after) for e, text in zip(d.effects, statements, strict=True)
        ],
        "alternatives": [_alternative(d, c) for c in _others(d)],
        "fit": _fit(d),
        "parameters": {
            "before": _parameters(d.before, draws_before),
            "after": _parameters(d.after, draws_after, d),
        },
        "limits": [
            {
                "id": x.effect_id,
                "parameter": x.parameter,
                "unit": x.unit,
                "upper95": x.upper95,
                "detection_limit": x.detection,
                "practical_size": _practical(d, x),
                "power_at_practical_size": x.power,
                "answer": x.answer,
                "hidden_bias": {"parameter": x.biased, "sd": x.bias, "k2_sd": x.k2_bias},
            }
            for x in d.limits
        ],
        "evidence": _evidence(d),
        "certificate": None if certified is None else asdict(certified),
        "noise": {
            "sigma_m": noise.level,
            "correlation": "white" if noise.correlation == 0 else "ar1",
            "coefficient": noise.correlation,
            "source": noise.source,
        },
        "seed": seed,
        "seconds": seconds,
        "versions": dict(versions),
        "data_sha256": d.before.target.oscillator.campaign.sha256,
    }


def _evidence(d: Diagnosis) -> dict[str, Any]:
    base, chosen = d.naming.base, d.naming.chosen
    return {
        "p_catalogue_before": base.scan.p_value,
        "p_unknown_force_before": base.force.p_value,
        "p_unknown_drift_before": base.drift.p_value,
        "p_catalogue_after": chosen.scan.p_value,
        "p_unknown_force_after": chosen.force.p_value,
        "p_unknown_drift_after": chosen.drift.p_value,
        "log_odds": d.naming.log_odds(chosen.candidate),
        "free_force_log_odds": d.naming.force_log_odds,
        "decisive": DECISIVE,
        "models": [
            {"effects": list(c.ids), "log_odds": d.naming.log_odds(c)} for c in d.naming.tried[:20]
        ],
        "scores": [
            {"id": s.effect.id, "z": s.z, "p": s.p_value, "kept": s.kept} for s in base.scan.best()
        ],
    }


def _practical(d: Diagnosis, limit: Limit) -> float:
    """Size of an effect that would matter in practice, in the limit's unit."""
    scores = d.naming.chosen.scan.scores
    effect = next(s.effect for s in scores if s.effect.id == limit.effect_id)
    return PRACTICAL * effect.parameter(limit.parameter).scale(d.scales)


def _detectable(d: Diagnosis) -> str:
    budget = [(x.k2_bias, x.effect_id) for x in d.limits if x.answer != "cannot tell"]
    if not budget:
        return ""
    worst = max(budget)
    return (
        f"What could still hide below its limit moves k2 by at most {worst[0]:.1f} of its standard "
        f"deviations ({worst[1]})."
    )


def _remains(d: Diagnosis) -> str:
    if not d.remains:
        return ""
    ratio = d.after.reduced_chi2**0.5
    return (
        f" Something smaller remains: the residual is still {ratio:.1f} times the noise and not "
        f"white, so the intervals are widened."
    )


def _statement(d: Diagnosis, effect: Effect) -> str:
    if d.filtered is not None and effect.id == "smoothing":
        return effect.statement.format(size=filter_words(d.filtered))
    size, share = size_in_words(effect, d.before, d.after, d.scales)
    alone = len(d.effects) == 1  # of several effects nobody can say which one moved a parameter
    return statement(effect, size, share, parameter_shifts(d.before, d.after) if alone else {})


def _location(d: Diagnosis) -> dict[str, Any] | None:
    if d.location is None:
        return None
    x = d.location
    return {
        "regime": x.regime,
        "share": x.share,
        "displacement_m": list(x.displacement),
        "velocity_m_s": list(x.velocity),
        "time_s": list(x.time),
        "recordings": list(x.recordings),
        "cases": list(x.cases),
        "force_rms_n": x.force_rms,
        "contact_share": x.contact_share,
        "views_agree": x.agrees,
    }


def _effect(d: Diagnosis, effect: Effect, text: str, draws: Array | None) -> dict[str, Any]:
    if d.filtered is not None and effect.id == "smoothing":
        return {
            "id": effect.id,
            "title": effect.title,
            "family": effect.family,
            "statement": text,
            "probability": 1.0,
            "delta_log_evidence": d.filtered.log_ratio,
            "parameters": dict(filter_parameters(d.filtered)),
        }
    chosen = d.naming.chosen.candidate
    without = set(chosen.ids) - {effect.id}
    smaller = next((c for c in d.naming.tried if set(c.ids) == without), d.naming.base.candidate)
    values = _parameters(d.after, draws)
    own = {n: v for n, v in values.items() if n.startswith(effect.id + ".")}
    return {
        "id": effect.id,
        "title": effect.title,
        "family": effect.family,
        "statement": text,
        "probability": d.naming.probability(effect.id),
        "delta_log_evidence": chosen.log_evidence - smaller.log_evidence,
        "parameters": own,
    }


def _others(d: Diagnosis) -> tuple[Candidate, ...]:
    if d.verdict == "adequate":
        return ()
    if d.alternatives:
        return d.alternatives
    chosen = set(d.naming.chosen.candidate.ids)
    lacking = [c for c in d.naming.tried if c.ids and not chosen <= set(c.ids)]
    return tuple(lacking[:3])


def _alternative(d: Diagnosis, candidate: Candidate) -> dict[str, Any]:
    gain = candidate.log_evidence - d.naming.base.candidate.log_evidence
    odds = d.naming.log_odds(candidate) - d.naming.log_odds(d.naming.chosen.candidate)
    return {
        "id": " + ".join(candidate.ids) or "none",
        "probability": float(np.exp(min(odds, 0.0)) / (1 + np.exp(min(odds, 0.0)))),
        "delta_log_evidence": gain,
    }


def _fit(d: Diagnosis) -> dict[str, Any]:
    def side(fit: Fit, score: float) -> dict[str, float]:
        return {
            "rms_m": fit.rms,
            "reduced_chi2": fit.reduced_chi2,
            "whiteness_p": whiteness_p(fit),
            "held_out_log_score": score,
        }

    held = d.held_out
    before = float(held.before.sum()) if held else float("nan")
    after = float(held.after.sum()) if held else before
    result: dict[str, Any] = {"before": side(d.before, before), "after": side(d.after, after)}
    result["held_out_gain"] = {
        "value": held.gain if held else 0.0,
        "se": held.standard_error if held else 0.0,
        "wins": held.wins if held else 0,
        "of": len(held.labels) if held else 0,
        "improved": held.improved if held else False,
    }
    if d.held_out_cases is not None:
        cases = d.held_out_cases
        result["held_out_obstacles_gain"] = {"value": cases.gain, "se": cases.standard_error}
    return result


def _parameters(
    fit: Fit, draws: Array | None, diagnosis: Diagnosis | None = None
) -> dict[str, dict[str, Any]]:
    result: dict[str, dict[str, Any]] = {}
    for i, parameter in enumerate(fit.target.oscillator.layout.parameters):
        middle, spread = float(fit.mode[i]), NORMAL_90 * float(fit.sd[i])
        entry: dict[str, Any] = {
            "unit": parameter.unit,
            "median": middle,
            "ci90": [max(middle - spread, parameter.lower), min(middle + spread, parameter.upper)],
        }
        if draws is not None:
            low, median, high = np.percentile(draws[:, i], [5, 50, 95])
            entry.update(median=float(median), ci90=[float(low), float(high)])
        if diagnosis is not None and parameter.name in diagnosis.honest.names:
            low, high = diagnosis.honest.interval(parameter.name)
            honest = [max(low, parameter.lower), min(high, parameter.upper)]
            entry["ci90_honest"] = honest
            if diagnosis.remains:  # the narrow one would claim what the residual denies
                entry["ci90_if_white"] = entry["ci90"]
                entry["ci90"] = honest
        result[parameter.name] = entry
    _add_means(fit, result)
    return result


def _add_means(fit: Fit, result: dict[str, dict[str, Any]]) -> None:
    """Report a base parameter that an effect split per obstacle or recording as their mean."""
    names = fit.target.oscillator.layout.names
    for base in ("c2", "g"):
        members = [i for i, n in enumerate(names) if is_added(n) and bare_name(n) == base]
        if base not in result and members:
            weights = np.zeros(fit.mode.size)
            weights[members] = 1 / len(members)
            middle = float(weights @ fit.mode)
            sd = float(np.sqrt(weights @ fit.covariance @ weights))
            unit = fit.target.oscillator.layout.parameters[members[0]].unit
            result[base] = {
                "unit": unit,
                "median": middle,
                "ci90": [middle - NORMAL_90 * sd, middle + NORMAL_90 * sd],
            }
