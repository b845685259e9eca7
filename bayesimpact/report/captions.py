"""Captions of the figures, by the beginning of their names."""

from __future__ import annotations

from bayesimpact.report.figures.corner import MOST as MOST_CORNER
from bayesimpact.report.figures.traces import MOST as MOST_TRACES
from bayesimpact.report.results import Results


def caption(name: str, results: Results) -> str:
    """What a figure shows."""
    stem = name.split("_")[0]
    writer = {
        "fit": _fit,
        "corner": _corner,
        "backbone": _backbone,
        "damping": _damping,
        "search": _search,
        "traces": _traces,
    }.get(stem)
    return writer(results) if writer else name.replace("_", " ")


def _fit(results: Results) -> str:
    stop = " The dashed line is the stop." if results.stop else ""
    return (
        "Recordings (dots), model at the mode (line), residuals below; on the right the first "
        f"cycles after the release.{stop} Orange lines: twice the standard deviation of the noise "
        "as estimated without the model."
    )


def _corner(results: Results) -> str:
    assert results.draws is not None
    count = len(results.draws.names)
    some = f" The first {MOST_CORNER} of {count} parameters." if count > MOST_CORNER else ""
    before = (
        " Orange: the posterior of the model without the added effects." if results.before else ""
    )
    return (
        "Posterior of the parameters of interest: marginals on the diagonal with median ± half "
        "of the 90 % interval, pairs below with the contours of one and two standard deviations "
        f"(39 % and 86 %). Axes count from a value near the median.{some}{before}"
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
        "Damping ratio (Eq. 5: averaged from the first swing to the time shown). Above: dots "
        "recorded, bands simulated, one curve per release. Below: how far recorded ratios lie from "
        "the median of simulated ones, in half-widths of the band."
    )


def _search(results: Results) -> str:
    return (
        "The global search. Left: objective of the best and of the median individual above the "
        "final best. Right: spread of the population, and the temperature of the Metropolis "
        "criterion, which ends at 1 nat; after that only improvements are accepted."
    )


def _traces(results: Results) -> str:
    assert results.sampler is not None
    count = len(results.sampler.trace_names)
    some = f" The first {MOST_TRACES} of {count} parameters." if count > MOST_TRACES else ""
    return f"Paths of a few walkers of every ensemble through the kept steps.{some}"
