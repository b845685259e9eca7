"""Effects with a mode of their own, as the rig plays them."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

from bayesimpact.trial.rig_parts import Part, Site, State


def second_mode(site: Site, p: Mapping[str, float], slot: int) -> Part:
    """q'' + 2 z w q' + w^2 q = b F, F between obstacle and mass; the probe sees y + q."""
    omega = 2 * pi * p["frequency"]
    drag, stiffness, gain = 2 * p["damping"] * omega, omega**2, p["gain"]

    def heard(force: float, state: State) -> tuple[float, ...]:
        q, speed = state[slot], state[slot + 1]
        return speed, gain * force - drag * speed - stiffness * q

    def struck(state: State, impulse: float) -> None:
        state[slot + 1] += gain * impulse

    return Part(states=(0.0, 0.0), heard=heard, struck=struck, seen=(slot,))
