"""A posterior as the groups of `posterior.nc`: what `archive_arviz` writes."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from bayesimpact.inference.posterior import Posterior
from bayesimpact.report.archive_arviz import Inference, Variable, by_chain, pack_parameters
from bayesimpact.report.results import Provenance

DRAWS = 2000
"""Most draws of every chain that are saved; evenly spaced ones where there are more."""
_PREDICTED_VALUES = 2_000_000  # of all predictive draws together, so that the file stays small
_PREDICTIVE_DRAWS = 40  # most


def inference_groups(posterior: Posterior, provenance: Provenance) -> Inference:
    """Groups posterior, sample_stats, log_likelihood, posterior_predictive and observed_data.

    Chains are the independent ensembles. The log-likelihood has one value per recording and draw.
    Predictive draws are fewer than the others; each recording has its own time axis.
    """
    fit, chains = posterior.fit, posterior.chains
    likelihood, oscillator = fit.target.likelihood, fit.target.oscillator
    campaign = oscillator.campaign
    names = tuple(r.name for r in campaign.recordings)
    draws = by_chain(chains.draws)
    every = -(-draws.shape[1] // DRAWS)
    draws = draws[:, ::every]
    values = likelihood.per_recording(draws.reshape(-1, draws.shape[-1]))
    quantity, own = campaign.recordings[0].quantity, {r.name: r.unit for r in campaign.recordings}
    units = [p.unit for p in oscillator.layout.parameters]
    packed = pack_parameters(
        posterior.names, draws, units, {"case": campaign.cases, "recording": names}
    )
    axes = {r.name: f"time_{r.name}" for r in campaign.recordings}
    return Inference(
        groups={
            "posterior": packed,
            "sample_stats": {"lp": Variable(by_chain(chains.log_posterior)[:, ::every])},
            "log_likelihood": {
                quantity: Variable(values.reshape(*draws.shape[:2], -1), ("recording",))
            },
            "posterior_predictive": {
                name: Variable(samples, (axes[name],), own[name])
                for name, samples in _predictive(posterior).items()
            },
            "observed_data": {
                r.name: Variable(r.samples, (axes[r.name],), r.unit) for r in campaign.recordings
            },
        },
        coords={
            "case": list(campaign.cases),
            "recording": list(names),
            **{axes[r.name]: r.times.tolist() for r in campaign.recordings},
        },
        attrs={
            **asdict(provenance),
            "campaign": campaign.name,
            "mass": campaign.mass,
            "effects": [effect.id for effect in oscillator.effects],
            "noise": likelihood.noise.kind,
            "sampler_steps_per_saved_draw": every * chains.thin,
            "converged": chains.converged,
        },
    )


def _predictive(posterior: Posterior) -> dict[str, np.ndarray]:
    """Recording -> simulated recordings (1, draw, n), single precision; each drawn by itself."""
    oscillator = posterior.fit.target.oscillator
    count = max(4, min(_PREDICTIVE_DRAWS, _PREDICTED_VALUES // int(oscillator.counts.sum())))
    rng = np.random.default_rng([posterior.seed, 1])
    return {
        recording.name: posterior.predictive(r, count, rng)[None].astype(np.float32)
        for r, recording in enumerate(oscillator.campaign.recordings)
    }
