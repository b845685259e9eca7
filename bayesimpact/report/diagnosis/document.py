"""diagnosis.json: the diagnosis as scripts read it (schema bayesimpact/diagnosis/2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.diagnosis.faults.compare import base_failed
from bayesimpact.diagnosis.faults.recording_faults import as_effects, fault_entries, in_words, place
from bayesimpact.diagnosis.intervals import Intervals, intervals
from bayesimpact.diagnosis.limits import PRACTICAL, Limit
from bayesimpact.diagnosis.location import Location
from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.measurement.smoothing import filter_parameters, filter_words
from bayesimpact.diagnosis.measurement.whiteness import whiteness_p
from bayesimpact.diagnosis.parametric_bootstrap import ParametricBootstrap
from bayesimpact.diagnosis.refits.refit import Candidate
from bayesimpact.diagnosis.refits.size import size, size_in_words, yardstick
from bayesimpact.diagnosis.remainder import Remainder, remainder
from bayesimpact.diagnosis.residual_force.learned import LEARNED
from bayesimpact.diagnosis.thresholds import DECISIVE
from bayesimpact.formula.law import is_formula_id
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.parameters import bare_name, is_added, unit_for
from bayesimpact.report.diagnosis.formula_entries import formula_entries
from bayesimpact.report.diagnosis.summary import Findings, summary
from bayesimpact.report.diagnosis.words import (
    failure,
    left_open,
    nearest,
    noise_words,
    parameter_shifts,
    remaining,
    scatter_words,
    statement,
)

Array = NDArray[np.float64]
NORMAL_90 = 1.6448536269514722
UNFINISHED = " The search ended by its limit: not everything that may be missing was tried."
MOST_OTHERS = 5  # models of the catalogue that are listed beside the answer


def document(
    diagnosis: Diagnosis,
    *,
    seed: int,
    seconds: float,
    versions: Mapping[str, str],
    draws_before: Array | None = None,
    draws_after: Array | None = None,
    certified: ParametricBootstrap | None = None,
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
    campaign = d.before.density.oscillator.campaign
    angle, reading = campaign.angular, campaign.recordings[0]
    left = remainder(d.selection, d.after, d.remains, d.formulas)
    before = _parameters(d.before, intervals(d.before), draws_before)
    after = _parameters(d.after, d.intervals, draws_after if d.remains is None else None)
    told = {} if d.remains is None else after
    statements = tuple(_statement(d, e) + left_open(e, told) for e in d.effects)
    faulty = d.corrected.faults if d.corrected else ()
    alternatives = tuple(" + ".join(c.ids) or "nothing at all" for c in d.alternatives)
    return {
        "schema": "bayesimpact/diagnosis/2",
        "verdict": d.verdict,
        "summary": failure(d.identification.fit, explained=_explained(d))
        + summary(
            Findings(
                d.verdict,
                d.effects,
                statements,
                d.location,
                alternatives,
                parameter_shifts(before, after) if d.verdict != "adequate" else {},
                _detectable(d),
                remaining(left, reading.unit),
                faults=in_words(d.corrected) if d.corrected else "",
                angle=angle,
                drifts=d.selection.unknown.reach > 0,
                probe=_is_of_the_probe(d),
                more=len(d.after.density.oscillator.effects) > len(d.effects),
                unproved=_unproved(d),
                either=d.either,
                families=d.families,
                finished=d.selection.finished,
                band_limited=d.selection.band_limited,
                scatter="" if d.remains else scatter_words(d.after),
            )
        )
        + noise_words(noise)
        + _nearest(d)
        + UNFINISHED * (not d.selection.finished),
        "location": _location(d.location) or (place(faulty) if faulty else None),
        "faults": fault_entries(d.corrected) if d.corrected else [],
        "remainder": _remainder(left),
        "formulas": formula_entries(d.formulas, d.scales, angle=angle),
        "effects": (as_effects(d.corrected) if d.corrected else [])
        + [_effect(d, e, text, after) for e, text in zip(d.effects, statements, strict=True)],
        "either": [[e.id for e in group] for group in d.groups],
        "alternatives": [_alternative(d, c) for c in _others(d)],
        "fit": _fit(d),
        "parameters": {"before": before, "after": after},
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
        "parametric_bootstrap": None if certified is None else asdict(certified),
        "reading": {"quantity": reading.quantity, "unit": reading.unit},
        "noise": {
            "sigma_m": noise.level,
            "correlation": "ar1" if noise.is_coloured else "white",
            "coefficient": noise.correlation,
            "parts": [{"coefficient": rho, "share": share} for rho, share in noise.parts],
            "input_percent": None if noise.forces is None else 100 * noise.forces.share,
            "source": noise.source,
        },
        "seed": seed,
        "seconds": seconds,
        "versions": dict(versions),
        "data_sha256": d.before.density.oscillator.campaign.sha256,
    }


def _explained(d: Diagnosis) -> bool:
    """Whether what is named takes most of the signal, if the base fit left it."""
    return d.verdict in ("adequate", "named") or bool(d.effects and not base_failed(d.after))


def _evidence(d: Diagnosis) -> dict[str, Any]:
    base, chosen = d.selection.base, d.selection.chosen
    return {
        "p_catalogue_before": base.scan.p_value,
        "p_unknown_force_before": base.force.p_value,
        "p_unknown_drift_before": base.drift.p_value,
        "p_catalogue_after": chosen.scan.p_value,
        "p_unknown_force_after": chosen.force.p_value,
        "p_unknown_drift_after": chosen.drift.p_value,
        "log_odds": d.selection.log_odds(chosen.candidate),
        "free_force_log_odds": d.selection.force_log_odds,
        "decisive": DECISIVE,
        "models": [
            {"effects": list(c.ids), "log_odds": d.selection.log_odds(c)}
            for c in d.selection.tried[:20]
        ],
        "scores": [
            {"id": s.effect.id, "z": s.z, "p": s.p_value, "kept": s.kept} for s in base.scan.best()
        ],
    }


def _practical(d: Diagnosis, limit: Limit) -> float:
    """Size of an effect that would matter in practice, in the limit's unit."""
    scores = d.selection.chosen.scan.scores
    effect = next(s.effect for s in scores if s.effect.id == limit.effect_id)
    return PRACTICAL * effect.parameter(limit.parameter).scale(d.scales)


def _detectable(d: Diagnosis) -> str:
    """By how much what was not found may move k2; without a stop the parameter that moves most."""
    stop = d.before.density.oscillator.campaign.stop
    told = [x for x in d.limits if x.answer != "cannot tell"]
    moved = [(x.k2_bias if stop else x.bias, "k2" if stop else x.biased, x.effect_id) for x in told]
    if not moved:
        return ""
    sd, name, effect_id = max(moved)
    at_most = f"{sd:.1f} of its standard deviations"
    share = sd * _relative_sd(d.before, name)
    if np.isfinite(share):
        at_most = f"{100 * share:.3g} %, {at_most}"
    return f"What could still hide below its limit moves {name} by at most {at_most} ({effect_id})."


def _relative_sd(fit: Fit, name: str) -> float:
    """The largest standard deviation over its value, of a parameter or its parts per obstacle."""
    own = [i for i, known in enumerate(fit.names) if name in (known, bare_name(known))]
    with np.errstate(divide="ignore"):
        return float(np.max(fit.sd[own] / np.abs(fit.mode[own]), initial=-np.inf))


def _unproved(d: Diagnosis) -> tuple[str, ...]:
    """Titles of effects that the fitted model holds beside those that are named, or of which one of
    a group is.
    """
    told = {LEARNED, *(e.id for group in (d.effects, *d.groups) for e in group)}
    effects = d.after.density.oscillator.effects
    return tuple(e.title for e in effects if e.id not in told and not is_formula_id(e.id))


def _statement(d: Diagnosis, effect: Effect) -> str:
    if d.filtered is not None and effect.id == "smoothing":
        return effect.statement.format(size=filter_words(d.filtered))
    size, share = size_in_words(effect, d.before, d.after, d.scales)
    return statement(effect, size, share)


def _location(x: Location | None) -> dict[str, Any] | None:
    if x is None:
        return None
    return {
        "regime": x.regime,
        "share": x.share,
        "displacement_m": list(x.displacement),
        "velocity_m_s": list(x.velocity),
        "time_s": list(x.time),
        "recordings": list(x.recordings),
        "cases": list(x.cases),
        "force_rms_n": x.force_rms,
        "beyond_base": x.beyond_base,
        "contact_share": x.contact_share,
        "views_agree": x.agrees,
    }


def _remainder(left: Remainder | None) -> dict[str, Any] | None:
    if left is None:
        return None
    return {
        "rms_m": left.rms,
        "share_of_signal_percent": 100 * left.share,
        "over_noise": left.over_noise,
        "regime": left.regime,
        "displacement_m": list(left.displacement),
        "recordings": list(left.recordings),
        "guess": left.guess,
    }


def _effect(
    d: Diagnosis, effect: Effect, text: str, values: Mapping[str, dict[str, Any]]
) -> dict[str, Any]:
    common = {
        "id": effect.id,
        "title": effect.title,
        "family": effect.family,
        "statement": text,
    }
    if d.filtered is not None and effect.id == "smoothing":
        return common | {
            "probability": 1.0,
            "delta_log_evidence": d.filtered.log_ratio,
            "parameters": dict(filter_parameters(d.filtered)),
            "location": _location(d.location),
            "size": {
                "value": float(d.filtered.smoothing.window or 0),
                "unit": "samples",
                "percent": None,
                "of": "",
            },
        }
    model = {e.id for e in d.after.density.oscillator.effects}
    kept = {frozenset(c.ids): c for c in d.selection.tried}
    whole = kept.get(frozenset(model), d.selection.chosen.candidate)
    smaller = kept.get(frozenset(model - {effect.id}), d.selection.base.candidate)
    value, unit, share = size(effect, d.before, d.after, d.scales)
    own = [e.id for e in d.effects if e.id != "smoothing" or d.filtered is None]
    return common | {
        "probability": d.selection.probability(effect.id),
        "delta_log_evidence": whole.log_evidence - smaller.log_evidence,
        "parameters": {n: v for n, v in values.items() if n.startswith(effect.id + ".")},
        "location": _location(d.locations[own.index(effect.id)]),
        "size": {
            "value": value,
            "unit": unit_for(d.after.density.oscillator.campaign, effect, unit),
            "percent": 100 * share,
            "of": yardstick(effect),
        },
    }


def _others(d: Diagnosis) -> tuple[Candidate, ...]:
    """The best models of the catalogue beside the one that the verdict stands for."""
    if d.verdict == "adequate":
        return ()
    named = {e.id for e in d.effects}
    catalogue = (c for c in d.selection.tried if c.ids and not any(map(is_formula_id, c.ids)))
    rest = [c for c in catalogue if set(c.ids) != named]
    if d.verdict in ("named", "ambiguous"):
        rest = [c for c in rest if not named <= set(c.ids)]
    others = [*d.alternatives, *(c for c in rest if c not in d.alternatives)]
    return tuple(others[: max(len(d.alternatives), MOST_OTHERS)])


def _nearest(d: Diagnosis) -> str:
    """What comes nearest where no effect is named."""
    if d.verdict not in ("unknown", "partly") or d.effects:
        return ""
    return nearest([(a["id"], a["probability"]) for a in map(partial(_alternative, d), _others(d))])


def _is_of_the_probe(d: Diagnosis) -> bool:
    """Whether there is evidence for the likeliest of the other models, and all of it acts in the
    measuring chain.
    """
    base = d.selection.base.candidate
    likeliest = max(_others(d), key=d.selection.log_odds, default=base)
    better = likeliest.log_evidence > base.log_evidence
    return better and all(e.regime == "measurement" for e in likeliest.effects)


def _alternative(d: Diagnosis, candidate: Candidate) -> dict[str, Any]:
    odds = np.array([d.selection.log_odds(c) for c in d.selection.tried])
    weights = np.exp(odds - odds.max())
    own = np.exp(d.selection.log_odds(candidate) - odds.max())
    return {
        "id": " + ".join(candidate.ids) or "none",
        "probability": float(own / weights.sum()),
        "delta_log_evidence": candidate.log_evidence - d.selection.base.candidate.log_evidence,
    }


def _fit(d: Diagnosis) -> dict[str, Any]:
    def side(fit: Fit, score: float) -> dict[str, float]:
        return {
            "rms_m": fit.rms,
            "reduced_chi2": fit.reduced_chi2,
            "whiteness_p": whiteness_p(fit),
            "held_out_log_score": score,
        }

    held_out = d.held_out
    before = float(held_out.before.sum()) if held_out else float("nan")
    after = float(held_out.after.sum()) if held_out else before
    result: dict[str, Any] = {"before": side(d.before, before), "after": side(d.after, after)}
    result["held_out_gain"] = {
        "value": held_out.gain if held_out else 0.0,
        "se": held_out.standard_error if held_out else 0.0,
        "wins": held_out.wins if held_out else 0,
        "of": len(held_out.labels) if held_out else 0,
        "improved": held_out.improved if held_out else False,
    }
    if d.held_out_cases is not None:
        cases = d.held_out_cases
        result["held_out_obstacles_gain"] = {"value": cases.gain, "se": cases.standard_error}
    return result


def _parameters(fit: Fit, posterior: Intervals, draws: Array | None) -> dict[str, dict[str, Any]]:
    """Median and 90 % interval of every parameter: of the draws, else of the posterior given."""
    result: dict[str, dict[str, Any]] = {}
    ordinary = intervals(fit)
    for i, parameter in enumerate(fit.density.oscillator.layout.parameters):
        known = posterior if parameter.name in posterior.names else ordinary
        if draws is None:
            low, median, high = known.quantiles(parameter.name)
        else:
            low, median, high = map(float, np.percentile(draws[:, i], [5, 50, 95]))
        entry = {"unit": parameter.unit, "median": median, "ci90": [low, high]}
        result[parameter.name] = entry
    known = posterior if set(fit.names) <= set(posterior.names) else ordinary
    result |= _means(fit, known, draws)
    return result


def _means(fit: Fit, posterior: Intervals, draws: Array | None) -> dict[str, dict[str, Any]]:
    """A base parameter that an effect split per obstacle or recording, as the mean of its parts."""
    result, names = {}, fit.names
    for base in ("c2", "g"):
        members = [i for i, n in enumerate(names) if is_added(n) and bare_name(n) == base]
        if base in names or not members:
            continue
        if draws is None:
            at = [posterior.names.index(names[i]) for i in members]
            middle = float(posterior.mean[at].mean())
            half = NORMAL_90 * float(np.sqrt(posterior.covariance[np.ix_(at, at)].mean()))
            low, high = middle - half, middle + half
        else:
            low, middle, high = np.percentile(draws[:, members].mean(axis=1), [5, 50, 95])
        unit = fit.density.oscillator.layout.parameters[members[0]].unit
        entry = {"unit": unit, "median": float(middle), "ci90": [float(low), float(high)]}
        result[base] = entry
    return result
