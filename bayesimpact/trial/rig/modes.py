"""Effects with a mode of their own, as the rig plays them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import pi

from bayesimpact.trial.rig.parts import Law, Piece, Rates, RigPart, Site, State


def second_mode(site: Site, p: Mapping[str, float], slot: int) -> RigPart:
    """q'' + 2 z w q' + w^2 q = b F, F between obstacle and mass; the probe sees y + q."""
    omega = 2 * pi * p["frequency"]
    drag, stiffness, gain = 2 * p["damping"] * omega, omega**2, p["gain"]

    def heard(force: float, state: State) -> tuple[float, ...]:
        q, speed = state[slot], state[slot + 1]
        return speed, gain * force - drag * speed - stiffness * q

    def struck(state: State, impulse: float) -> None:
        state[slot + 1] += gain * impulse

    return RigPart(states=(0.0, 0.0), heard=heard, struck=struck, seen=(slot,))


def obstacle_mode(site: Site, p: Mapping[str, float], slot: int) -> RigPart:
    """A mass on a spring and a damper inside the obstacle; they move with it in contact."""
    omega, mass = 2 * pi * p["frequency"], p["mass"]
    drag, stiffness = 2 * p["damping"] * omega, omega**2

    def law(piece: Piece) -> Law | None:
        if not piece.contact:
            return None
        gap = piece.gap
        return lambda t, y, v, state: (
            mass * (stiffness * (y - gap - state[slot]) + drag * (v - state[slot + 1]))
        )

    def rates(piece: Piece) -> Rates:
        held, gap = piece.contact, piece.gap

        def change(t: float, y: float, v: float, state: State) -> tuple[float, ...]:
            place, speed = (y - gap, v) if held else (0.0, 0.0)
            pull = stiffness * (place - state[slot]) + drag * (speed - state[slot + 1])
            return state[slot + 1], pull

        return change

    return RigPart(law, in_reaction=True, states=(0.0, 0.0), rates=rates, period=1 / p["frequency"])


def base_inertia(site: Site, p: Mapping[str, float]) -> Site:
    """Mass and frame accelerate against each other: what is left of the mass is m / (1 + r)."""
    return replace(site, mass=site.mass / (1 + p["mass_ratio"]))


def base_motion(site: Site, p: Mapping[str, float], slot: int) -> RigPart:
    """The frame's displacement X and its velocity; `site.mass` is m / (1 + r) already."""
    omega, ratio, left = 2 * pi * p["frequency"], p["mass_ratio"], site.mass
    drag, stiffness = 2 * p["damping"] * omega, omega**2

    def restoring(state: State) -> float:
        return drag * state[slot + 1] + stiffness * state[slot]

    def felt(acceleration: float, y: float, v: float, state: State) -> tuple[float, ...]:
        # N = left (R - y''): then m (y'' + X'') + N = 0 and X'' = -R + r N / m agree
        return state[slot + 1], -(restoring(state) + ratio * acceleration) / (1 + ratio)

    def struck(state: State, impulse: float) -> None:
        state[slot + 1] += ratio * impulse / (left * (1 + ratio))

    def law(piece: Piece) -> Law:
        return lambda t, y, v, state: -left * restoring(state)

    return RigPart(law, states=(0.0, 0.0), felt=felt, struck=struck, period=1 / p["frequency"])
