"""Slow, obvious twins of the compiled simulator.

`twin` repeats a recording with mpmath at 50 digits: characteristic roots, complex exponentials,
events by bisection and Newton. `dense` walks along one regime in float64 with a matrix exponential
on a fine grid; the twin uses it to see where to look, and the search for missed impacts to check
every stretch. Neither shares a formula with the package. q = (c1, k1, c2, g, k2, y0, v0, A, w,
phase, offset).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import mpmath as mp
import numpy as np

#: Grid points per radian of the fastest motion.
POINTS = 24


def regime(q, mass, contact):
    """(damping rate 2b, stiffness rate K, rest) of flight or contact."""
    c1, k1, c2, g, k2 = q[:5]
    if contact:
        return (c1 + c2) / mass, (k1 + k2) / mass, k2 * g / (k1 + k2)
    return c1 / mass, k1 / mass, 0 * k1


def _generator(q, mass, contact):
    """Return w0 and M of x' = M x, x = (y - rest, y' / w0, sin, cos(w t + phase))."""
    drag, stiff, _ = regime(q, mass, contact)
    w0, w = math.sqrt(stiff), q[8]
    rows = [[0, w0, 0, 0], [-w0, -drag, q[7] / mass / w0, 0], [0, 0, 0, w], [0, 0, -w, 0]]
    return w0, np.array(rows, dtype=float)


def _exponential(matrix):
    """exp of a small matrix: Taylor series after halving, then squaring."""
    halvings = max(0, math.ceil(math.log2(np.abs(matrix).sum() + 1e-300)) + 3)
    small = matrix / 2.0**halvings
    term = total = np.eye(4)
    for i in range(1, 14):
        term = term @ small / i
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def dense(q, mass, contact, t, y, v, duration, fewest=4):
    """Times, y and y' on a fine grid from (y, v) at t over `duration`, ends included."""
    rest = regime(q, mass, contact)[2]
    w0, generator = _generator(q, mass, contact)
    rate = w0 - generator[1, 1] + q[8]
    count = max(fewest, math.ceil(duration * rate * POINTS))
    step = duration / count
    power = _exponential(generator * step)
    x = np.array([[y - rest, v / w0, math.sin(q[8] * t + q[9]), math.cos(q[8] * t + q[9])]])
    while len(x) <= count:
        x = np.concatenate([x, x @ power.T])
        power = power @ power
    x = x[: count + 1]
    return t + step * np.arange(count + 1), x[:, 0] + rest, x[:, 1] * w0


def vertex(step, y, v):
    """Height of the peak between neighbours of a grid (y' > 0, then < 0), from the cubic."""
    ya, yb, va, vb = y[:-1], y[1:], v[:-1] * step, v[1:] * step
    a, b = 2 * (ya - yb) + va + vb, 3 * (yb - ya) - 2 * va - vb
    # zero of the slope, in the form that survives a small cubic term
    root = np.sqrt(np.maximum(b * b - 3 * a * va, 0))
    s = np.clip(va / np.where(root - b == 0, 1, root - b), 0, 1)
    return ya + s * (va + s * (b + s * a))


@dataclass
class Twin:
    """Events (time, velocity, entry?) and y, y', y'' at the samples, as mpf."""

    events: list
    motion: list
    contact_at_start: bool

    @property
    def displacement(self):
        return self.derivative(0)

    def derivative(self, order):
        return [state[order] for state in self.motion]


def begins_in_contact(q):
    if q[3] == math.inf or (q[2] == 0 and q[4] == 0):
        return False
    if q[5] != q[3]:
        return q[5] > q[3]
    return q[6] > 0 if q[6] != 0 else q[7] * math.sin(q[9]) > q[1] * q[3]


class _Stretch:
    """Exact motion in one regime from (t, y, v), with mpmath."""

    def __init__(self, q, mass, contact, t, y, v, nudge):
        drag, stiff, self.rest = regime(q, mass, contact)
        amplitude, w, self.phase = q[7] / mass, q[8], q[9]
        if drag * drag == 4 * stiff:  # critical damping and resonance: approached to many digits
            stiff *= 1 + nudge
        if drag == 0 and stiff == w * w:
            w *= 1 + nudge
        self.start, self.w = t, w
        self.gain = (
            amplitude / (stiff - w * w + mp.mpc(0, 1) * drag * w) if amplitude else mp.mpf(0)
        )
        root = mp.sqrt(mp.mpc(drag * drag / 4 - stiff))
        self.near, self.far = -drag / 2 + root, -drag / 2 - root
        forced, forced_rate = self._forced(t)
        u, du = y - self.rest - forced, v - forced_rate
        self.a = (du - self.far * u) / (self.near - self.far)
        self.b = u - self.a

    def _forced(self, t):
        if not self.gain:
            return mp.mpf(0), mp.mpf(0)
        z = self.gain * mp.expj(self.w * t + self.phase)
        return z.imag, (mp.mpc(0, 1) * self.w * z).imag

    def __call__(self, t):
        """(y, y', y'') at t."""
        s = t - self.start
        a, b = self.a * mp.exp(self.near * s), self.b * mp.exp(self.far * s)
        forced, rate = self._forced(t)
        return (
            (a + b).real + self.rest + forced,
            (self.near * a + self.far * b).real + rate,
            (self.near**2 * a + self.far**2 * b).real - self.w**2 * forced,
        )


def _solve(function, low, high):
    """Root of a monotone function (returning value and slope) that changes sign in [low, high]."""
    sign = function(high)[0] > 0
    for _ in range(8):
        middle = (low + high) / 2
        if (function(middle)[0] > 0) == sign:
            high = middle
        else:
            low = middle
    t = (low + high) / 2
    for _ in range(60):
        value, slope = function(t)
        if value == 0 or slope == 0:
            break
        moved = t - value / slope
        inside = low <= moved <= high
        if not inside:  # t itself may be the middle: that is no end yet
            moved = (low + high) / 2
        if (function(moved)[0] > 0) == sign:
            high = moved
        else:
            low = moved
        done = inside and abs(moved - t) < mp.mpf(10) ** (-mp.mp.dps + 12) * (1 + abs(t))
        t = moved
        if done:
            break
    return t


def _next_event(q, mass, contact, motion, t, y, v, end, scale):
    """Time of the next event after t, or None, looking only where the float64 grid points."""
    sign = -1 if contact else 1
    g = q[3]
    floats = [float(x) for x in q]
    times, ys, vs = dense(
        floats, float(mass), contact, float(t), float(y), float(v), float(end - t)
    )
    z, zv = sign * (ys - floats[3]), sign * vs
    tops = vertex(times[1] - times[0], z, zv)
    near = 1e-7 * scale  # ten times the error of `vertex`
    rises = (z[1:] > -near) & (z[1:] >= z[:-1])
    peaks = (zv[:-1] > 0) & (zv[1:] < 0) & (tops > -near)
    turns = (zv[:-1] <= 0) & (zv[1:] > 0) & (z[1:] > -near)
    gap = lambda s: (sign * (motion(s)[0] - g), sign * motion(s)[1])  # noqa: E731
    slope = lambda s: motion(s)[1:]  # noqa: E731
    for i in np.nonzero(rises | peaks | turns)[0]:
        low = t if i == 0 else mp.mpf(times[i])
        high = mp.mpf(times[i + 1])
        if slope(low)[0] * sign <= 0 and slope(high)[0] * sign > 0:
            low = _solve(slope, low, high)  # a trough: rising only from here
        elif slope(low)[0] * sign > 0 and slope(high)[0] * sign < 0:
            high = _solve(slope, low, high)  # a peak: rising only up to here
        if slope(low)[0] * sign < 0 or gap(high)[0] <= 0 or gap(low)[0] > 0:
            continue
        found = _solve(gap, low, high)
        if found > t and slope(found)[0] * sign > 0:
            return found if found < end else None
    return None


def twin(q, mass, interval, n, digits=50):
    """Simulate one recording with mpmath; the arguments are taken as the exact numbers they are."""
    with mp.workdps(digits + 30):
        nudge = mp.mpf(10) ** -(digits - 20)
        q = [mp.mpf(x) for x in q]
        mass, interval = mp.mpf(mass), mp.mpf(interval)
        end = interval * (n - 1)
        stop = q[3] < mp.inf and (q[2] > 0 or q[4] > 0)
        contact = first = begins_in_contact(q)
        scale = max(abs(float(q[5])), abs(float(q[6])) / math.sqrt(float(q[1] / mass)), 1e-12)
        t, y, v = mp.mpf(0), q[5], q[6]
        events, states = [], []
        while True:
            motion = cache(_Stretch(q, mass, contact, t, y, v, nudge))
            event = None
            if stop and end > t:
                event = _next_event(q, mass, contact, motion, t, y, v, end, scale)
            while len(states) < n and (event is None or len(states) * interval < event):
                states.append(motion(len(states) * interval))
            if event is None:
                return Twin(events, states, first)
            t, y, v = event, q[3], motion(event)[1]
            contact = not contact
            events.append((t, v, contact))
