"""From live fits and posteriors to `Results` (from diagnoses: `diagnosis.arrays`)."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib import metadata
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.channels import keepers
from bayesimpact.data.gaps import runs
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.posterior import Posterior
from bayesimpact.model.measurement import magnitude_response
from bayesimpact.report import checks
from bayesimpact.report.backbones import backbone_summary
from bayesimpact.report.published import references
from bayesimpact.report.results import (
    Array,
    BackboneSummary,
    Draws,
    EffectSummary,
    MeasuringChainSummary,
    NoiseSummary,
    Provenance,
    RecordingResult,
    Results,
    SamplerSummary,
    SearchSummary,
)
from bayesimpact.report.rows import LEARNED, build_rows

PACKAGES = ("bayesimpact", "numpy", "scipy", "numba", "emcee", "arviz")
DRAWS_KEPT = 4000
TRACE_STEPS = 400
TRACE_WALKERS = 6


@dataclass(frozen=True, eq=False)
class ReportContext:
    """What a fit or a posterior does not know of itself.

    Attributes
    ----------
    command, seconds, seed : for the provenance; a posterior knows its seed
    diagnosis, arrays : content of diagnosis.json, and arrays for its figures
    """

    command: str = ""
    seconds: float = float("nan")
    seed: int = 0
    diagnosis: Mapping[str, Any] | None = None
    arrays: Mapping[str, Array] | None = None


NO_CONTEXT = ReportContext()


def results_from_fit(
    identification: Identification, context: ReportContext = NO_CONTEXT
) -> Results:
    """Results of a fit: intervals are those of the Laplace approximation at the mode."""
    search, noise = _search(identification), identification.noise
    return _results(identification.fit, noise, search=search, context=context)


def results_from_posterior(
    posterior: Posterior,
    identification: Identification | None = None,
    *,
    backbone: bool = True,
    before: Posterior | None = None,
    context: ReportContext = NO_CONTEXT,
) -> Results:
    """Results of a posterior: intervals are percentiles of its draws.

    Parameters
    ----------
    posterior : of `inference.posterior`, of the base model or with effects
    identification : how the mode was found; None leaves the search out
    backbone : simulate recordings for the posterior-predictive check of the backbone
    before : posterior without the effects, shown beside this one unless it is the same
    """
    fit = posterior.fit
    before = None if before is posterior else before
    rng = np.random.default_rng([posterior.seed, 2])
    return _results(
        fit,
        fit.density.likelihood.noise,
        search=None if identification is None else _search(identification),
        context=replace(context, seed=posterior.seed),
        posterior=posterior,
        backbone=backbone_summary(posterior, rng) if backbone else None,
        before=before,
        before_backbone=backbone_summary(before, rng) if backbone and before is not None else None,
    )


def _results(
    fit: Fit,
    noise: Noise,
    *,
    search: SearchSummary | None,
    context: ReportContext,
    posterior: Posterior | None = None,
    backbone: BackboneSummary | None = None,
    before: Posterior | None = None,
    before_backbone: BackboneSummary | None = None,
) -> Results:
    oscillator = fit.density.oscillator
    campaign = oscillator.campaign
    m = campaign.measurement
    chain = MeasuringChainSummary(
        _smoothing(oscillator.smoothing), m.mass_sd, m.clock_sd, m.gain_sd
    )
    draws = None if posterior is None else posterior.draws
    told = context.diagnosis
    if told is not None and draws is not None and told.get("remainder") is None:
        told = None  # its numbers are of these draws
    summary = Results(
        name=campaign.name,
        mass=campaign.mass,
        stop=campaign.stop,
        quantity=campaign.recordings[0].quantity,
        recordings=recording_results(fit),
        rows=build_rows(
            fit, draws, chain, references(campaign), told["parameters"]["after"] if told else None
        ),
        effects=tuple(
            EffectSummary(e.id, e.title, e.equation, e.statement) for e in oscillator.acting
        ),
        noise=NoiseSummary(
            noise.kind,
            noise.level,
            noise.level_error,
            noise.correlation,
            noise.source,
            noise.is_independent,
        ),
        chain=chain,
        verdict="",
        headline="",
        reduced_chi2=fit.reduced_chi2,
        chi2_z=_chi2_z(fit),
        log_posterior=fit.log_posterior,
        covariance=fit.covariance,
        fit_converged=fit.converged,
        search=search,
        sampler=None if posterior is None else _sampler(posterior),
        draws=None
        if posterior is None
        else _draws(posterior, "posterior" if before is None else "with added effects"),
        backbone=backbone,
        checks=(),
        provenance=_provenance(campaign, context),
        before=None if before is None else _draws(before, "without added effects"),
        before_backbone=before_backbone,
        diagnosis=context.diagnosis,
        diagnosis_arrays=context.arrays or {},
        notes=campaign.notes,
    )
    return checks.assessed(summary)


def recording_results(fit: Fit) -> tuple[RecordingResult, ...]:
    """Every recording and what a fit makes of it."""
    likelihood = fit.density.likelihood
    recordings = fit.density.oscillator.campaign.recordings
    states = keepers(recordings)
    shared = (fit.mode.size - 1) / len(recordings)  # parameters per recording
    found = []
    for r, (recording, predicted) in enumerate(zip(recordings, fit.predicted, strict=True)):
        freedom = max(float(likelihood.sizes[r]) - shared, 1.0)
        found.append(
            RecordingResult(
                name=recording.name,
                case=recording.case,
                interval=recording.interval,
                start=recording.start,
                samples=np.asarray(recording.samples),
                excluded=() if recording.used is None else tuple(runs(~recording.used)),
                input="" if recording.input is None else recording.input.label,
                state="" if states[r] == recording.name else states[r],
                predicted=np.asarray(predicted),
                quantity=recording.quantity,
                displacement=np.zeros(0) if recording.is_displacement else fit.displacements[r],
                scale=float(likelihood.scales[r]),
                sigma=float(fit.mode[likelihood.sigma_columns[r]] * likelihood.scales[r]),
                noise_rms=_noise_rms(likelihood.noise, recording.interval) * likelihood.scales[r],
                reduced_chi2=float(fit.sums[r]) / likelihood.noise.level**2 / freedom,
                whiteness_p=checks.whiteness(fit, r),
            )
        )
    return tuple(found)


def _noise_rms(noise: Noise, interval: float) -> float:
    """Root mean square of the noise behind the measuring chain's filter, m."""
    if noise.smoothing is None:
        return noise.level
    frequency = np.linspace(0.0, 0.5 / interval, 4001)
    passed = magnitude_response(noise.smoothing, interval, frequency) ** 2
    return noise.level * float(np.sqrt(np.mean(passed * noise.spectrum(frequency, interval))))


def _chi2_z(fit: Fit) -> float:
    """Distance of the reduced chi2 from 1 in standard errors, those of the noise level included."""
    likelihood = fit.density.likelihood
    freedom = float(likelihood.sizes.sum()) - (fit.mode.size - 1)
    error = likelihood.noise.level_error
    level = error if np.isfinite(error) else 0.0
    return (fit.reduced_chi2 - 1) / float(np.sqrt(2 / freedom + 4 * level**2))


def _search(identification: Identification) -> SearchSummary | None:
    result = identification.search
    if result is None or identification.from_search is None:
        return None
    ends = identification.from_search.mode - identification.from_guess.mode
    history = result.history
    return SearchSummary(
        evaluations=history.evaluations.astype(np.float64),
        best=history.best,
        median=history.median,
        spread=history.spread,
        temperature=history.temperature,
        stopped=result.stopped,
        agree=identification.agree,
        distance=float(np.max(np.abs(ends) / identification.fit.sd)),
    )


def _of_interest(fit: Fit) -> list[int]:
    """Positions of the parameters that pictures show: no coefficients of a learned force."""
    positions = fit.density.oscillator.layout.roles("physical", "effect")
    return [int(i) for i in positions if not fit.names[i].startswith(LEARNED)]


def _draws(posterior: Posterior, label: str) -> Draws:
    parameters = posterior.fit.density.oscillator.layout.parameters
    columns = _of_interest(posterior.fit)
    step = max(1, posterior.draws.shape[0] // DRAWS_KEPT)
    return Draws(
        label=label,
        names=tuple(parameters[i].name for i in columns),
        units=tuple(parameters[i].unit for i in columns),
        values=posterior.draws[::step, columns],
    )


def _sampler(posterior: Posterior) -> SamplerSummary:
    chains, record = posterior.chains, posterior.chains.convergence
    parameters = posterior.fit.density.oscillator.layout.parameters
    columns = _of_interest(posterior.fit)
    ensembles, stored, walkers, _ = chains.draws.shape
    every = max(1, -(-stored // TRACE_STEPS))
    shown = np.linspace(0, walkers - 1, min(walkers, TRACE_WALKERS)).astype(int)
    return SamplerSummary(
        converged=chains.converged,
        reasons=record.reasons,
        names=posterior.names,
        tau=record.tau,
        ess_bulk=record.ess_bulk,
        ess_tail=record.ess_tail,
        rhat=record.rhat,
        ensembles=ensembles,
        steps=chains.steps - chains.discarded,
        walkers=walkers,
        draws=ensembles * stored * walkers,
        acceptance=float(np.mean(chains.acceptance)),
        trace_names=tuple(posterior.names[i] for i in columns),
        trace_units=tuple(parameters[i].unit for i in columns),
        traces=chains.draws[:, ::every][:, :, shown][..., columns],
        trace_steps=np.arange(0, stored, every, dtype=np.float64) * chains.thin,
    )


def _smoothing(smoothing: Smoothing | None) -> str:
    if smoothing is None:
        return ""
    if smoothing.kind == "lag":
        return f"first-order lag, time constant {smoothing.time_constant * 1e3:g} ms"
    return f"Savitzky-Golay, {smoothing.window} samples, order {smoothing.polyorder}"


def _provenance(campaign: Campaign, context: ReportContext) -> Provenance:
    return Provenance(
        command=context.command,
        seed=context.seed,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        data_sha256=campaign.sha256,
        versions=versions(),
        seconds=context.seconds,
    )


def versions() -> dict[str, str]:
    """Versions of Python and of what the numbers depend on."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found
