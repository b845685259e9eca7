"""The posterior of one model: emcee started from the mode, and what it predicts."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.errors import InputError
from bayesimpact.inference.arviz_groups import ArvizDraws, arviz_groups, as_arviz, by_chain
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.sampling.sample import Chains, sample_posterior
from bayesimpact.model.measurement import smooth

Array = NDArray[np.float64]

ARVIZ_DRAWS = 2000
"""Most draws of every chain that ArviZ is given; evenly spaced ones where there are more."""
_PREDICTED_VALUES = 2_000_000  # of all predictive draws together, so that the file stays small
_PREDICTIVE_DRAWS = 40  # most


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws from the posterior of a model.

    Attributes
    ----------
    fit : the mode from which the sampler started
    chains : kept draws (ensembles, steps, walkers, d) and the verdict on convergence
    seed : of the sampler
    """

    fit: Fit
    chains: Chains
    seed: int

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the draws' last axis."""
        return self.fit.names

    @cached_property
    def draws(self) -> Array:
        """All kept draws, (S, d)."""
        return np.asarray(self.chains.draws.reshape(-1, self.chains.draws.shape[-1]))

    def column(self, name: str) -> Array:
        """Draws of one parameter, (S,)."""
        return np.asarray(self.draws[:, self.fit.density.oscillator.layout.index(name)])

    def interval(
        self, name: str, probability: float = 0.9
    ) -> tuple[float, float] | dict[str, tuple[float, float]]:
        """Central credible interval of one parameter, SI.

        A name without its case or recording ("k2") gives those of all, by name.

        Raises
        ------
        InputError : the model has no such parameter
        """
        tail = 50 * (1 - probability)
        family = [n for n in self.names if n == name or n.partition("[")[0] == name]
        if not family:
            raise InputError("parameter", repr(name), ", ".join(self.names))
        ends = {n: np.percentile(self.column(n), [tail, 100 - tail]) for n in family}
        found = {n: (float(low), float(high)) for n, (low, high) in ends.items()}
        return found.get(name, found)

    def __repr__(self) -> str:
        """One line."""
        state = "converged" if self.chains.converged else "not converged"
        campaign = self.fit.density.oscillator.campaign.name
        return f"<Posterior of {campaign!r}: {self.draws.shape[0]} draws, {state}>"

    def thinned(self, count: int, rng: np.random.Generator) -> Array:
        """`count` draws (count, d), without replacement where there are enough."""
        size = self.draws.shape[0]
        return np.asarray(self.draws[rng.choice(size, size=min(count, size), replace=False)])

    def predictive(self, r: int, count: int, rng: np.random.Generator) -> Array:
        """Simulated recordings `r`, (count, n), m: posterior draws with fresh noise, as read."""
        likelihood = self.fit.density.likelihood
        oscillator, noise = likelihood.oscillator, likelihood.noise
        theta = self.thinned(count, rng)
        motion = oscillator.predict_recording(r, theta)
        recording = oscillator.campaign.recordings[r]
        sigma = theta[:, likelihood.sigma_columns[r]]
        draws = np.array([noise.drawn(rng, recording, s) for s in sigma])
        return motion + smooth(draws, noise.smoothing, recording.interval)

    def to_arviz(self, *, lab_units: bool = False) -> Any:
        """ArviZ's `InferenceData` (0.23) or `DataTree` (1.x), one chain per independent ensemble.

        Groups: posterior, sample_stats, prior, log_likelihood (per half cycle, for `az.loo`: see
        `inference.half_cycle_likelihood`), observed_data, constant_data and posterior_predictive.
        At most `ARVIZ_DRAWS` draws of every chain, evenly spaced: the attributes say by how many
        steps of the sampler. `lab_units`: mm, mN, ... in place of SI, so that a summary shows
        digits.
        """
        return as_arviz(self.arviz_groups({"seed": self.seed}, lab_units=lab_units))

    def arviz_groups(self, attrs: Mapping[str, Any], *, lab_units: bool = False) -> dict[str, Any]:
        """The same as xarray Datasets by group, with further attributes."""
        chains = self.chains
        draws = by_chain(chains.draws)
        every = -(-draws.shape[1] // ARVIZ_DRAWS)
        own = {
            "sampler_steps_per_saved_draw": every * chains.thin,
            "converged": chains.converged,
        }
        given = ArvizDraws(
            draws[:, ::every],
            by_chain(chains.log_posterior)[:, ::every],
            self._predictive(),
            {**attrs, **own},
        )
        return arviz_groups(self.fit, given, lab_units=lab_units)

    def _predictive(self) -> dict[str, NDArray[np.float32]]:
        """Recording -> simulated recordings (1, draw, n), each drawn by itself."""
        oscillator = self.fit.density.oscillator
        count = max(4, min(_PREDICTIVE_DRAWS, _PREDICTED_VALUES // int(oscillator.counts.sum())))
        rng = np.random.default_rng([self.seed, 1])
        return {
            recording.name: self.predictive(r, count, rng)[None].astype(np.float32)
            for r, recording in enumerate(oscillator.campaign.recordings)
        }


def sample(
    fit: Fit,
    *,
    seed: int = 0,
    folder: Path | None = None,
    resume: bool = False,
    callback: Callable[..., None] | None = None,
    **settings: Any,
) -> Posterior:
    """Sample the posterior around a mode by emcee.

    Parameters
    ----------
    fit : mode and curvature
    seed : of every random number
    folder : where blocks of the chain are kept, so that `resume` can go on; None keeps nothing
    callback : called with the sampler's progress after every block
    settings : further settings of `bayesimpact.inference.sampling.sample.sample_posterior`; its
        `tell` says which saved blocks could not be used

    Raises
    ------
    InputError : `resume` with a chain that belongs to other data or settings
    """
    density = fit.density
    lower = np.array([p.lower for p in density.oscillator.layout.parameters])
    upper = np.array([p.upper for p in density.oscillator.layout.parameters])
    chains = sample_posterior(
        density,
        fit.mode,
        fit.covariance,
        seed=seed,
        folder=folder,
        resume=resume,
        lower=np.maximum(lower, density.priors.lower),
        upper=np.minimum(upper, density.priors.upper),
        fingerprint=_fingerprint(fit),
        names=fit.names,
        progress=callback,
        **settings,
    )
    return Posterior(fit, chains, seed)


def _fingerprint(fit: Fit) -> dict[str, str]:
    """What a saved chain must belong to, by name: what the campaign says, not how its files say it,
    the model with its priors and noise, and the package's version.
    """
    density = fit.density
    oscillator = density.oscillator
    recordings = oscillator.campaign.recordings
    long = {
        "recordings": [(r.name, r.case, r.quantity, r.samples.size) for r in recordings],
        "samples": hashlib.sha256(oscillator.samples.tobytes()).hexdigest(),
        "used": [None if r.used is None else r.used.tobytes().hex() for r in recordings],
        "intervals": oscillator.intervals.tolist(),
        "parameters": fit.names,
        "effects": [effect.id for effect in oscillator.effects],
        "priors": density.priors.parameters,
        "noise": density.likelihood.noise,
    }
    short = {name: hashlib.sha256(repr(v).encode()).hexdigest()[:16] for name, v in long.items()}
    return {
        **short,
        "mass": repr(oscillator.campaign.mass),
        "smoothing": repr(oscillator.smoothing),
        "version": metadata.version("bayesimpact"),
    }
