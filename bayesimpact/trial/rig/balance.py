"""The equation of motion on one smooth piece: base oscillator plus parts, in plain floats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.trial.rig.parts import Law, Piece, RigPart, Site, State

STILL = 1e-13
"""Force that does not set a resting mass in motion, N: rounding must not keep a dead rig busy."""


@dataclass(frozen=True)
class Balance:
    """What moves the mass on one piece.

    Attributes
    ----------
    drive : sum of all forces but dry friction, N
    reaction : (t, state) -> force that the obstacle exerts on the mass, N, positive when it pushes
    rhs : (t, state) -> time derivative of the state
    level : force up to which the mass stays at rest, N: dry friction, at least STILL
    """

    drive: Law
    reaction: Callable[[float, State], float]
    rhs: Callable[[float, NDArray[np.float64]], State]
    level: float


def balance(site: Site, parts: tuple[RigPart, ...], piece: Piece) -> Balance:
    """Sum up the base oscillator and its added parts for one piece of the motion."""
    c1, k1, c2, k2, gap = site.c1, site.k1, site.c2, site.k2, piece.gap
    sign, contact = piece.sign, piece.contact
    carried = site.obstacle_mass if contact else 0.0
    inertia = site.mass + carried
    laws = [(p.in_reaction, p.law(piece)) for p in parts if p.law is not None]
    free = [law for inside, law in laws if law is not None and not inside]
    contact_laws = [law for inside, law in laws if law is not None and inside]
    levels = [p.friction(piece) for p in parts if p.friction is not None]
    dry = [level for level in levels if level is not None]
    rates = [
        (p.rates(piece) if p.rates is not None else None, p.heard, p.felt)
        for p in parts
        if p.states
    ]

    def contact_force(t: float, y: float, v: float, state: State) -> float:
        total = c2 * v + k2 * (y - gap)
        for law in contact_laws:
            total += law(t, y, v, state)
        return total

    def drive(t: float, y: float, v: float, state: State) -> float:
        total = c1 * v + k1 * y
        if contact:
            total += contact_force(t, y, v, state)
        for law in free:
            total += law(t, y, v, state)
        return total

    def acceleration(t: float, y: float, v: float, state: State) -> float:
        if sign == 0:
            return 0.0
        total = drive(t, y, v, state)
        for level in dry:
            total += sign * level(v)
        return -total / inertia

    def reaction(t: float, state: State) -> float:
        y, v = state[0], state[1]
        return contact_force(t, y, v, state) + carried * acceleration(t, y, v, state)

    def rhs(t: float, array: NDArray[np.float64]) -> State:
        state: State = array.tolist()
        y, v = state[0], state[1]
        slope = [v, acceleration(t, y, v, state)]
        for rate, heard, felt in rates:
            if rate is not None:
                slope.extend(rate(t, y, v, state))
            elif heard is not None:
                slope.extend(heard(reaction(t, state) if contact else 0.0, state))
            elif felt is not None:
                slope.extend(felt(slope[1], y, v, state))
        return slope

    holds = max(STILL, sum(level(0.0) for level in dry))
    return Balance(drive, reaction, rhs, holds)
