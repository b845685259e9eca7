"""What a model predicts of a recording that has not been made, with its sensitivities.

Parameters that the new recording shares with the campaign keep their posterior. Those of its own
(start values, rest reading, phases, the place of a stop that was moved) are nearly unknown: the
recording itself will tell them, so whatever they can imitate tells no models apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign, Measurement
from bayesimpact.data.recording import Recording
from bayesimpact.design.beliefs import belief
from bayesimpact.design.candidates import PlannedRecording, usual_release
from bayesimpact.design.hypotheses import FittedModel, Rivalry
from bayesimpact.design.odds import Odds, PredictedRecording, expected_odds
from bayesimpact.inference.likelihood import Likelihood
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.oscillator import Oscillator, build_oscillator
from bayesimpact.model.parameters import SLOTS, bare_name

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ROUNDS = 12
"""Steps at most by which a rival's parameters imitate another model."""
DAMPING = (0.0, 1e-6, 1e-4, 1e-2, 1.0)
"""Of a step, the next where one leads uphill: along a curve the linear problem points too far."""
CONVERGED = 0.02
"""They stop where the sum of squares is what the linear problem promised, or falls no more, but for
so much of it.
"""


@dataclass(frozen=True, eq=False)
class Response:
    """A model's response to a design.

    Attributes
    ----------
    likelihood : of the one recording, whose samples are 0
    shared, own : positions in its theta of what it shares with the campaign, and of its own
    known : (s,) positions of the shared ones in the hypothesis
    mean : (d,) of all parameters before the recording is made
    prior : (k, k) covariance of shared and own ones, in this order
    steps : (d,) for differences
    sigma : level of the noise, in which everything is counted
    """

    likelihood: Likelihood
    shared: Index
    own: Index
    known: Index
    mean: Array
    prior: Array
    steps: Array
    sigma: float

    @property
    def moving(self) -> Index:
        """Positions in theta of all parameters, shared ones first, (k,)."""
        return np.concatenate([self.shared, self.own])

    def admissible(self, shift: Array) -> Array:
        """Parameters (d,) that are shifted (k,) from their means as far as their bounds allow."""
        parameters = self.likelihood.oscillator.layout.parameters
        theta = self.mean.copy()
        theta[self.moving] += shift
        return np.clip(theta, [p.lower for p in parameters], [p.upper for p in parameters])

    @cached_property
    def root(self) -> Array:
        """R with R R' = prior, (k, k); shared and own parameters apart."""
        count = self.shared.size
        found = np.diag(np.sqrt(np.diag(self.prior)))
        block = self.prior[:count, :count]
        scale = np.sqrt(np.diag(block))
        scale = np.where(scale > 0, scale, 1.0)
        values, vectors = np.linalg.eigh(block / np.outer(scale, scale))
        found[:count, :count] = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return found

    @cached_property
    def precision(self) -> Array:
        """Inverse of `prior`, (k, k)."""
        scale = np.sqrt(np.diag(self.prior))
        scale = np.where(scale > 0, scale, 1.0)
        unit = np.linalg.pinv(self.prior / np.outer(scale, scale), rcond=1e-13, hermitian=True)
        return np.asarray(unit / np.outer(scale, scale))

    def predicted(self, theta: Array) -> Array:
        """Whitened reading (n,) in units of the noise; NaN where the motion fails."""
        return np.asarray(-self.likelihood.residuals(theta[None])[0][0] / self.sigma)

    def linearised(self, theta: Array) -> tuple[Array, Array]:
        """The same and its derivatives (n, k) with respect to the `moving` parameters."""
        (part,) = self.likelihood.linearise(theta, self.steps)
        jacobian = part.whole(theta.size)[:, self.moving]
        return -part.residual / self.sigma, jacobian / self.sigma

    @cached_property
    def at_mean(self) -> tuple[Array, Array]:
        """`linearised` at the mean."""
        return self.linearised(self.mean)

    @cached_property
    def prediction(self) -> PredictedRecording:
        """The model's Gaussian for the recording."""
        mean, jacobian = self.at_mean
        return PredictedRecording(mean, jacobian @ self.root, self.shared.size)

    @property
    def is_finite(self) -> bool:
        """False where the motion fails, or runs away."""
        prediction = self.prediction
        return bool(np.isfinite(prediction.mean).all() and np.isfinite(prediction.factor).all())


def odds_between(right: Response, other: Response, draws: Array) -> Odds:
    """ln odds that the design is expected to give one model, were it right, over the other.

    The difference is imitated by the other model's parameters as far as their posterior allows: one
    linear projection, and again from where it leads while that gains. `draws` (S, shared) are
    standard normal numbers.
    """
    goal = right.prediction.mean
    theta, shift = other.mean, np.zeros(other.prior.shape[0])
    (mean, jacobian), prediction = other.at_mean, other.prediction
    left = goal - mean
    distance = float(left @ left)
    for _ in range(ROUNDS):
        curvature = jacobian.T @ jacobian + other.precision
        downhill = jacobian.T @ left - other.precision @ shift
        least = distance
        for damping in DAMPING:
            trial = other.admissible(shift + solved(curvature, downhill, damping))
            moved = trial[other.moving] - other.mean[other.moving]
            remaining = goal - other.predicted(trial)
            least = float(remaining @ remaining + moved @ other.precision @ moved)
            if least < distance:
                break
        if not least < distance:
            break
        promised = left - jacobian @ (moved - shift)
        hoped = float(promised @ promised + moved @ other.precision @ moved)
        near = min(abs(least - hoped), distance - least)
        done = damping == 0.0 and near < CONVERGED * (least + 1)
        distance, theta, shift, left = least, trial, moved, remaining
        if done:
            break
        mean, jacobian = other.linearised(theta)
        if not np.isfinite(jacobian).all():
            break
        prediction = PredictedRecording(mean, jacobian @ other.root, other.shared.size)
    return expected_odds(right.prediction, prediction, draws, left, distance)


def solved(matrix: Array, vector: Array, damping: float) -> Array:
    """Solution of a positive definite system whose unknowns differ much in size.

    `damping` is added to the diagonal of the matrix scaled to ones (Marquardt 1963).
    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    unit = matrix * np.outer(scale, scale) + damping * np.eye(scale.size)
    found, *_ = np.linalg.lstsq(unit, scale * vector, rcond=1e-14)
    return np.asarray(scale * found)


def response(hypothesis: FittedModel, design: PlannedRecording, rivals: Rivalry) -> Response:
    """A model's response to a design."""
    name = new_name(rivals)
    o = oscillator(hypothesis, design, rivals, name)
    mean, sd, steps, known = np.array(
        [belief(hypothesis, o, n, design, rivals) for n in o.layout.names]
    ).T
    columns = o.recording_columns(0)
    shared = np.array([i for i in columns if known[i] >= 0], dtype=np.int64)
    own = np.array([i for i in columns if known[i] < 0], dtype=np.int64)
    position = known[shared].astype(np.int64)
    prior = np.zeros((columns.size, columns.size))
    prior[: shared.size, : shared.size] = hypothesis.covariance[np.ix_(position, position)]
    prior *= rivals.repetition
    prior[shared.size :, shared.size :] = np.diag(sd[own] ** 2)
    likelihood = Likelihood(o, noise_at(design.interval, rivals))
    return Response(likelihood, shared, own, position, mean, prior, steps, noise_level(rivals))


def noise_at(interval: float, rivals: Rivalry) -> Noise:
    """The noise at another sampling interval: its level stays, its correlation time too."""
    usual = usual_release(rivals.releases).interval
    noise = rivals.noise

    def after(correlation: float) -> float:
        return float(max(correlation, 0.0) ** (interval / usual))

    others = tuple((after(correlation), share) for correlation, share in noise.others)
    return replace(noise, correlation=after(noise.correlation), others=others)


def noise_level(rivals: Rivalry) -> float:
    """Level of the raw noise by the first model, the same for all, for each independent sample."""
    first = rivals.hypotheses[0]
    levels = [first.mode[i] for n, i in first.known.items() if bare_name(n) == "sigma"]
    return float(np.median(levels)) * sqrt(rivals.repetition)


def new_name(rivals: Rivalry) -> str:
    """A name that no recording and no case has."""
    taken, name = {n for r in rivals.releases for n in (r.name, r.case)}, "next"
    while name in taken:
        name += "'"
    return name


def oscillator(
    hypothesis: FittedModel, design: PlannedRecording, rivals: Rivalry, name: str
) -> Oscillator:
    """A model of the one recording, whose samples are 0."""
    blank = Recording(
        name, design.case, np.zeros(design.samples), design.interval, quantity=rivals.quantity
    )
    measurement = Measurement(smoothing=rivals.noise.smoothing)
    campaign = Campaign("next", rivals.mass, (blank,), rivals.stop, measurement)
    made = build_oscillator(campaign, hypothesis.effects)
    if design.stop or not rivals.stop:
        return made
    columns, constants = made.layout.columns.copy(), made.layout.constants.copy()
    for slot, value in (("g", np.inf), ("k2", 0.0), ("c2", 0.0)):
        columns[:, SLOTS.index(slot)] = -1
        constants[:, SLOTS.index(slot)] = value
    return replace(made, layout=replace(made.layout, columns=columns, constants=constants))
