"""Peer: diffrax, compiled by XLA in double precision, from one located event to the next.

A section of the motion ends at the event or after WINDOW samples, whichever comes first; what it
saved behind the event is overwritten by the next. Tsit5, because the dense output of diffrax's
Dopri8, on which the samples between its long steps depend, stays at 1e-4 m here.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
from benchmarks.bundled import Array, Problem

jax.config.update("jax_enable_x64", True)

WINDOW = 128
MOST_STEPS = 100_000


def slope(t, y, args):
    """args : damping, 1/s, stiffness, 1/s2, push, m/s2, of the regime; side of the stop; gap, m."""
    damping, stiffness, push, _, _ = args
    return jnp.array([y[1], push - damping * y[1] - stiffness * y[0]])


def inside(t, y, args, **_):
    """Distance from the stop, m, negative once the mass has left its regime."""
    return args[3] * (y[0] - args[4])


def section(method, control, ts, regime, t, state):
    """Motion from (t, state) in one regime: (samples (WINDOW,), how many, t, state, met an event).

    ts : (WINDOW,) times of the next samples, s; regime : (5,) as `slope` takes it
    """
    root = optimistix.Newton(1e-14, 1e-16, optimistix.rms_norm)
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(slope), method, t, ts[-1], None, state, regime,
        saveat=diffrax.SaveAt(subs=[diffrax.SubSaveAt(ts=ts), diffrax.SubSaveAt(t1=True)]),
        stepsize_controller=control, event=diffrax.Event(inside, root, direction=False),
        max_steps=MOST_STEPS, throw=False,
    )  # fmt: skip
    values, (end,) = found.ys[0][:, 0], found.ys[1]
    met = diffrax.is_event(found.result)
    return values, jnp.sum(jnp.isfinite(values)), found.ts[1][0], end, met


@cache
def compiled(method: str, n: int, interval: float) -> Callable:
    """The whole simulation: (start (2,), regimes (2, 5), rtol, atol (2,)) -> (n,) displacement."""
    kind = getattr(diffrax, method)()

    @jax.jit
    def simulate(start, regimes, rtol, atol):
        control = diffrax.PIDController(rtol=rtol, atol=atol)
        gap = regimes[0, 4]

        def advance(carry):
            t, state, contact, done, out = carry
            ts = (done + jnp.arange(WINDOW)) * interval
            regime = regimes[contact.astype(int)]
            values, count, t, state, met = section(kind, control, ts, regime, t, state)
            out = jax.lax.dynamic_update_slice(out, values, (done,))
            state = jnp.where(met, state.at[0].set(gap), state)
            return t, state, contact ^ met, done + count, out

        carry = (jnp.zeros(()), start, start[0] > gap, jnp.array(0), jnp.zeros(n + WINDOW))
        return jax.lax.while_loop(lambda carry: carry[3] < n, advance, carry)[4][:n]

    return simulate


def solver(problem: Problem, method: str, tolerance: float) -> Callable[[], Array]:
    """A simulation of the problem: () -> (n,) displacement, m; `tolerance` is relative."""
    sides = ((False, -1.0), (True, 1.0))
    regimes = jnp.array([(*problem.regime(c), side, problem.gap) for c, side in sides])
    start, atol = jnp.array(problem.start), jnp.array(tolerance * problem.scale)
    simulate = compiled(method, problem.n, problem.interval)
    return lambda: np.asarray(simulate(start, regimes, tolerance, atol))
