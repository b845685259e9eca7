"""The unexplained force as arrays, less what a change of the base parameters could imitate.

A force proportional to y, v, 1 and, beyond the gap, to y - g, v, 1 is what changes of k1, c1, the
rest reading, k2, c2 and g look like: the recordings cannot tell such a part of the unexplained
force from a change of these parameters. It is taken out by least squares along the motion, so that
the band shows what is known of the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from bayesimpact.diagnosis.loop import Diagnosis
from bayesimpact.diagnosis.residual_force.gaussian_process import MissingForce, trajectory_points
from bayesimpact.diagnosis.residual_force.learned import LEARNED, Knots, knots_of
from bayesimpact.diagnosis.selection.unknown import coefficient_names
from bayesimpact.inference.fit import Fit
from bayesimpact.model.parameters import SLOTS
from bayesimpact.report.results import Array

POINTS = 240  # displacements at which forces are kept
_BINS = 48  # of displacement, to find which velocities were met
QUIET_WIDTH = 0.01  # prior width where nothing is missing, of the elastic force
_GAP = SLOTS.index("g")


def force_arrays(d: Diagnosis) -> dict[str, Array]:
    """Arrays by name, (POINTS,) along the displacement unless said otherwise.

    force_y, force_v_low, force_v_high : displacement, m; slowest and fastest velocity met there
    force_a, force_b : conservative part, N, and dissipative part over the velocity, N s/m
    force_a_sd, force_b_sd, force_ab : their standard deviations and covariance
    left_a, ... : the same of what the chosen model leaves, under the same prior
    learned_a, learned_b : of the force that was learned together with the parameters
    gap : (1,) of the base model, m; absent without a stop
    """
    force, fit = d.force, d.selection.base.candidate.fit
    y = np.linspace(force.low, force.low + force.spacing * (force.knots - 3), POINTS)
    slow, fast = _velocities(fit, y)
    rest = Rest(knots_of(force.effect), fit, y)
    arrays = {"force_y": y, "force_v_low": slow, "force_v_high": fast}
    if d.verdict == "adequate":
        unit = d.scales.force, d.scales.force / d.scales.speed
        width = QUIET_WIDTH * np.repeat(unit, force.knots)
        return arrays | rest.gap | rest.parts("force", *_posterior(force, width))
    arrays |= rest.gap | rest.parts("force", force.mean, force.covariance)
    if d.selection.chosen is not d.selection.base:
        left = d.selection.chosen.force
        width = np.repeat(
            [force.effect.parameter(n).scale(d.scales) for n in ("a1", "b1")], left.knots
        )
        beside = Rest(knots_of(left.effect), d.selection.chosen.candidate.fit, y)
        arrays |= beside.parts("left", *_posterior(left, width))
    learned = [e for e in d.after.density.oscillator.effects if e.id == LEARNED]
    if learned and (knots := knots_of(learned[0])).reach == 0.0:
        values = dict(zip(d.after.names, d.after.mode, strict=True))
        own = np.array([values[n] for n in coefficient_names(knots.count)])
        maps = Rest(knots, fit, y).maps
        arrays |= {f"learned_{part}": maps[part] @ own for part in "ab"}
    return arrays


def _posterior(force: MissingForce, width: Array) -> tuple[Array, Array]:
    """Mean and covariance of the coefficients under normal priors of given widths (2 knots,)."""
    scaled = force.projection.information * np.outer(width, width)
    inverse = np.linalg.inv(np.eye(width.size) + scaled)
    covariance = inverse * np.outer(width, width)
    return covariance @ force.projection.score, covariance


@dataclass(frozen=True, eq=False)
class Rest:
    """From coefficients to what no change of the base parameters imitates.

    Attributes
    ----------
    maps : "a" and "b" -> (POINTS, 2 knots)
    gap : name and value, or empty
    """

    maps: dict[str, Array]
    gap: dict[str, Array]

    def __init__(self, knots: Knots, fit: Fit, y: Array) -> None:
        oscillator = fit.density.oscillator
        gap = None
        if oscillator.campaign.stop:
            gap = float(np.mean(oscillator.layout.slots(fit.mode)[:, _GAP]))
        points = trajectory_points(fit)
        along, v = (np.concatenate([p[k] for p in points]) for k in (0, 1))
        splines = knots.basis(along)
        functions = np.hstack([splines, splines * v[:, None]])
        still, moving = _imitable(along, gap)
        imitated = np.linalg.lstsq(np.hstack([still, moving * v[:, None]]), functions, rcond=None)[
            0
        ]
        here = knots.basis(y)
        nothing = np.zeros_like(here)
        still, moving = _imitable(y, gap)
        count = still.shape[1]
        maps = {
            "a": np.hstack([here, nothing]) - still @ imitated[:count],
            "b": np.hstack([nothing, here]) - moving @ imitated[count:],
        }
        object.__setattr__(self, "maps", maps)
        object.__setattr__(self, "gap", {} if gap is None else {"gap": np.array([gap])})

    def parts(self, name: str, mean: Array, covariance: Array) -> dict[str, Array]:
        """Both parts and their standard deviations, from coefficients."""
        a, b = self.maps["a"], self.maps["b"]
        return {
            f"{name}_a": a @ mean,
            f"{name}_b": b @ mean,
            f"{name}_a_sd": np.sqrt(np.einsum("ni,ij,nj->n", a, covariance, a).clip(0)),
            f"{name}_b_sd": np.sqrt(np.einsum("ni,ij,nj->n", b, covariance, b).clip(0)),
            f"{name}_ab": np.einsum("ni,ij,nj->n", a, covariance, b),
        }


def _imitable(y: Array, gap: float | None) -> tuple[Array, Array]:
    """What base parameters imitate: functions of y (n, k), and those that multiply v (n, l)."""
    one = np.ones_like(y)
    if gap is None:
        return np.stack([one, y], axis=1), one[:, None]
    beyond = np.where(y >= gap, 1.0, 0.0)
    return np.stack([one, y, beyond, beyond * (y - gap)], axis=1), np.stack([one, beyond], axis=1)


def _velocities(fit: Fit, y: Array) -> tuple[Array, Array]:
    """Lowest and highest velocity that the fitted motion has near displacements (n,), m/s."""
    points = trajectory_points(fit)
    where, velocity = (np.concatenate([p[k] for p in points]) for k in (0, 1))
    edges = np.linspace(y[0], y[-1], _BINS + 1)
    cell = np.clip(np.searchsorted(edges, where) - 1, 0, _BINS - 1)
    met = np.flatnonzero(np.bincount(cell, minlength=_BINS))
    middle = 0.5 * (edges[1:] + edges[:-1])[met]
    low, high = (
        maximum_filter1d([np.max(sign * velocity[cell == i]) for i in met], 3, mode="nearest")
        for sign in (-1.0, 1.0)
    )
    return np.interp(y, middle, -low), np.interp(y, middle, high)
