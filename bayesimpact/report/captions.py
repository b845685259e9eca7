"""Captions of the figures, by the beginning of their names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesimpact.report.diagnosis.effect_forces import effect_forces, shown_cycle, without_force
from bayesimpact.report.diagnosis.force_arrays import QUIET_WIDTH
from bayesimpact.report.diagnosis.force_in_time import is_rough
from bayesimpact.report.diagnosis.words import listed
from bayesimpact.report.figures.corner import MOST as MOST_CORNER
from bayesimpact.report.figures.traces import MOST as MOST_TRACES
from bayesimpact.report.results import Results

DIAGNOSIS = {
    "story": (
        "The cycle in which what was added explains most. Above: the recording and both models. "
        "Middle: the same less the base model: were it right, the points would scatter about the "
        "orange line; the closer they follow the blue one, the more of it was found."
    ),
    "force": (
        "The force that the base model leaves unexplained, on the left-hand side of the equation "
        "of motion (positive resists a motion to positive values). Left: its posterior mean "
        "wherever the mass has been; black lines enclose what exceeds its own 90 % band. Right: "
        "the same split into a conservative part and a dissipative part, with 90 % bands. What "
        "changes of the base parameters could imitate is taken out."
    ),
    "formula": (
        "The likeliest formula against the force that was learned, as a(y) + b(y) v can show it: a "
        "law of another power of the speed appears as the b(y) that fits it best. What changes of "
        "the base parameters could imitate is taken out of both. Grey area: contact."
    ),
    "likelihood": (
        "Where the extended model explains more: gain in log likelihood over the base model. A "
        "gain of 1 nat makes a stretch e times likelier; it explains less where the gain is "
        "negative, which is chance where it is small."
    ),
    "ranking": (
        "Models that were fitted, by their log odds (evidence and the price of each added effect) "
        "behind the best one; linear up to 10 nats, logarithmic beyond. A name needs all rivals to "
        "lie beyond the dashed line. Right: probability among the models tried."
    ),
    "limits": (
        "What the recordings rule out. Dots: 95 % upper limit of each effect's size; bars: a size "
        "that would stand out by five standard errors. Both over the size that would matter in "
        "practice, which is a tenth of the effect's prior scale (dashed): left of it an effect is "
        "absent or negligible; of those with orange dots the recordings cannot tell."
    ),
    "improvement": (
        "Before and after. Left: power of the whitened residual over that of the noise, estimated "
        "without any model, all recordings together; the grey band holds nine tenths of white "
        "noise. Middle: reduced χ² of each recording, the grey stripe likewise."
    ),
    "bands": (
        "Backbone and damping before and after: recorded minus median of simulated cycles, in "
        "half-widths of the 90 % band (grey). Left: frequency against amplitude. Right: damping "
        "ratio against time."
    ),
    "designs": (
        "Recordings that could be made next. Left, where rivals are left: the ln odds that each is "
        "expected to give the right one over another, what refitted parameters can imitate taken "
        "out; the dashed line is what a name needs. Right: by how much it narrows the stiffness. "
        "Black: the best repeat of a recording; grey: a campaign of its own."
    ),
    "shifts": (
        "How far the added physics moves the parameters, from what the base model has: medians and "
        "90 % intervals."
    ),
}
"""Captions of a diagnosis' figures."""


def caption(name: str, results: Results) -> str:
    """What a figure shows."""
    stem = name.split("_")[0]
    if stem in DIAGNOSIS:
        return DIAGNOSIS[stem] + _more(stem, results)
    if stem == "fit":
        return _fit(results, name.removeprefix("fit_").replace("_", " "))
    writer = {
        "corner": _corner,
        "backbone": _backbone,
        "damping": _damping,
        "search": _search,
        "traces": _traces,
    }.get(stem)
    return writer(results) if writer else name.replace("_", " ")


def _more(stem: str, results: Results) -> str:
    """What holds for some diagnoses only."""
    arrays, diagnosis = results.diagnosis_arrays, results.diagnosis or {}
    if stem == "likelihood" and "impact_gain" in arrays:
        return " Impacts are shown as far as half of the recordings have them."
    if stem == "story":
        contact = " Grey area: contact." if results.stop else ""
        return contact + _below(results)
    if stem == "ranking":
        return _chosen(diagnosis)
    if stem == "improvement" and "held_out_recordings" in arrays:
        words = " Right: gain in the log score with which each recording is predicted from the"
        return f"{words} others."
    if stem != "force":
        return ""
    words = " The dashed line is the stop." if "gap" in arrays else ""
    regime = (diagnosis.get("location") or {}).get("regime")
    if regime in ("contact", "entry", "exit") and diagnosis.get("effects"):
        words += (
            " What was named acts in contact, and need not be darkest there: most of what it does "
            "looks like a change of k2, c2 and g, which is why these are wrong without it."
        )
    if diagnosis.get("verdict") == "adequate":
        words += (
            f" Nothing is missing here: drawn is what the recordings allow of a force of about "
            f"{100 * QUIET_WIDTH:.0f} % of the peak elastic force (its prior)."
        )
    elif is_rough(results):
        words += (
            " The base model misses by far more than the noise, and the force follows from a "
            "linearised problem: here it is a rough guide only."
        )
    return words


def _below(results: Results) -> str:
    """What the lowest panel of the story's picture is."""
    cycle = shown_cycle(results)
    if cycle is not None and effect_forces(results, cycle.recording, slice(0, 1)):
        words = " Below: the forces of what was named along this motion, at the values found."
        others = without_force(results)
        words += f" Not drawn, being no force along it: {listed(others)}." if others else ""
        if results.remains:
            words += " What remains unexplained beside them is told above, and mapped below."
        return words
    if "force_y" not in results.diagnosis_arrays:
        return ""
    return (
        " Below: the force that the base model leaves unexplained, as far as it depends on "
        "displacement and velocity and no change of the base parameters imitates it, with its "
        "90 % band."
    )


def _chosen(diagnosis: Mapping[str, Any]) -> str:
    """What is drawn in blue among the models."""
    if diagnosis.get("verdict") != "unknown":
        return " Blue: the model that was chosen." if diagnosis.get("effects") else ""
    if (diagnosis.get("evidence") or {}).get("free_force_log_odds") is None:
        return " None was chosen."
    return (
        " Blue: one free force in the place of all effects, which was chosen, with the odds that "
        "the linearised problem gives it."
    )


def _fit(results: Results, which: str) -> str:
    head = "Recordings" if which == "fit" else f"{which.capitalize()}: recordings"
    stop = " The dashed line is the stop." if results.stop else ""
    close = "the deepest impact" if results.stop else "the first cycles after the release"
    return (
        f"{head} (light) and model at the mode (line), residuals below, all on one scale; on the "
        f"right {close}.{stop} Orange lines: twice the standard deviation of the noise"
        f"{' as estimated without the model' if results.noise.is_independent else ''}."
    )


def _corner(results: Results) -> str:
    if results.draws is None:
        return _gaussian()
    count = len(results.draws.names)
    some = f" The first {MOST_CORNER} of {count} parameters." if count > MOST_CORNER else ""
    before = (
        " Orange: the posterior of the model without the added effects." if results.before else ""
    )
    apart = (
        " As if nothing were left unexplained: the tables' intervals carry that, and are wider."
        if results.remains
        else ""
    )
    return (
        "Posterior of the parameters of interest: marginals on the diagonal with median ± half "
        "of the 90 % interval, pairs below with the contours of one and two standard deviations "
        f"(39 % and 86 %). Δ: from the median that the title states.{some}{before}{apart}"
    )


def _gaussian() -> str:
    return (
        "Gaussian approximations at the modes (nothing was sampled): marginals on the diagonal "
        "with median ± half of the 90 % interval, pairs below with the contours of one and two "
        "standard deviations. Δ: from the median that the title states. Orange: the base model; "
        "blue: with what was added."
    )


def _backbone(results: Results) -> str:
    return (
        "Backbone curves. Above: amplitude against instantaneous frequency, all releases of a case "
        "together; dots recorded, bands simulated (often narrower than a dot). Below: how far "
        "recorded frequencies lie from the median of simulated ones, in half-widths of the band, "
        "which the grey stripe shows."
    )


def _damping(results: Results) -> str:
    return (
        "Damping ratio (Eq. 5: averaged from the first cycle to the time shown). Above: dots "
        "recorded, bands simulated, one curve per release. Below: how far recorded ratios lie from "
        "the median of simulated ones, in half-widths of the band."
    )


def _search(results: Results) -> str:
    return (
        "The global search. Left: objective of the best and of the median individual above the "
        "final best. Right: standard deviation of the population, and the temperature of the "
        "Metropolis criterion, which ends at 1 nat; after that only improvements are accepted."
    )


def _traces(results: Results) -> str:
    assert results.sampler is not None
    count = len(results.sampler.trace_names)
    some = f" The first {MOST_TRACES} of {count} parameters." if count > MOST_TRACES else ""
    return f"Paths of a few walkers of every ensemble through the kept steps.{some}"
