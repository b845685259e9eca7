"""How large is an effect, counted in what a campaign of this very design could detect?

An effect is planted in the independent rig, without noise; the base model is refitted to what the
chain then records, for it absorbs nearly all of most effects. The norm of the misfit that is left,
whitened and in units of the noise, is the number of standard errors by which the effect stands out
(the expected score z, sqrt(2 delta log L)). The detection limit is five of them. From the package
come the base model and, for the distance from other effects, their linearised responses; the
planted effect's own response is the rig's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.diagnosis.refits.extend import campaign_scales
from bayesimpact.diagnosis.score_test.directions import directions
from bayesimpact.inference.fit import Fit, PosteriorDensity
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.mode import find_mode
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.prior import LogUniform, Normal, Prior
from bayesimpact.inference.priors import Priors
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.oscillator import build_oscillator
from bayesimpact.trial.draw.designs import DrawnRig
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.rig.measuring_chain import Probe, measure
from bayesimpact.trial.rig.motion import sampling
from bayesimpact.trial.rig.recordings import Effects, record

Array = NDArray[np.float64]

RTOL, ATOL = 1e-9, 1e-11  # of the rig's motion: errors far below the noise, at half the cost
WIDE = 1e3  # prior widths relative to the true values: no information


def clean_readings(design: DrawnRig, effects: Effects) -> tuple[Array, ...]:
    """What the chain would record without noise and rounding, per recording (n,), m."""
    chain = replace(design.chain, noise=0.0, rounding=0.0)
    rng = np.random.default_rng(0)  # multiplied by a noise of zero
    return tuple(
        record(
            design.rig,
            release,
            effects,
            chain,
            rate=design.rate,
            duration=design.duration,
            rng=rng,
            rtol=RTOL,
            atol=ATOL,
        )
        for release in design.releases
    )


def true_parameters(design: DrawnRig) -> dict[str, float]:
    """Base parameters and nuisances by the package's names, SI."""
    rig = design.rig
    values = {"c1": rig.c1, "k1": rig.k1}
    if rig.k2:
        values |= {"c2": rig.c2, "g": rig.g} | {f"k2[{case}]": k for case, k in rig.k2.items()}
    for release in design.releases:
        values[f"y0[{release.name}]"] = release.y0
        values[f"v0[{release.name}]"] = release.v0
        values[f"offset[{release.name}]"] = design.chain.offsets.get(release.name, 0.0)
    return values


def truth_of_rig(settings: Settings, seed: int, kind: str, design: DrawnRig) -> dict[str, Any]:
    """What every trial's truth says of its rig and recordings."""
    return {
        "schema": "bayesimpact/trial-truth/1",
        "seed": seed,
        "settings": settings.document(),
        "kind": kind,
        "rig_kind": design.rig_kind,
        "noise_kind": design.noise_kind,
        "mass_kg": design.rig.mass,
        "parameters": true_parameters(design),
        "rate_hz": design.rate,
        "duration_s": design.duration,
        "noise_m": design.chain.noise,
        "noise_correlation": design.chain.correlation,
        "noise_white_share": design.chain.white,
        "rounding_m": design.chain.rounding,
    }


class Rival:
    """What one effect of the catalogue can imitate, at one point of its shape grid."""

    def __init__(self, effect: str, columns: Array, one_sided: bool) -> None:
        self.effect = effect
        self.one_sided = one_sided and columns.shape[1] == 1
        self.basis, triangle = np.linalg.qr(columns)
        self.sign = np.sign(triangle[0, 0])

    def left(self, response: Array) -> float:
        """Norm of what it leaves of a response; an inadmissible sign imitates nothing."""
        share = self.basis.T @ response
        if self.one_sided and share[0] * self.sign < 0:
            share = 0 * share
        return float(np.linalg.norm(response - self.basis @ share))


class Sensitivity:
    """Measures planted effects against what one design can detect."""

    def __init__(self, design: DrawnRig, rng: np.random.Generator) -> None:
        self.design = design
        self.clean = clean_readings(design, {})
        self.fit = _fit(design, _noisy(design, self.clean, rng))
        self.basis = _basis(self.fit)
        self.others: tuple[Rival, ...] | None = None
        self._seen: dict[str, Array] = {}

    def response(self, effects: Effects, reference: Effects | None = None) -> Array:
        """What refitting the base model leaves of an effect, (N,), in standard deviations.

        `reference` is what the rig has without the effect; nothing by default.
        """
        left = self._misfit(effects)
        return left - self._misfit(reference) if reference else left

    def _misfit(self, effects: Effects) -> Array:
        key = repr(effects)
        if key not in self._seen:
            self._seen[key] = misfit(self.design, clean_readings(self.design, effects))
        return self._seen[key]

    def distinct(self, response: Array, besides: str = "") -> tuple[float, str]:
        """Norm of what the nearest single effect of the catalogue cannot imitate, and its id.

        `besides` is an effect that does not count, the planted one; "" when none comes near.
        """
        if self.others is None:
            self.others = self._catalogue()
        whole = float(np.linalg.norm(response))
        found = [(r.left(response), r.effect) for r in self.others if r.effect != besides]
        return min([(whole, ""), *found])

    def _catalogue(self) -> tuple[Rival, ...]:
        found = directions(self.fit, EFFECTS, campaign_scales(self.fit))
        return tuple(
            Rival(d.effect.id, self._project(_unit(np.concatenate(d.parts))), d.one_sided)
            for d in found
        )

    def _project(self, x: Array) -> Array:
        for _ in range(2):  # the second pass removes the rounding of the first
            x = x - self.basis @ (self.basis.T @ x)
        return x


def misfit(design: DrawnRig, readings: Sequence[Array]) -> Array:
    """What the base model, fitted to readings, leaves of them, (N,), in standard deviations."""
    fit = _fit(design, readings)
    left = np.concatenate([part.residual for part in fit.linearisation])
    return np.asarray(left / design.chain.noise)


def _noisy(design: DrawnRig, clean: Sequence[Array], rng: np.random.Generator) -> list[Array]:
    """Readings with the chain's noise."""
    chain = replace(design.chain, offsets={}, rounding=0.0)
    times = sampling(design.rate, design.duration)
    return [c + measure(np.zeros(times.size), times, Probe(), chain, "", rng) for c in clean]


def _fit(design: DrawnRig, readings: Sequence[Array]) -> Fit:
    """The base model fitted to readings, from the true parameters on."""
    recordings = tuple(
        Recording(release.name, release.case, reading, 1 / design.rate, quantity=design.quantity)
        for release, reading in zip(design.releases, readings, strict=True)
    )
    campaign = Campaign(
        "control", design.rig.mass, recordings, bool(design.rig.k2), design.measurement
    )
    oscillator = build_oscillator(campaign)
    chain = design.chain
    white = ((0.0, chain.white),) if chain.white else ()
    noise = Noise(chain.correlation, chain.smoothing, chain.noise, others=white)
    truth = true_parameters(design) | {"sigma": design.chain.noise}
    priors = [_wide(name, truth[name], design) for name in oscillator.layout.names]
    density = PosteriorDensity(Likelihood(oscillator, noise), Priors(tuple(priors)))
    return find_mode(density, np.array([truth[name] for name in oscillator.layout.names]))


def _wide(name: str, value: float, design: DrawnRig) -> Prior:
    if name == "sigma":
        return LogUniform(value / WIDE, value * WIDE)
    scales = {"v0": design.speed, "y0": design.amplitude, "offset": design.amplitude}
    return Normal(value, WIDE * scales.get(name.split("[")[0], abs(value)))


def _basis(fit: Fit) -> Array:
    """Orthonormal basis (N, d) of everything that the base model can change."""
    matrix = np.vstack([part.whole(fit.mode.size) for part in fit.linearisation])
    used = np.linalg.norm(matrix, axis=0) > 0
    return np.linalg.qr(_unit(matrix[:, used]))[0]


def _unit(matrix: Array) -> Array:
    """Columns scaled to length one."""
    return np.asarray(matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300))
