"""Forces that only the strong trials plant: gravity on a pendulum, a narrow bump in the contact.

Written from the equations, like the rest of the rig; the package's own laws are not looked at.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import exp, sin

from bayesimpact.trial.rig_catalogue import Numbers, Planted, everywhere, in_contact
from bayesimpact.trial.rig_parts import Part, Site, State


def _pendulum(site: Site, p: Numbers, slot: int) -> Part:
    """K (sin y - y): with K = k1 the linear spring becomes gravity's moment k1 sin y."""
    moment = p["stiffness"]

    def law(t: float, y: float, v: float, state: State) -> float:
        return moment * (sin(y) - y)

    return Part(everywhere(law))


def _contact_bump(site: Site, p: Numbers, slot: int) -> Part:
    """A narrow rise of the obstacle's force: `force` exp(-(d - depth)^2/width^2) in contact."""
    force, depth, scale = p["force"], p["depth"], 1 / p["width"] ** 2
    return in_contact(lambda d, v: force * exp(-((d - depth) ** 2) * scale))


STRONG: Mapping[str, Planted] = {
    "pendulum_sine": Planted(("stiffness",), part=_pendulum),
    "contact_bump": Planted(("force", "depth", "width"), obstacle=True, part=_contact_bump),
}
"""Effect -> how it enters the rig; pendulum_sine is one of the catalogue, contact_bump is not."""
