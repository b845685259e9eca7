"""What the rig is made of while one recording runs: its constants, added parts, smooth pieces.

A motion is cut into pieces on which every force is smooth. A piece knows on which side of every
kink it lies, so a force law built for it has no branches and may be continued a little beyond the
ends of the piece: the integrator keeps its order and locates the ends on smooth functions.
All forces stand on the left-hand side of m y'' + ... = 0, in N; displacements in m, velocities
in m/s, times in s from the recording's first sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

State = list[float]
"""[y, v, then the states of added parts]."""

Law = Callable[[float, float, float, State], float]
"""(t, y, v, state) -> force in N, smooth on its piece."""

Rates = Callable[[float, float, float, State], tuple[float, ...]]
"""(t, y, v, state) -> time derivatives of a part's own states."""

Heard = Callable[[float, State], tuple[float, ...]]
"""(force between obstacle and mass, state) -> time derivatives of a part's own states."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A stretch of motion without a kink.

    Attributes
    ----------
    contact : whether the mass and the obstacle are in contact
    gap : displacement of the obstacle at rest, m
    sign : of the velocity; 0 while dry friction holds the mass
    low, high : the neighbouring displacements at which some law has a kink, m
    """

    contact: bool
    gap: float
    sign: int
    low: float
    high: float

    def above(self, displacement: float) -> bool:
        """Whether the piece lies above this kink."""
        return self.low >= displacement


@dataclass(frozen=True)
class RigPart:
    """Something added to the base oscillator; what it does not have stays at its default.

    Attributes
    ----------
    law : Piece -> its force there, or None where it has none
    in_reaction : whether the force acts between obstacle and mass, so that it counts when
        `Site.unilateral` decides about the end of a contact
    friction : Piece -> level of dry friction as a function of the velocity (N), or None; the force
        is sign(v) * level(v), and at rest anything up to level(0)
    states : initial values of own states
    rates : Piece -> time derivatives of the own states
    heard : in place of `rates`, where the states follow the force between obstacle and mass
    felt : in place of `rates`, where the states follow the acceleration of the mass
    struck : (state, impulse of the obstacle on the mass, N s) changes own states at contact onset
    seen : positions in the state of what the probe sees beside the mass
    kinks : displacements at which the law is not smooth, m
    depths : the same, counted from the current gap, m
    times : instants at which the law is not smooth, s
    period : shortest period of an explicit dependence on time, s
    """

    law: Callable[[Piece], Law | None] | None = None
    in_reaction: bool = False
    friction: Callable[[Piece], Callable[[float], float] | None] | None = None
    states: tuple[float, ...] = ()
    rates: Callable[[Piece], Rates] | None = None
    heard: Heard | None = None
    felt: Callable[[float, float, float, State], tuple[float, ...]] | None = None
    struck: Callable[[State, float], None] | None = None
    seen: tuple[int, ...] = ()
    kinks: tuple[float, ...] = ()
    depths: tuple[float, ...] = ()
    times: tuple[float, ...] = ()
    period: float = inf


@dataclass(frozen=True)
class Site:
    """The rig as one recording sees it.

    Attributes
    ----------
    mass, c1, k1, c2, gap, k2 : of the base oscillator, SI; gap = inf without an obstacle
    name, case : of the recording
    y0, v0 : at the first sample, m and m/s
    unilateral : contact ends when the obstacle's reaction falls to zero, not at the gap
    obstacle_mass : picked up at impact, kg
    adhesion : pull that an obstacle with `unilateral` stands before it lets go, N
    restitution : share of the speed that is left after the instant of an impact
    gap_step : growth of the gap at the end of every contact, m
    """

    mass: float
    c1: float
    k1: float
    c2: float
    gap: float
    k2: float
    name: str
    case: str
    y0: float
    v0: float
    unilateral: bool = False
    obstacle_mass: float = 0.0
    adhesion: float = 0.0
    restitution: float = 1.0
    gap_step: float = 0.0
