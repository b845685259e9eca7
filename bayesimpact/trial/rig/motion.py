"""The rig's motion, integrated from event to event with SciPy's DOP853.

An independent twin of the package's own simulators: it shares no code and no method with them.
Every turning point ends a piece, so the displacement is monotone on a piece, and a surface
y = const is crossed once or not at all: no impact is lost between two steps, however short. Events
are located on the integrator's dense output.

When contact ends for a unilateral obstacle (contact_no_tension, obstacle_mass, adhesion): at the
first instant at which its reaction falls through zero (adhesion: through -F); a contact in which
the reaction never was positive (a graze) ends at the gap. After that the mass is free until it has
gone below the gap. The reaction is m2 y'' + c2 y' + k2 d + whatever other parts act between
obstacle and mass.

References: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I (1993), II.5-6.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

from bayesimpact.errors import SimulationError
from bayesimpact.trial.rig.balance import Balance, balance
from bayesimpact.trial.rig.parts import Piece, RigPart, Site, State

_FLIGHT, _CONTACT, _RELEASED = range(3)  # released: left by a unilateral obstacle, still above g
_TURN, _SURFACE, _REACTION, _SLIP = range(4)
_Integrator: Any = DOP853  # its type stubs, where installed, ask for arrays only
# At most so many steps, and so many more in a free period: some seconds. A pulse of 0.1 ms takes
# 8,000 in all and a usual period 20 to 150; a law stiff throughout takes thousands in each.
_STEPS, _PER_PERIOD = 20_000, 500
_STALLS = 50  # pieces in a row that may last less than a femtosecond before giving up


@dataclass(frozen=True, eq=False)
class RigMotion:
    """The true motion at the sampling instants.

    Attributes
    ----------
    times : (n,), s
    displacement, velocity : (n,), m and m/s; the displacement is that of the place at which the
        probe looks, further modes included
    acceleration : (n,), m/s2, of the mass, by its equation of motion; a sample at the very end of
        a contact or a flight takes what follows
    onsets, ends : instants at which contacts began and ended, s
    """

    times: NDArray[np.float64]
    displacement: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    onsets: tuple[float, ...]
    ends: tuple[float, ...]


def move(
    site: Site,
    parts: tuple[RigPart, ...],
    times: NDArray[np.float64],
    *,
    rtol: float = 1e-12,
    atol: float = 1e-14,
) -> RigMotion:
    """Integrate the motion of `site` with `parts` added, from t = 0 to the last of `times`.

    Parameters
    ----------
    times : (n,), s, increasing, starting at 0 or later
    rtol, atol : tolerances of DOP853 per step

    Raises
    ------
    SimulationError : the integrator failed or takes far too many steps, or events pile up without
        progress
    """
    run = _Run(site, parts, times, rtol, atol)
    run.finish()
    onsets, ends = (
        tuple(t for t in instants if t <= run.end) for instants in (run.onsets, run.ends)
    )
    y, v, a = run.samples
    return RigMotion(times, y, v, a, onsets, ends)


class _Run:
    """One recording in progress."""

    def __init__(
        self,
        site: Site,
        parts: tuple[RigPart, ...],
        times: NDArray[np.float64],
        rtol: float,
        atol: float,
    ) -> None:
        self.site, self.parts, self.times = site, parts, times
        self.rtol, self.atol = rtol, atol
        self.t = 0.0
        self.end = float(times[-1])
        self.state: State = [site.y0, site.v0, *(s for part in parts for s in part.states)]
        self.samples = np.empty((3, times.size))
        self.seen = [place for part in parts for place in part.seen]
        self.filled = 0
        periods = self.end * sqrt(site.k1 / site.mass) / (2 * pi)
        self.left = _STEPS + int(_PER_PERIOD * periods)
        self.gap = site.gap
        self.onsets: list[float] = []
        self.ends: list[float] = []
        self.last_sign = 1
        self.slip = 0  # direction in which friction has just given way
        self.breaks = sorted(t for part in parts for t in part.times)
        self.slowest = min((part.period for part in parts), default=inf) / 16
        self.steps: dict[tuple[int, bool], float] = {}
        self.mode = self._first_mode()

    def _first_mode(self) -> int:
        """A recording that starts beyond the gap starts in contact, without an exchange."""
        if self.site.y0 <= self.gap:
            return _FLIGHT
        self.onsets.append(0.0)
        self.mode = _CONTACT
        sign = 1 if self.site.v0 >= 0 else -1
        if self.site.unilateral:
            forces = balance(self.site, self.parts, self._piece_going(sign))
            if forces.reaction(0.0, self.state) <= -self.site.adhesion:
                self.onsets.clear()
                return _RELEASED
        return _CONTACT

    def finish(self) -> None:
        """Go on to the last sampling instant."""
        stalls = 0
        while self.t <= self.end and self.filled < self.times.size:
            before = self.t
            self._next_piece()
            stalls = stalls + 1 if self.t - before < 1e-15 else 0
            if stalls > _STALLS:
                raise SimulationError(f"{self.site.name}: no progress at t = {self.t} s")

    def _piece_going(self, sign: int) -> Piece:
        """The piece that starts here in this direction."""
        marks = [self.gap]
        for part in self.parts:
            marks.extend(part.kinks)
            marks.extend(self.gap + depth for depth in part.depths)
        marks.sort()
        y = self.state[0]
        at = bisect_right(marks, y) if sign >= 0 else bisect_left(marks, y)
        low = marks[at - 1] if at > 0 else -inf
        high = marks[at] if at < len(marks) else inf
        return Piece(self.mode == _CONTACT, self.gap, sign, low, high)

    def _direction(self) -> int:
        """Sign of the motion that follows; 0 while the mass stays at rest."""
        v = self.state[1]
        if v != 0:
            return 1 if v > 0 else -1
        if self.slip:
            return self.slip
        at_rest = replace(self._piece_going(-self.last_sign), sign=0)
        forces = balance(self.site, self.parts, at_rest)
        force = forces.drive(self.t, self.state[0], 0.0, self.state)
        if abs(force) <= forces.level:
            return 0
        return -1 if force > 0 else 1

    def _next_piece(self) -> None:
        sign = self._direction()
        self.slip = 0
        if self.mode == _FLIGHT and sign > 0 and self.state[0] >= self.gap:
            self._impact()
        piece = self._piece_going(sign)
        forces = balance(self.site, self.parts, piece)
        if sign < 0 and self.mode == _CONTACT and self.state[0] <= self.gap and self._pulls(forces):
            self._leave()  # turned back on the very surface
            return
        bound = next((t for t in self.breaks if t > self.t), inf)
        key = (self.mode, sign == 0)
        solver: Any = _Integrator(
            forces.rhs,
            self.t,
            self.state,
            min(bound, self.end + 1.0),
            rtol=self.rtol,
            atol=self.atol,
            first_step=min(self.steps.get(key, 1e-4), min(bound, self.end + 1.0) - self.t),
            max_step=self.slowest if sign == 0 else inf,
        )
        while solver.status == "running":
            solver.step()
            self.left -= 1
            if solver.status == "failed":
                raise SimulationError(f"{self.site.name}: DOP853 failed at t = {solver.t} s")
            if self.left < 0:
                raise SimulationError(f"{self.site.name}: too stiff for DOP853 at t = {solver.t} s")
            dense = solver.dense_output()
            ends = (solver.t_old, solver.t, solver.y.tolist())
            event, t = self._first_event(piece, forces, dense, *ends)
            self._sample(dense, t, forces)
            if event is not None:
                self._arrive(event, t, dense(t).tolist(), piece, forces)
                return
            self.steps[key] = solver.t - solver.t_old
            if solver.t > self.end:
                break
        self.t, self.state = float(solver.t), solver.y.tolist()

    def _sample(
        self, dense: Callable[..., NDArray[np.float64]], until: float, forces: Balance
    ) -> None:
        """Fill in the samples before `until`; the one at the very end of a piece is the next's."""
        upto = int(np.searchsorted(self.times, until, side="left"))
        if upto > self.filled:
            times = self.times[self.filled : upto]
            states = dense(times)
            self.samples[:2, self.filled : upto] = states[:2]
            rates = [forces.rhs(t, state) for t, state in zip(times, states.T, strict=True)]
            self.samples[2, self.filled : upto] = [rate[1] for rate in rates]
            for place in self.seen:
                self.samples[0, self.filled : upto] += states[place]
            self.filled = upto

    def _first_event(
        self,
        piece: Piece,
        forces: Balance,
        dense: Callable[..., NDArray[np.float64]],
        start: float,
        stop: float,
        last: State,
    ) -> tuple[int | None, float]:
        """The earliest event in a step, or (None, stop); each find narrows the search to `stop`.

        `last` is the state there.
        """
        event: int | None = None
        sign = piece.sign
        if sign == 0:

            def margin(t: float, state: State) -> float:
                return forces.level - abs(forces.drive(t, state[0], 0.0, state))

            if margin(stop, last) < 0:
                event, stop = _SLIP, _crossing(lambda t: margin(t, dense(t).tolist()), start, stop)
                last = dense(stop).tolist()
        else:
            if sign * last[1] <= 0:
                event, stop = _TURN, _crossing(lambda t: sign * float(dense(t)[1]), start, stop)
                last = dense(stop).tolist()
            target = piece.high if sign > 0 else piece.low
            if sign * (last[0] - target) >= 0:
                event = _SURFACE
                stop = _crossing(lambda t: sign * (target - float(dense(t)[0])), start, stop)
                last = dense(stop).tolist()
        if piece.contact and self.site.unilateral:

            def holds(t: float) -> float:
                return forces.reaction(t, dense(t).tolist()) + self.site.adhesion

            if forces.reaction(stop, last) + self.site.adhesion < 0 and holds(start) > 0:
                event, stop = _REACTION, _crossing(holds, start, stop)
        return event, stop

    def _arrive(self, event: int, t: float, state: State, piece: Piece, forces: Balance) -> None:
        """Carry out an event: set exactly what it says, change the mode."""
        self.t, self.state = t, state
        if piece.sign:
            self.last_sign = piece.sign
        if event == _TURN:
            state[1] = 0.0
        elif event == _SLIP:
            self.slip = -1 if forces.drive(t, state[0], 0.0, state) > 0 else 1
        elif event == _REACTION:
            self._leave()
        else:
            self._reach(piece, forces)

    def _reach(self, piece: Piece, forces: Balance) -> None:
        self.state[0] = piece.high if piece.sign > 0 else piece.low
        if self.state[0] != self.gap:
            return
        if piece.sign > 0 and self.mode == _FLIGHT:
            self._impact()
        elif piece.sign < 0 and self.mode == _RELEASED:
            self.mode = _FLIGHT
        elif piece.sign < 0 and self.mode == _CONTACT and self._pulls(forces):
            self._leave()

    def _pulls(self, forces: Balance) -> bool:
        """Whether contact ends when the mass goes back through the gap."""
        force = forces.reaction(self.t, self.state) + self.site.adhesion
        return not self.site.unilateral or force <= 0

    def _impact(self) -> None:
        self.onsets.append(self.t)
        self.mode = _CONTACT
        before = self.state[1]
        share = self.site.mass / (self.site.mass + self.site.obstacle_mass)
        self.state[1] *= share * self.site.restitution
        for part in self.parts:
            if part.struck is not None:
                part.struck(self.state, self.site.mass * (before - self.state[1]))

    def _leave(self) -> None:
        self.ends.append(self.t)
        self.gap = self.site.gap + len(self.ends) * self.site.gap_step
        self.mode = _RELEASED if self.state[0] > self.gap else _FLIGHT


def _crossing(value: Callable[[float], float], start: float, stop: float) -> float:
    """Where `value`, positive after `start`, falls to zero; `start` when it never was positive."""
    if value(stop) == 0:
        return stop
    left = start
    for halvings in range(52):
        if value(left) > 0:
            return float(brentq(value, left, stop, xtol=1e-16, rtol=9e-16))
        left = start + (stop - start) * 2.0 ** -(halvings + 1)
    return start


def sampling(rate: float, duration: float) -> NDArray[np.float64]:
    """Sampling instants 0, 1/rate, ... before `duration`, (round(rate * duration),), s."""
    return np.arange(round(rate * duration)) / rate


__all__ = ["RigMotion", "move", "sampling"]
