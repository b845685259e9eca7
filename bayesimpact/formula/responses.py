"""How the recordings would change under a small force of the state, without simulating it.

Every term of the grammar costs one sum over its own force history along the fitted motion
(`bayesimpact.model.linear_response.superposition`). A spline a(y) + b(y) v would show only what is
linear in v; the force history itself, scored on the residual, tells |v| v from v.

Of laws with a memory or a further mode in the fitted model only displacement and velocity are
perturbed; such a score is approximate, and the refit that follows is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.formula.grammar import ONE, Term
from bayesimpact.inference.fit import Fit
from bayesimpact.model.linear_response.superposition import Motion, answers, motion_along

Array = NDArray[np.float64]

Along = tuple[Array, Array, Array, Array]
"""Displacement m, velocity m/s, indentation m and time s along a motion, each (n,)."""

BLOCK = 64  # terms at once, so that memory stays bounded


def motion_of(fit: Fit, r: int) -> Motion:
    """The fitted motion of one recording and its free changes."""
    oscillator = fit.density.oscillator
    reach = float(np.abs(fit.displacements[r]).max())
    return motion_along(oscillator, r, oscillator.layout.slots(fit.mode)[r], reach)


def responses(motion: Motion, terms: Sequence[Term]) -> tuple[Array, Array, Array]:
    """What the probe would read of each term's force of unit size, before its filter.

    Returns
    -------
    responses (K, samples); the largest force of each term along the motion, (K,); its mean power
    with the motion, W, (K,)
    """
    out = np.empty((len(terms), motion.samples))
    largest, power = np.empty(len(terms)), np.empty(len(terms))
    for first in range(0, len(terms), BLOCK):
        block = slice(first, first + BLOCK)
        forces = forces_along(along(motion), terms[block])
        out[block] = answers(motion, forces)
        largest[block] = np.maximum(forces.max(axis=1), -forces.min(axis=1))
        power[block] = forces @ motion.v / motion.v.size
    return out, largest, power


def along(motion: Motion) -> Along:
    """The path of a motion."""
    return motion.y, motion.v, motion.d, motion.t


def forces_along(path: Along, terms: Sequence[Term]) -> Array:
    """Force of each term of unit size along a path y, v, d, t (n,), (K, n); factors that terms
    share are computed once.
    """
    y, v, d, t = path
    out = np.empty((len(terms), y.size))
    known: dict[object, Array] = {}
    for i, term in enumerate(terms):
        where = replace(term, speed=ONE, fade=0.0, drift=0, lorentzian=False)
        if where not in known:
            known[where] = where.of_position(y, d)
        speed = (term.speed, term.fade, term.lorentzian)
        if speed not in known:
            known[speed] = term.of_speed(v)
        np.multiply(known[where], known[speed], out=out[i])
        if term.drift:
            out[i] *= t
    return out


def largest_force(
    motions: Sequence[Motion], terms: Sequence[Term], sizes: Sequence[float]
) -> float:
    """Peak of the force of some terms together along all motions, N."""
    weights = np.array(sizes)
    return max(float(np.abs(weights @ forces_along(along(m), terms)).max()) for m in motions)
