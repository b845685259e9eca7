"""A diagnosis on one page: verdict, place, physics, size, improvement, corrected stiffness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from bayesimpact.model.units import percent, significant, span_of
from bayesimpact.model.units import quantity as amount
from bayesimpact.report.diagnosis.change_view import NUISANCES, UNTOLD, change_words, estimate
from bayesimpact.report.diagnosis.formula_text import effect_title
from bayesimpact.report.diagnosis.view import (
    gain_words,
    likely_others,
    probability,
    regime_words,
    remainder_rows,
    size_words,
    verdict_words,
)
from bayesimpact.report.diagnosis.words import title_of, titles_of
from bayesimpact.report.names import of_recordings, own_parameters
from bayesimpact.report.results import Results
from bayesimpact.report.tables import own_symbol, symbol

MOST_NAMES = 4
"""Recordings called by name; more are counted."""
ABOVE_NOISE = 1.1
"""Residual of the base model over the noise from which on its decrease tells something: below, the
misfit is less than half of the noise, and a good model takes next to nothing off their sum.
"""


def story_rows(results: Results) -> list[tuple[str, list[str | Markup]]]:
    """Question and answer, an answer being one line or several; [] without a diagnosis."""
    diagnosis = results.diagnosis
    if diagnosis is None:
        return []
    rows = [
        ("verdict", [verdict_words(diagnosis)]),
        ("place", _place(results, diagnosis)),
        ("physics", _physics(diagnosis)),
        ("size", _size(results, diagnosis)),
        ("remains", _remains(results, diagnosis.get("remainder"))),
        ("improvement", _improvement(results, diagnosis)),
        ("could still hide", _hidden(diagnosis)),
        ("parametric bootstrap", _bootstrap(diagnosis.get("parametric_bootstrap"))),
    ]
    return [(question, answer) for question, answer in rows if answer]


def corrected(diagnosis: Mapping[str, Any]) -> list[str]:
    """Parameters whose correction is told first: the stops' stiffnesses, else what moved."""
    parameters = diagnosis.get("parameters") or {}
    both = [n for n in parameters.get("before", {}) if n in parameters.get("after", {})]
    stiffness = [n for n in both if n.partition("[")[0] == "k2"]
    return stiffness or [n for n in both if n.partition("[")[0] not in NUISANCES]


def _place(results: Results, diagnosis: Mapping[str, Any]) -> list[str | Markup]:
    location = diagnosis.get("location")
    if not location:
        return []
    lines: list[str | Markup] = [regime_words(diagnosis)]
    if location["regime"] != "measurement":
        unit = results.length
        lines[0] += (
            f", at {span_of(location['displacement_m'], unit)} and "
            f"{span_of(location['velocity_m_s'], unit + '/s')}"
        )
    lines.append(_shown_in(results, location.get("recordings") or (), location.get("cases") or ()))
    return [line for line in lines if line]


def _shown_in(results: Results, recordings: Sequence[str], cases: Sequence[str]) -> str:
    """Where it shows most."""
    total = len(results.recordings)
    if not recordings:
        return ""
    if len(recordings) == total:
        words = "shows in all recordings" if total > 1 else ""
    elif len(recordings) <= MOST_NAMES:
        words = "shows in " + ", ".join(recordings)
    else:
        words = f"shows in {len(recordings)} of {total} recordings, most in {recordings[0]}"
    if cases and len(cases) < len(results.cases):
        words += f"; case {', '.join(cases)}"
    return words


def _physics(diagnosis: Mapping[str, Any]) -> list[str | Markup]:
    if diagnosis["verdict"] == "unknown":
        return ["a force that no effect of the catalogue explains; it was learned instead"]
    lines: list[str | Markup] = [
        Markup("{}, probability {}").format(_title(effect), probability(effect.get("probability")))
        for effect in diagnosis.get("effects", ())
    ]
    others = likely_others(diagnosis) if diagnosis["verdict"] == "ambiguous" else ()
    return lines + [
        Markup("or {}, probability {}").format(
            titles_of(other["id"]), probability(other.get("probability"))
        )
        for other in others
    ]


def _title(effect: Mapping[str, Any]) -> str:
    return effect_title(effect["id"], effect.get("title", "")) + of_recordings(effect)


def _size(results: Results, diagnosis: Mapping[str, Any]) -> list[str | Markup]:
    lines: list[str | Markup] = []
    for effect in diagnosis.get("effects", ()):
        if size_words(effect.get("size")):
            lines.append(Markup("{}: {}").format(_title(effect), size_words(effect["size"])))
        lines += [
            Markup("{} = {}").format(own_symbol(name), estimate(content))
            for name, content in own_parameters(effect)
        ]
    force = (diagnosis.get("location") or {}).get("force_rms_n")
    if force and not lines:
        unit = "N m" if results.angular else "N"
        lines.append(f"unexplained force there: {amount(force, unit, 2)} rms")
    return lines


def _remains(results: Results, remainder: Mapping[str, Any] | None) -> list[str | Markup]:
    """What no named effect explains, in one sentence."""
    rows = dict(remainder_rows(remainder, results.unit, results.length))
    if not rows:
        return []
    words = f"unexplained: {rows['rms']} rms" if "rms" in rows else "something unexplained"
    sizes = [
        f"{rows[key]} {after}"
        for key, after in (("of the signal", "of the signal"), ("over the noise", "× the noise"))
        if key in rows
    ]
    words += f" ({', '.join(sizes)})" if sizes else ""
    words += f", in {rows['regime']}" if "regime" in rows else ""
    words += f", at {rows['displacement']}" if "displacement" in rows else ""
    return [words, *([f"likely: {rows['likely']}"] if "likely" in rows else [])]


def _improvement(results: Results, diagnosis: Mapping[str, Any]) -> list[str | Markup]:
    if diagnosis["verdict"] == "adequate":
        return []
    fit = diagnosis.get("fit") or {}
    before, after, gain = (fit.get(k) or {} for k in ("before", "after", "held_out_gain"))
    lines: list[str | Markup] = []
    if gain_words(gain) and gain.get("of") != 0:
        better = f", {gain['wins']} of {gain['of']} better" if gain.get("of") else ""
        lines.append(f"recordings held out: log score {gain_words(gain)}{better}")
    lines += _corrections(diagnosis)
    old, new = before.get("rms_m"), after.get("rms_m")
    if old and new is not None and old > ABOVE_NOISE * results.noise.level:
        ends = f"{amount(old, results.unit)} → {amount(new, results.unit)}"
        lines.append(f"residual rms {ends} ({percent(new / old - 1)})")
    return lines


def _corrections(diagnosis: Mapping[str, Any]) -> list[str | Markup]:
    """By how much the stops' stiffnesses (else what moved) change, in one line."""
    both = diagnosis.get("parameters") or {}
    names = corrected(diagnosis)[:MOST_NAMES]
    changes = [change_words(both["before"][name], both["after"][name]) for name in names]
    told = [
        Markup("{} {}").format(symbol(name), words)
        for name, words in zip(names, changes, strict=True)
        if words not in UNTOLD
    ]
    return [Markup(", ").join(told)] if told else []


def _bootstrap(counts: Mapping[str, Any] | None) -> list[str | Markup]:
    """How the loop did on simulated campaigns of the same design."""
    if not counts:
        return []
    lines: list[str | Markup] = [
        f"of {counts['controls']} simulated campaigns with nothing missing, "
        f"{counts['false_alarms']} raised an alarm"
    ]
    if counts["planted"]:
        lines.append(
            f"of {counts['planted']} with what was named here, {counts['named']} were "
            f"named the same, {counts['misnamed']} got another name"
        )
    return lines


def _hidden(diagnosis: Mapping[str, Any]) -> list[str | Markup]:
    """The worst that an effect below its limit could still do, where nothing was found."""
    if diagnosis["verdict"] != "adequate":
        return []
    known = [x for x in diagnosis.get("limits", ()) if x.get("answer") != "cannot tell"]
    biases = [(x["hidden_bias"], x["id"]) for x in known if x.get("hidden_bias")]
    biases = [(bias, name) for bias, name in biases if bias.get("sd") is not None]
    unsure = [x["id"] for x in diagnosis.get("limits", ()) if x.get("answer") == "cannot tell"]
    lines: list[str | Markup] = []
    if biases:
        bias, name = max(biases, key=lambda b: abs(b[0]["sd"]))
        lines.append(
            Markup("{} by at most {} of its standard deviations ({})").format(
                symbol(bias["parameter"]), significant(abs(bias["sd"]), 2), title_of(name)
            )
        )
    if unsure:
        told = ", ".join(title_of(i) for i in unsure)
        lines.append(f"these recordings cannot tell: {told}")
    return lines
