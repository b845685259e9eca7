"""What a model leaves beside the noise, as a force of time that no law of the motion has.

Where something remains, a recording is its model's prediction, white noise and the response to a
force f(t), piecewise linear on `KNOTS` knots a free period with independent normal values. To first
order that is D c, with D superposed along the fitted motion, so that the residual, linear in a
change x of the parameters, has the closed-form marginal likelihood

    r ~ N(J x, w^2 (1 + k D D')),        k = (size at the knots / level of the noise)^2,

with w and k at their maximum: the recordings say how large the force is (model error inside the
likelihood: Kennedy and O'Hagan 2001, J. R. Stat. Soc. B 63:425; embedded as a force: Sargsyan, Najm
and Ghanem 2015, Int. J. Chem. Kinet. 47:246).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from bayesimpact.diagnosis.refits.sizes import (
    named_size_of,
    shapes_in_base,
    shapes_until,
    sizes_of,
)
from bayesimpact.diagnosis.residual_force.gaussian_process import whitened_one
from bayesimpact.diagnosis.residual_force.hidden import about, parameter_forces
from bayesimpact.diagnosis.residual_force.marginal import Part, log_evidence_gain, products
from bayesimpact.diagnosis.thresholds import DOUBT
from bayesimpact.formula.responses import motion_of
from bayesimpact.inference.fit import Fit, inverse
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.linear_response.superposition import Motion, answers

Array = NDArray[np.float64]

KNOTS = 8  # in a free period: a force at its own frequency, or in one contact, is resolved
# ... in recordings of up to so many knots, whose matrices are quick; without a stop, longer ones
# get fewer in a period. Of a decay with a missing cubic spring, drag or friction 4 leave 0.1 to
# 3.4 % more than 8, 2.5 leave 1 to 70 %; of a law in contact 4 leave twice the noise.
QUICK, FEWEST = 640, 4
ENTRIES = 20_000_000  # of the largest matrix D that is held; longer recordings get fewer knots
BLOCK = 64  # forces at once, so that memory stays bounded
# Nats by which derivatives at a mode may underrate a model beside the force: 15 at most among the
# 60 models of a strong trial (seed 207146) that came within 30 of the likeliest one.
UNDERRATED = 60.0
RMS = np.sqrt(2.0 / 3.0)  # of a force between knots of unit size
ALIGNED = 1.0  # of what a parameter hides of a missing force, over what remains; not calibrated


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """A force of time beside a fit.

    Attributes
    ----------
    fit : whose remainder it is
    motions : per recording, along which it acts
    parts : per recording
    k : variance of its values at the knots, N2, over that of the noise as estimated, 1
    level : of the noise beside it, over its estimate
    values : at the knots of every recording, what the remainder says of them, (K,)
    """

    fit: Fit
    motions: tuple[Motion, ...] = field(repr=False)
    parts: tuple[Part, ...] = field(repr=False)
    k: float
    level: float
    values: tuple[Array, ...] = field(repr=False)
    _gains: dict[Fit, tuple[float, float]] = field(default_factory=dict, repr=False)

    def log_evidence_gain(self, fit: Fit, alone: float) -> float:
        """What a force of time along this fit's motion adds to a model's log evidence, which is
        `alone` without one. To first order where the model lies far behind the likeliest so far.
        """
        if fit not in self._gains:
            reached = max((one + more for one, more in self._gains.values()), default=-np.inf)
            least = reached - UNDERRATED - alone
            self._gains[fit] = alone, log_evidence_gain(fit, self.parts, least)
        return self._gains[fit][1]

    @property
    def leaves_noise(self) -> bool:
        """Whether what is left beside the force is noise of the level estimated: else it is no
        force of time that remains, as where an encoder errs, and odds beside one mean little.
        """
        error = self.fit.density.likelihood.noise.level_error
        return self.level**2 <= 1.0 + 2 * DOUBT * (error if np.isfinite(error) else 0.0)

    @property
    def power(self) -> float:
        """Of the force about the motion's own frequencies, N2."""
        return self.flat * self.level**2

    @property
    def forces(self) -> tuple[Array, ...]:
        """At the samples of every recording, (n,), N, the parameters as fitted."""
        found = []
        for values, motion in zip(self.values, self.motions, strict=True):
            at = np.linspace(0.0, values.size - 1.0, motion.samples)
            found.append(np.interp(at, np.arange(values.size), values))
        return tuple(found)

    @cached_property
    def flat(self) -> float:
        """k of a force as strong at all frequencies as this one is about those of the motion."""
        strength = weight = 0.0
        for force, motion in zip(self.forces, self.motions, strict=True):
            y = motion.y[:: motion.factor]
            own = about(np.abs(np.fft.rfft(y - y.mean())) ** 2, y)
            strength += float(own @ np.abs(np.fft.rfft(force)) ** 2) / y.size**2
            weight += float(own.sum())
        knots = np.mean([values.size for values in self.values])
        return float(knots * strength / weight / (RMS * self.level) ** 2)

    @cached_property
    def covariance(self) -> Array:
        """Covariance (d, d) of the fit's mode under noise and force; nowhere wider than priors.

        The mode weighs the recordings as if all it leaves were white; of such an estimate the
        scores' covariance takes the place of their information (Huber 1967; Godambe 1960), beside
        the priors' own. The noise level keeps its own.
        """
        fit, prior = self.fit, _prior_information(self.fit)
        level = fit.density.likelihood.noise.level
        sigma = fit.mode[fit.density.likelihood.sigma_columns]
        scores = np.diag(prior)
        for part, lin, own in zip(self.parts, fit.linearisation, sigma, strict=True):
            jacobian = lin.jacobian / level
            along = part.responses.T @ jacobian
            noise = (level * self.level / own) ** 2 * (level / own) ** 2
            where = np.ix_(lin.columns, lin.columns)
            scores[where] += noise * (jacobian.T @ jacobian + self.flat * along.T @ along)
        covariance = fit.covariance @ scores @ fit.covariance
        held = fit.density.oscillator.layout.roles("noise")
        covariance[held], covariance[:, held] = 0.0, 0.0
        covariance[held, held] = fit.sd[held] ** 2
        return np.asarray(covariance)

    @cached_property
    def posterior(self) -> tuple[Array, Array]:
        """Mean (d,) and covariance (d, d) of the parameters with all that the remainder may have
        done to them (`hidden`).
        """
        fit, forces = self.fit, parameter_forces(self.fit, self.motions)
        back, learned = forces.whole()
        mean, scatter = back @ fit.mode, back @ self.covariance @ back.T
        hidden = [forces.imitations(left) for left in (self.forces, learned)]
        hidden.append(mean - fit.mode)  # given back, though the force may have it by right
        kinds = np.array([name.split("[")[0] for name in fit.names])
        alike = kinds[:, None] == kinds  # gaps of all recordings err together
        return mean, scatter + alike * ALIGNED**2 * sum(np.outer(h, h) for h in hidden)

    def apart(self, effect: Effect) -> float:
        """Standard deviations of an effect from none at all: of the size that it is called by, its
        largest instance, the shapes as fitted, for without a size no other shape does more; or of
        a shape, the size as it may be, from where the law is one of the base model's
        (`EffectParameter.in_base`), or below where it is not what it is called (`until`), whichever
        is less. Infinite where it has no size.
        """
        sizes, shapes = named_size_of(self.fit, effect), sizes_of(self.fit, effect)[1]
        found = [] if sizes else [np.inf]
        for i, null in sizes:
            part = inverse(self.posterior[1][np.ix_([i, *shapes], [i, *shapes])])
            found.append(abs(float(self.fit.mode[i]) - null) * part[0, 0] ** 0.5)
        beside = [
            abs(float(self.fit.mode[i]) - value) / self.posterior[1][i, i] ** 0.5
            for i, value in shapes_in_base(self.fit, effect)
        ]
        below = [
            (value - float(self.fit.mode[i])) / self.posterior[1][i, i] ** 0.5
            for i, value in shapes_until(self.fit, effect)
        ]
        return float(min([max(found), *beside, *below]))


def discrepancy(fit: Fit) -> Discrepancy | None:
    """The force of time that the remainder of a fit asks for; None where the fitted motion is none
    that a small force could change: it ran away, or does not move.
    """
    stiffness = fit.value("k1")
    if not (stiffness > 0 and all(np.isfinite(y).all() and np.ptp(y) for y in fit.displacements)):
        return None
    period = 2 * np.pi * float(np.sqrt(fit.density.oscillator.campaign.mass / stiffness))
    try:
        motions = tuple(motion_of(fit, r) for r in range(len(fit.linearisation)))
        parts = tuple(_part(fit, r, motion, period) for r, motion in enumerate(motions))
        return Discrepancy(fit, motions, parts, *_sized(fit, parts))
    except np.linalg.LinAlgError:
        return None


def _part(fit: Fit, r: int, motion: Motion, period: float) -> Part:
    duration, n = float(motion.t[-1]), motion.samples
    cycles = duration / period
    most = max(QUICK, (KNOTS if fit.density.oscillator.campaign.stop else FEWEST) * cycles)
    wanted = min(KNOTS * cycles, most)
    count = int(np.clip(np.ceil(wanted), 1, max(ENTRIES // n, 2))) + 1
    knots = np.linspace(0.0, duration, count)
    raw = np.empty((count, n))
    for first in range(0, count, BLOCK):
        near = knots[first : first + BLOCK, None]
        tents = np.maximum(1.0 - np.abs(motion.t - near) / knots[1], 0.0)
        raw[first : first + BLOCK] = answers(motion, tents)
    level = np.full(r + 1, fit.density.likelihood.noise.level)
    white = whitened_one(fit, r, raw, level)
    squares, vectors = np.linalg.eigh(white @ white.T)
    return Part(white.T @ vectors, np.maximum(squares, 0.0), vectors)


def _prior_information(fit: Fit) -> Array:
    """Of the priors at the mode, (d,); the noise level is held."""
    information = fit.density.priors.information(fit.mode)
    information[fit.density.oscillator.layout.roles("noise")] = 1.0
    return np.asarray(information)


def _sized(fit: Fit, parts: tuple[Part, ...]) -> tuple[float, float, tuple[Array, ...]]:
    """The likeliest k and level of the noise, the parameters at their best; and values at the
    knots, the parameters as fitted.
    """
    found = products(fit, parts, fit.linearisation)

    def left(log_k: float) -> tuple[float, float]:
        """Minus twice the log likelihood, and the noise's variance."""
        matrix, volume = found.beside(log_k)
        score = matrix[:-1, -1]
        rest = float(matrix[-1, -1] - score @ inverse(matrix[:-1, :-1]) @ score)
        variance = max(rest, 1e-300) / found.total
        return found.total * float(np.log(variance)) + volume, variance

    best = minimize_scalar(lambda x: left(x)[0], bounds=found.bounds, method="bounded")
    variance = left(float(best.x))[1]
    k = float(np.exp(best.x))
    turned = k / (1.0 + k * found.squares) * found.along[:, -1]
    own = np.split(turned, np.cumsum([part.squares.size for part in parts])[:-1])
    values = tuple(np.asarray(part.vectors @ one) for part, one in zip(parts, own, strict=True))
    return k, float(np.sqrt(variance)), values
