"""The table of unknowns: estimates, intervals, ratios to the mass, what to compare them with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from bayesimpact.inference.fit import Z90, Fit
from bayesimpact.inference.prior import Prior
from bayesimpact.model.parameters import Parameter
from bayesimpact.model.units import dimensions, per_mass_unit, significant
from bayesimpact.report.results import Array, MeasuringChainSummary, Row

LEARNED = "learned_force."
"""How the names of a learned force's coefficients begin: they mean nothing one by one."""

_MEANINGS = {
    "c1": "damping of the suspension",
    "k1": "stiffness of the suspension",
    "c2": "damping of the stop",
    "g": "gap, from true rest to the stop",
    "k2": "stiffness of the stop",
    "y0": "displacement at the first sample",
    "v0": "velocity at the first sample",
    "offset": "rest reading of the probe",
    "gain": "gain of the probe",
    "high_pass_state": "what the high-pass had settled on at the first sample",
    "input_gain": "gain of the measured input",
    "sigma": "noise of the probe",
}


def build_rows(
    fit: Fit,
    draws: Array | None,
    chain: MeasuringChainSummary,
    references: Mapping[str, Mapping[str, float]],
    told: Mapping[str, Mapping[str, Any]] | None = None,
) -> tuple[Row, ...]:
    """One row per parameter.

    Parameters
    ----------
    draws : (S, d), or None for the Laplace approximation
    told : medians and intervals that a diagnosis gives, which are told everywhere: they end at
        physical bounds, and carry what stays unexplained, of which draws know nothing
    """
    campaign = fit.density.oscillator.campaign
    angle = campaign.angular
    titles = {e.id: e.title for e in fit.density.oscillator.acting}
    rows = []
    for i, parameter in enumerate(fit.density.oscillator.layout.parameters):
        mode, sd = float(fit.mode[i]), float(fit.sd[i])
        if draws is None:
            low, high = max(mode - Z90 * sd, parameter.lower), min(mode + Z90 * sd, parameter.upper)
            median, posterior_sd = mode, float("nan")
        else:
            low, median, high = (float(x) for x in np.percentile(draws[:, i], [5, 50, 95]))
            posterior_sd = float(np.std(draws[:, i]))
        if told and parameter.name in told:
            median, (low, high) = told[parameter.name]["median"], told[parameter.name]["ci90"]
        ci90 = (low, high)
        unit = scaling_unit(parameter)
        ratio_unit = per_mass_unit(unit, angle=angle)
        nothing = (float("nan"),) * 3
        over = (median / campaign.mass, low / campaign.mass, high / campaign.mass)
        rows.append(
            Row(
                name=parameter.name,
                unit=parameter.unit,
                role="learned" if parameter.name.startswith(LEARNED) else parameter.role,
                meaning=meaning(parameter, titles),
                mode=mode,
                sd=sd,
                median=median,
                ci90=ci90,
                total90=widened(median, ci90, unit, chain, angle=angle),
                ratio=over if ratio_unit else nothing,
                ratio_unit=ratio_unit,
                references={
                    label: float(values[parameter.name])
                    for label, values in references.items()
                    if parameter.name in values
                },
                prior=prior_text(fit.density.priors.parameters[i]),
                posterior_sd=posterior_sd,
            )
        )
    return tuple(rows)


def scaling_unit(parameter: Parameter) -> str:
    """Unit that says how a parameter scales: a phase is no displacement, even in rad."""
    return "-" if parameter.name.partition("[")[0].endswith(".phase") else parameter.unit


def widened(
    median: float,
    ci90: tuple[float, float],
    unit: str,
    chain: MeasuringChainSummary,
    *,
    angle: bool,
) -> tuple[float, float]:
    """A 90 % interval widened by the uncertainties of mass, clock and gain, in quadrature.

    The three are independent of one another and of the statistical error; how much each counts
    follows from the unit (`model.units`).
    """
    relative = dimensions(unit, angle=angle).relative_sd(
        chain.mass_sd, chain.clock_sd, chain.gain_sd
    )
    systematic = Z90 * abs(median) * relative
    return (
        median - float(np.hypot(median - ci90[0], systematic)),
        median + float(np.hypot(ci90[1] - median, systematic)),
    )


def meaning(parameter: Parameter, titles: Mapping[str, str]) -> str:
    """What a parameter is, in a few words; `titles` of the effects by id."""
    base, _, key = parameter.name.partition("[")
    key = key.rstrip("]")
    if "." in base:
        effect, _, own = base.partition(".")
        words = f"{titles.get(effect, effect)}: {own.replace('_', ' ')}"
    else:
        words = _MEANINGS.get(base, base)
    return f"{words}, case {key}" if key and base == "k2" else words + (f", {key}" if key else "")


def prior_text(prior: Prior) -> str:
    """A prior in words, SI units: "uniform, lower = 0, upper = 8.09e+04"."""
    numbers = [f"{f.name} {significant(getattr(prior, f.name))}" for f in fields(prior)]  # type: ignore[arg-type]
    return f"{prior.kind}: {', '.join(numbers)}"
