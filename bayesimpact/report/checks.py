"""The verdict and the checklist: does the model fit, and can the numbers be trusted?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.model.units import chi2, display, number, p_value, p_words, significant, typeset
from bayesimpact.report.results import ChecklistItem, Results
from bayesimpact.report.whiteness import whiteness

__all__ = ["amount", "assess", "assessed", "model_name", "whiteness"]

EXCESS = 1.2  # residual over noise from which a model does not describe the recordings
SURE, SUSPICIOUS = 5.0, 3.0  # standard errors of the reduced chi2
LEAST_P = 0.01
MISFIT = "Misfit against the independent noise estimate"
SD_RATIO = (0.8, 1.25)  # of posterior to Laplace standard deviations


def assessed(results: Results) -> Results:
    """The same results with verdict, headline and checklist."""
    verdict = assess(results.reduced_chi2, results.chi2_z)
    results = replace(results, verdict=verdict)
    return replace(results, headline=headline(results), checks=checklist(results))


def assess(reduced_chi2: float, z: float) -> str:
    """Verdict on the misfit against the noise estimated from the recordings alone.

    Parameters
    ----------
    reduced_chi2, z : the latter in standard errors from 1

    Returns
    -------
    "inadequate": residual more than 1.2 times the noise, and surely so; "slight": above the noise
    by more than 3 standard errors; "overestimated": below by more than 5; else "adequate"
    """
    if not np.isfinite(reduced_chi2) or (z > SURE and reduced_chi2 > EXCESS**2):
        return "inadequate"
    if z > SUSPICIOUS:
        return "slight"
    return "overestimated" if z < -SURE else "adequate"


def model_name(results: Results) -> str:
    """The model in words, with its article."""
    base = "the impact oscillator" if results.stop else "a linear oscillator"
    if results.effects and not results.stop:
        base = "an oscillator"
    if not results.effects:
        return base
    titles = [effect.title for effect in results.effects]
    listed = titles[0] if len(titles) == 1 else f"{', '.join(titles[:-1])} and {titles[-1]}"
    return f"{base} with {listed}"


def amount(value: float, unit: str, digits: int = 3, like: float | None = None) -> str:
    """A quantity in a unit of convenient size, "5.02 µm", or in that of another one, `like`."""
    shown = display(unit, abs(value) if like is None else like)
    return f"{significant(value * shown.scale, digits)}\N{NO-BREAK SPACE}{typeset(shown.unit)}"


def headline(results: Results) -> str:
    """The verdict in words."""
    model = model_name(results)
    model = model[0].upper() + model[1:]
    noise = amount(results.noise.level, results.unit)
    like = results.rms if results.verdict == "inadequate" else results.noise.level
    rms = amount(results.rms, results.unit, like=like)
    excess = float(np.sqrt(results.reduced_chi2))
    diagnosed = results.diagnosis is not None
    if results.verdict == "inadequate":
        text = (
            f"{model} does not fit these recordings. It leaves "
            f"{significant(100 * results.share, 2)} % of the signal unexplained: {rms} rms, about "
            f"{significant(excess, 2)} times what noise of {noise} would leave. The values below "
            "describe the closest such oscillator, "
        ) + (
            "and their intervals carry what remains."
            if diagnosed
            else "and their intervals are too narrow to be believed. bayesimpact diagnose asks "
            "what is missing."
        )
    elif results.verdict == "slight":
        text = (
            f"{model} fits these recordings to {significant(100 * (excess - 1), 2)} % above the "
            f"noise of {noise} (residual {rms} rms). That is little, but more than chance "
            f"({results.chi2_z:.1f} standard errors): something small is missing, and it may have "
            "moved the parameters by more than their intervals."
        ) + ("" if diagnosed else " bayesimpact diagnose looks for it.")
    elif results.verdict == "overestimated":
        text = (
            f"{model} fits these recordings more closely than noise of {noise} allows (residual "
            f"{rms} rms). Noise and intervals are in doubt: is the stated noise too large, or were "
            "the recordings smoothed without campaign.toml saying so?"
        )
    else:
        told = f"and the noise, estimated without the model, is {noise}"
        if not results.noise.is_independent:
            told = "and passes for noise"
        text = (
            f"{model} describes these recordings down to the noise: what it leaves is {rms} rms, "
            f"{told}."
        )
    return text + _trust(results)


def _trust(results: Results) -> str:
    """What has to be said about the computation, in words."""
    words = ""
    sampler, search = results.sampler, results.search
    if sampler is not None and sampler.converged and results.verdict != "inadequate":
        words += " The sampler converged."
    elif sampler is not None and not sampler.converged:
        words += " The sampler has not converged: the intervals are provisional."
    if search is not None and not search.agree:
        words += (
            " Guess and global search ended in different places; the better one is reported, and "
            "there may be a better one still."
        )
    if not results.fit_converged:
        words += " The fit did not converge to the mode."
    return words


def checklist(results: Results) -> tuple[ChecklistItem, ...]:
    """All checks that the results allow."""
    found = [_misfit(results), _whiteness(results), _mode(results)]
    if results.search is not None:
        found.append(_search(results))
    if results.sampler is not None:
        found += [_sampler(results), _gaussian(results)]
    if results.backbone is not None:
        found.append(_backbone(results))
    return tuple(found)


def _status(passed: bool) -> str:
    return "passed" if passed else "failed"


def _misfit(results: Results) -> ChecklistItem:
    z = results.chi2_z
    far = f"{abs(z):.1f}" if abs(z) < 100 else "more than 100"
    side = "above" if z > 0 else "below"
    found = f"reduced χ² {chi2(results.reduced_chi2)}, {far} standard errors {side} 1"
    if not results.noise.is_independent and results.verdict == "adequate":
        why = "The noise level is that of what a model leaves: this is no test of the misfit."
        return ChecklistItem(MISFIT, "note", found, why)
    why = "The noise level comes from the recordings alone, not from what a model leaves over."
    return ChecklistItem(MISFIT, _status(results.verdict == "adequate"), found, why)


def _whiteness(results: Results) -> ChecklistItem:
    p = np.array([r.whiteness_p for r in results.recordings])
    low = int(np.sum(p < LEAST_P / p.size))
    smallest = p_value(float(np.nanmin(p))) if np.isfinite(p).any() else "undefined"
    return ChecklistItem(
        "Whitened residuals are white",
        "note",
        f"{p.size - low} of {p.size} recordings; smallest p: {smallest}",
        "For information: fitting hides nearly all of a missing effect from this test.",
    )


def _mode(results: Results) -> ChecklistItem:
    finding = "the last step was below a thousandth of a standard deviation"
    return ChecklistItem(
        "The fit converged to the mode",
        _status(results.fit_converged),
        finding if results.fit_converged else "it ran out of iterations",
    )


def _search(results: Results) -> ChecklistItem:
    assert results.search is not None
    distance = results.search.distance
    return ChecklistItem(
        "Guess and global search end at the same mode",
        _status(results.search.agree),
        f"largest distance {significant(distance, 2)} standard deviations after polishing both",
        "Two starts: initial estimates, and differential evolution in wide bounds about them.",
    )


def _sampler(results: Results) -> ChecklistItem:
    s = results.sampler
    assert s is not None
    least = number(float(min(s.ess_bulk.min(), s.ess_tail.min())), 0)
    finding = (
        f"effective sample size {least} or more, "
        f"R-hat {np.max(s.rhat):.4f} or less between {s.ensembles} independent ensembles"
    )
    return ChecklistItem(
        "The sampler converged",
        _status(s.converged),
        finding if s.converged else "; ".join(s.reasons),
    )


def _gaussian(results: Results) -> ChecklistItem:
    ratio = np.array([row.posterior_sd / max(row.sd, 1e-300) for row in results.rows])
    worst = int(np.argmax(np.abs(np.log(np.maximum(ratio, 1e-300)))))
    furthest = results.rows[worst].name
    inside = bool(np.all((ratio > SD_RATIO[0]) & (ratio < SD_RATIO[1])))
    return ChecklistItem(
        "Standard deviations of draws and of the curvature at the mode agree",
        "passed" if inside else "note",
        f"ratios {ratio.min():.2f} to {ratio.max():.2f}; furthest from 1: {furthest}",
        "They need not: a posterior that is not Gaussian makes them differ.",
    )


def _backbone(results: Results) -> ChecklistItem:
    b = results.backbone
    assert b is not None
    cases = [
        f"{label if label == 'all' else f'case {label}'}: {100 * inside:.0f} % inside, {p_words(p)}"
        for label, inside, p in zip(b.labels, b.inside, b.p_values, strict=True)
    ]
    return ChecklistItem(
        "Recorded backbones lie where simulated ones do",
        _status(bool(b.p_values[-1] > LEAST_P)),
        "; ".join(cases),
        f"Bands hold {100 * b.probability:.0f} % of {b.replicates} simulated recordings each.",
    )
