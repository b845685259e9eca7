"""Readings near known ones, for derivatives: under other forces of laws they are superposed.

A residual force has tens of coefficients. To first order each adds a small force along the known
motion, and what that does follows from the motion's free changes (`superposition`), where a
simulation each would cost the most of a fit. Some are simulated all the same: they say whether
superposition serves, which it does not where a law has a state of its own.

Stiffness, damping and all steady laws are superposed together or not at all: a sum of a residual
force's coefficients does what k1 or c1 does, and only errors of one kind cancel in the difference.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesimpact.model.jit.threads import in_shares
from bayesimpact.model.law_table import (
    CONTACT_ONLY,
    JUMP_AT_SURFACE,
    JUMP_AT_TURN,
    LAW_FIRST,
    LAW_FLAGS,
    LAW_RATE,
    LAW_TRAVEL,
)
from bayesimpact.model.linear_response.path_forces import add_forces
from bayesimpact.model.linear_response.superposition import Motion, answers, motion_along
from bayesimpact.model.oscillator import Oscillator
from bayesimpact.model.parameters import SLOTS

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

PAYS = 40  # motions from which on superposition costs less than they do
CHECKED = 3  # of them, by simulation
BLOCK = 64  # forces at once, so that memory stays bounded
_C1, _K1, _C2, _GAP, _K2, _OFFSET = (
    SLOTS.index(name) for name in ("c1", "k1", "c2", "g", "k2", "offset")
)


def readings_near(oscillator: Oscillator, r: int, theta: Array, error: float) -> Array:
    """`predict_recording` for parameters (B, d) close to the first ones, exact to first order.

    error : root of the sum of squares by which a motion may be wrong, in the recording's unit
    """
    q = oscillator.layout.slots_of(r, theta)
    q[:, _OFFSET] = 0.0
    superposable = _apart_by_forces(q, oscillator.laws)
    if superposable.size < PAYS or oscillator.campaign.stop:
        return oscillator.predict_recording(r, theta)
    checked = superposable[np.linspace(0, superposable.size - 1, CHECKED + 2).astype(int)[1:-1]]
    simulated = np.union1d(np.setdiff1d(np.arange(q.shape[0]), superposable), checked)
    motions = np.empty((q.shape[0], int(oscillator.counts[r])))
    motions[simulated] = oscillator.motions_of(np.full(simulated.size, r), q[simulated])
    if not np.isfinite(motions[0]).all():  # it ran away
        return oscillator.predict_recording(r, theta)
    superposed = motions[0] + _changes(oscillator, r, q[np.concatenate([[0], superposable])])
    wrong = superposed[np.searchsorted(superposable, checked)] - motions[checked]
    if not np.all(np.linalg.norm(wrong, axis=1) <= error):
        return oscillator.predict_recording(r, theta)
    motions[superposable] = superposed
    return oscillator.read(r, motions, theta)


def _apart_by_forces(q: Array, laws: Index) -> Index:
    """Which slots (B, Q) differ from the first by forces along the motion alone, ascending.

    None where no law is both steady and has so many of them that superposition pays.
    """
    apart = q != q[0]
    spans = [
        span
        for span, steady in zip(_spans(q.shape[1], laws), _is_steady(laws), strict=True)
        if steady
    ]
    if not any(apart[:, first:end].any(axis=1).sum() >= PAYS for first, end in spans):
        return np.zeros(0, dtype=np.int64)
    along = np.isin(np.arange(q.shape[1]), [_C1, _K1])
    for first, end in spans:
        along[first:end] = True
    return np.flatnonzero(apart[:, along].any(axis=1) & ~apart[:, ~along].any(axis=1))


def _spans(size: int, laws: Index) -> Index:
    """First slot and end of every law's parameters, (L, 2)."""
    ends = np.append(laws[1:, LAW_FIRST], size)[: laws.shape[0]]
    return np.stack([laws[:, LAW_FIRST], ends], axis=1)


def _is_steady(laws: Index) -> Flags:
    """Which laws act everywhere, without a state of their own and without jumps, (L,)."""
    free = laws[:, LAW_FLAGS] & (CONTACT_ONLY | JUMP_AT_TURN | JUMP_AT_SURFACE) == 0
    return np.asarray(free & (laws[:, LAW_RATE] == 0) & (laws[:, LAW_TRAVEL] == 0))


def _changes(oscillator: Oscillator, r: int, q: Array) -> Array:
    """By how much the motions of slots (1 + K, Q) differ from the first one, (K, n), superposed."""
    found = np.empty((q.shape[0] - 1, int(oscillator.counts[r])))
    y = oscillator.motions_of(np.array([r]), q[:1], np.array([0]))
    motion = motion_along(oscillator, r, q[0], float(np.abs(y).max()))
    for first in range(0, found.shape[0], BLOCK):
        rows = np.concatenate([q[:1], q[1 + first : 1 + first + BLOCK]])
        found[first : first + BLOCK] = answers(motion, force_changes(motion, rows, oscillator.laws))
    return found


def force_changes(motion: Motion, q: Array, laws: Index) -> Array:
    """By how much forces along a motion, N, differ from those of the first of slots (1 + K, Q):
    (K, n). Of the suspension, the obstacle and all laws, friction that may hold apart.
    """
    change = q[:, [_K1, _C1]] - q[0, [_K1, _C1]]
    out = change @ np.stack([motion.y, motion.v])
    if np.isfinite(motion.d).all():
        touching = motion.d > 0
        own = q[:, [_K2]] * (motion.y - q[:, [_GAP]]) + q[:, [_C2]] * motion.v
        out += np.where(touching, own - own[0], 0.0)
    for law, (first, end) in zip(laws, _spans(q.shape[1], laws), strict=True):
        rows = np.flatnonzero((q[:, first:end] != q[0, first:end]).any(axis=1))
        if rows.size == 0:
            continue
        known = np.zeros((1, motion.y.size))
        add_forces(law, motion.y, motion.v, motion.d, motion.t, q[:1], np.zeros(1, np.int64), known)

        def add(low: int, high: int, law: Index = law, rows: Index = rows) -> None:
            add_forces(law, motion.y, motion.v, motion.d, motion.t, q, rows[low:high], out)

        in_shares(add, rows.size)
        out[rows] -= known
    return out[1:]
