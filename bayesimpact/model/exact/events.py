"""When does the motion next reach the stop?

Both regimes ask the same question after a change of sign: at what time does z, now below `level`,
next rise through it? Flight asks it of z = y, contact of z = -y. Without forcing the turning points
are known in closed form, z rises monotonically from a trough to the next peak, and safeguarded
Newton solves for the crossing between the two. With forcing the search walks forward in steps that
provably cannot jump over a crossing. Neither looks at samples, so an impact that fits between two
of them is found all the same.
"""

from __future__ import annotations

import math

from bayesimpact.model.exact.flow import advance, advance_forced, forced_response, impulse_response
from bayesimpact.model.exact.normalized import NormalizedParameters
from bayesimpact.model.jit.compiled import compiled

#: Iterations after which a search gives up (never seen; bisection alone needs about 60).
MAX_ITERATIONS = 200
#: Steps of the forced search after which it gives up.
MAX_STEPS = 200_000


@compiled()
def rising_stretch(b: float, K: float, z: float, v: float, horizon: float) -> tuple[float, float]:
    """Return the first stretch (low, high) of [0, horizon] on which unforced z(t) rises.

    The motion starts at (z, v); (0, -1) when z rises nowhere before the horizon.
    """
    square = K - b * b
    if square > 0.0:
        wd = math.sqrt(square)
        pull = b * v + K * z
        if v > 0.0:
            low = 0.0
            high = math.atan2(wd * v, pull) / wd
        elif v < 0.0 or z < 0.0:
            low = math.atan2(-wd * v, -pull) / wd
            high = low + math.pi / wd
        else:
            return 0.0, -1.0
    else:
        beta = math.sqrt(-square)
        pull = v * K / (b + beta) + K * z
        turn = -1.0  # the only turning point there can be
        if v * pull > 0.0:
            q = 2.0 * beta * v / pull
            turn = math.log1p(q) / (2.0 * beta) if q > 1e-8 else v / pull
        if v > 0.0:
            low = 0.0
            high = turn if turn > 0.0 else horizon
        elif v < 0.0 and turn > 0.0:
            low = turn
            high = horizon
        elif v == 0.0 and z < 0.0:
            low = 0.0
            high = horizon
        else:
            return 0.0, -1.0
    return low, min(high, horizon)


@compiled()
def next_crossing(
    b: float, K: float, z: float, v: float, level: float, horizon: float
) -> tuple[float, float]:
    """Return (t, z'(t)) at the first rise of the unforced motion through `level`; t = inf if there
    is none.

    Parameters
    ----------
    b, K : regime, as in `flow`
    z, v : position relative to the regime's rest and velocity, now; z <= level
    level : height to cross, relative to the rest
    horizon : time after which crossings do not matter

    Peaks of an unforced motion never grow: if the first one stays below the level, so do all
    others.
    """
    low, high = rising_stretch(b, K, z, v, horizon)
    if not low < high:
        return math.inf, 0.0
    S, D = impulse_response(b, K, high)
    top, _ = advance(b, K, z, v, S, D)
    if not top > level:
        return math.inf, 0.0
    bottom = z
    if low > 0.0:
        S, D = impulse_response(b, K, low)
        bottom, _ = advance(b, K, z, v, S, D)
    # exact between the turning points of an undamped motion
    share = (level - bottom) / (top - bottom)
    t = low + (high - low) * math.acos(1.0 - 2.0 * min(max(share, 0.0), 1.0)) / math.pi
    step = high - low
    for _ in range(MAX_ITERATIONS):
        S, D = impulse_response(b, K, t)
        position, speed = advance(b, K, z, v, S, D)
        excess = position - level
        if excess < 0.0:
            low = t
        else:
            high = t
        before = step
        step = -excess / speed if speed > 0.0 else math.inf
        moved = t + step
        if not low <= moved <= high or abs(step) > 0.5 * abs(before):
            moved = 0.5 * (low + high)
            step = moved - t
        if abs(step) <= 2.3e-16 * t:
            # a graze within rounding has no speed left: it touches, and does not enter
            return (t, speed) if speed > 0.0 else (math.inf, 0.0)
        t = moved
    return math.nan, 0.0


@compiled()
def next_crossing_forced(
    b: float, K: float, w: float, z: float, v: float, fs: float, fc: float, level: float,
    horizon: float,
) -> tuple[float, float]:  # fmt: skip
    """Return (t, z'(t)) at the first rise of the forced motion through `level`; inf if none, nan on
    failure.

    fs, fc : the force per mass is fs cos(w t) + fc sin(w t).

    With e = sqrt(z'^2 + K z^2) and e' <= |force|, over the next s
    |z''| <= (2 b + sqrt K)(e + |force| s) + |force| =: M. While z' s + M s^2 / 2 is less than the
    distance to the level nothing can cross, and close to a crossing the largest such step is
    Newton's, from below.
    """
    force = math.hypot(fs, fc)
    rate = math.sqrt(K) + 2.0 * b
    longest = 1.0 / (rate + w)
    shortest = 1e-9 * longest
    t = 0.0
    position, speed = z, v
    for _ in range(MAX_STEPS):
        distance = level - position
        if distance <= 0.0 and speed > 0.0 and t > 0.0:
            return t, speed
        distance = max(distance, 0.0)
        energy = math.sqrt(speed * speed + K * position * position)
        bound = rate * (energy + force * longest) + force
        root = math.sqrt(speed * speed + 2.0 * bound * distance)
        step = 2.0 * distance / (root + speed) if speed > 0.0 else (root - speed) / bound
        sure = speed > 0.0 and step < longest and bound * step <= 0.1 * speed
        step = min(max(step, shortest), longest)
        t += step
        S, D = impulse_response(b, K, t)
        E, F = forced_response(b, K, w, t, S, D)
        position, speed = advance_forced(b, K, w, z, v, fs, fc, S, D, E, F)
        if sure:  # the speed hardly changes any more: plain Newton
            for _ in range(6):
                step = (level - position) / speed
                t += step
                S, D = impulse_response(b, K, t)
                E, F = forced_response(b, K, w, t, S, D)
                position, speed = advance_forced(b, K, w, z, v, fs, fc, S, D, E, F)
                if abs(step) <= 4e-16 * t:
                    break
            return (t, speed) if t <= horizon else (math.inf, 0.0)
        if not t <= horizon:
            return math.inf, 0.0
    return math.nan, 0.0


@compiled()
def next_event(
    motion: NormalizedParameters, contact: bool, b: float, K: float, rest: float, t: float,
    u: float, v: float, horizon: float,
) -> tuple[float, float]:  # fmt: skip
    """Return (wait, y' then) of the next event after time t; inf if none, nan on failure.

    u, v : y - rest and y' at t, in the regime b, K, rest
    horizon : how long to look
    """
    sign = -1.0 if contact else 1.0
    level = sign * (motion.gap - rest)
    if motion.force == 0.0:
        wait, speed = next_crossing(b, K, sign * u, sign * v, level, horizon)
    else:
        angle = motion.w * t + motion.phase
        fs, fc = sign * motion.force * math.sin(angle), sign * motion.force * math.cos(angle)
        wait, speed = next_crossing_forced(
            b, K, motion.w, sign * u, sign * v, fs, fc, level, horizon
        )
    return wait, sign * speed
