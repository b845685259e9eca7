"""Sentences of the report that depend on the results."""

from __future__ import annotations

import numpy as np

from bayesimpact.diagnosis.measurement.whiteness import LAGS
from bayesimpact.model.units import chi2, number, significant, typeset
from bayesimpact.report.checks import amount
from bayesimpact.report.figures.recordings import MOST as MOST_RECORDINGS
from bayesimpact.report.results import Results, Row


def kind_words(results: Results) -> str:
    """What the report holds."""
    if results.diagnosis is not None:
        return "diagnosis" if results.draws is None else "diagnosis and posterior"
    return "posterior" if results.kind == "posterior" else "mode and curvature"


def byline(results: Results) -> str:
    """Date and origin of the intervals."""
    date = results.provenance.date[:10]
    if results.sampler is None:
        return f"{date}. Intervals from the curvature at the mode; no draws yet."
    s = results.sampler
    return (
        f"{date}. {number(s.draws, 0)} draws by emcee from {s.ensembles} independent ensembles of "
        f"{s.walkers} walkers."
    )


def facts(results: Results) -> list[tuple[str, str]]:
    """Figures at a glance."""
    angle = results.angular
    mass = f"{results.mass:g} {typeset('kg m2' if angle else 'kg')}"
    found = [
        ("inertia" if angle else "mass", mass),
        ("recordings", str(len(results.recordings))),
        ("samples", number(sum(r.samples.size for r in results.recordings), 0)),
        ("unknowns", str(len(results.rows))),
        (f"noise, from {_noise_source(results)}", amount(results.noise.level, results.unit)),
        ("residual rms", amount(results.rms, results.unit)),
        ("reduced χ²", chi2(results.reduced_chi2)),
    ]
    if results.cases:
        found.insert(2, ("cases", ", ".join(results.cases)))
    return found


def parameter_words(results: Results) -> str:
    """What the table of parameters holds."""
    if results.remains:
        return (
            "Medians and 90 % intervals that carry what stays unexplained: by how much it may have "
            "moved the parameters is part of them."
        )
    if results.kind == "posterior":
        words = "Medians and central 90 % intervals of the posterior."
    elif results.diagnosis is not None:
        words = (
            "Medians and central 90 % intervals of the Gaussian that has the posterior's curvature "
            "at the mode, cut at physical bounds (bayesimpact diagnose without --quick draws from "
            "the posterior itself)."
        )
    else:
        words = (
            "The mode, and 90 % intervals of the Gaussian that has the posterior's curvature there "
            "(bayesimpact sample draws from the posterior itself)."
        )
    if results.verdict == "inadequate":
        words += " They describe the closest oscillator of this kind, not the rig: see the verdict."
    return words


def interval_words(results: Results) -> str:
    """What the intervals contain, and what they do not."""
    chain, mass = results.chain, "inertia" if results.angular else "mass"
    if not chain.stated:
        return _unstated(results, mass)
    parts = [
        f"{name} {significant(100 * sd, 2)} %"
        for name, sd in ((mass, chain.mass_sd), ("clock", chain.clock_sd), ("gain", chain.gain_sd))
        if sd > 0
    ]
    return (
        f"Statistical intervals take {mass}, clock and probe gain as exact. The wider ones add "
        f"their stated standard uncertainties ({', '.join(parts)}) in quadrature: stiffness as "
        f"{mass} over time squared, damping as {mass} over time, lengths as the gain, other "
        "parameters by their dimensions likewise."
    )


def _unstated(results: Results, mass: str) -> str:
    k1 = results.row("k1")
    half = 0.5 * (k1.ci90[1] - k1.ci90[0])
    words = (
        f"campaign.toml states no uncertainty of {mass}, clock or probe gain: the intervals are "
        f"statistical and hold for exactly these."
    )
    if half > 0 and 1e-3 * k1.median > half:
        words += (
            f" An error of 0.1 % in the {mass} would shift every stiffness and damping by as "
            f"much; for k1 that is {significant(1e-3 * k1.median / half, 2)} times the half-width "
            "of its interval."
        )
    return words


def ratio_words(results: Results) -> str:
    """Why ratios are given."""
    mass = "inertia" if results.angular else "mass"
    if any(r.input == "force_N" for r in results.recordings) and not any(
        row.name == "input_gain" for row in results.rows
    ):
        return (
            f"A motion under a measured force tells the {mass} as well; here the one stated in "
            "campaign.toml is taken as exact."
        )
    if results.mass == 1.0:
        return (
            f"A free decay is the same for twice the {mass} with twice the stiffness and damping: "
            f"only ratios to the {mass} can be identified. With the {mass} set to 1 the values "
            "above are these ratios."
        )
    return (
        f"A free decay is the same for twice the {mass} with twice the stiffness and damping: "
        f"only ratios to the {mass} can be identified. Absolute values in the table above are "
        f"these ratios times the {mass} stated in campaign.toml."
    )


def recordings_words(results: Results) -> str:
    """What the table and figures of recordings show."""
    test = "cumulative periodogram" if results.chain.smoothing else f"Ljung-Box, {LAGS} lags"
    words = (
        "Residual: recorded minus predicted at the mode. Reduced χ² is against the noise level "
        f"that was estimated from {_noise_source(results)}; whiteness is the p-value of the "
        f"whitened residual ({test}), for information."
    )
    if any(r.excluded for r in results.recordings):
        words += " Shaded samples are set aside: they count nowhere, and a stand-in is drawn."
    words += input_words(results)
    if results.notes:
        words += " Set aside: " + "; ".join(results.notes) + "."
    if len(results.recordings) > MOST_RECORDINGS:
        words += (
            f" Figures show {MOST_RECORDINGS} of {len(results.recordings)} recordings: those of "
            "every case that fit worst."
        )
    return words


def input_words(results: Results) -> str:
    """Which recordings have a measured input, and what that means for them; "" without any."""
    driven = [r.name for r in results.recordings if r.input]
    if not driven:
        return ""
    shown = ", ".join(driven[:MOST_RECORDINGS])
    shown += f" and {len(driven) - MOST_RECORDINGS} more" if len(driven) > MOST_RECORDINGS else ""
    words = (
        " With a measured input, a line between samples unless campaign.toml says else: "
        f"{shown}. The backbone knows "
        "free decays only: they have no part in its check."
    )
    if any(r.input.endswith("absolute") for r in results.recordings):
        words += (
            " Where campaign.toml says absolute, the base's own motion is counted into what the "
            "model predicts of a reading; displacements are relative to the base."
        )
    return words


def search_words(results: Results) -> str:
    """How the mode was found."""
    search = results.search
    if search is None:
        return ""
    count = number(float(search.evaluations[-1]), 0)
    end = (
        f"The search stopped after {count} evaluations, its population together"
        if search.stopped == "converged"
        else f"The search used up its {count} evaluations"
    )
    ends = (
        "ended at the same mode"
        if search.agree
        else "ended in different places; the better is reported"
    )
    return (
        "The mode was sought from two starts: initial estimates from the recordings, and the "
        "winner of adaptive differential evolution with the Metropolis criterion over the first "
        "cycles of every recording, in wide bounds about these estimates. Both were carried to "
        f"the full length over growing windows by least squares. {end}. Both "
        f"ways {ends} "
        f"({significant(search.distance, 2)} standard deviations apart)."
    )


def sampler_words(results: Results) -> str:
    """How the posterior was drawn."""
    s = results.sampler
    if s is None:
        return ""
    words = (
        f"{s.ensembles} independent ensembles of {s.walkers} walkers, {number(s.steps, 0)} kept "
        f"steps each; {significant(100 * s.acceptance, 2)} % of proposals accepted."
    )
    if s.converged:
        return words + " All demands on convergence are met."
    return words + f" Not converged: {'; '.join(s.reasons)}."


def _noise_source(results: Results) -> str:
    return "the recordings alone" if results.noise.is_independent else "what the model leaves"


def noise_words(results: Results) -> str:
    """What is known of the noise."""
    n = results.noise
    level = amount(n.level, results.unit)
    if np.isfinite(n.level_error) and n.level_error > 0:
        level += f" (standard error {significant(100 * n.level_error, 2)} %)"
    words = f"Noise: {n.kind}; level {level}, from {n.source}."
    sigmas = results.select("noise")
    if sigmas:
        row = sigmas[0]
        which = "" if len(sigmas) == 1 else f", {row.name},"
        # where the model misses, what a fit takes for noise is the misfit
        verb = "The fit leaves" if results.verdict == "inadequate" else "In the fit it is"
        words += f" {verb}{which} {_with_interval(row, results.unit)}."
    if results.chain.smoothing:
        words += (
            f" The recordings were smoothed ({results.chain.smoothing}); so are the simulations."
        )
    return words


def _with_interval(row: Row, unit: str) -> str:
    return (
        f"{amount(row.median, unit, 4)} (90 % interval {amount(row.ci90[0], unit, 4)} to "
        f"{amount(row.ci90[1], unit, 4)})"
    )


def source_words(results: Results) -> str:
    """What the report stands on."""
    return (
        "Model, zero-crossing backbone and identification after B. Tian, S. Yin, Y. Liu and J. "
        "Londoño Monsalve, “Nonlinear characteristics identification of an impact oscillator "
        "with a one-sided elastic constraint”. This page holds everything it shows: no other "
        "file is needed."
    )
