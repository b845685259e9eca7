"""A force that only the strong trials plant: a narrow bump in the contact.

Written from the equations, like the rest of the rig; the package's own laws are not looked at.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import exp

from bayesimpact.trial.rig.catalogue import Numbers, Planted, in_contact
from bayesimpact.trial.rig.parts import RigPart, Site


def _contact_bump(site: Site, p: Numbers, slot: int) -> RigPart:
    """A narrow rise of the obstacle's force: `force` exp(-(d - depth)^2/width^2) in contact."""
    force, depth, scale = p["force"], p["depth"], 1 / p["width"] ** 2
    return in_contact(lambda d, v: force * exp(-((d - depth) ** 2) * scale))


STRONG: Mapping[str, Planted] = {
    "contact_bump": Planted(("force", "depth", "width"), obstacle=True, part=_contact_bump),
}
"""Effect -> how it enters the rig."""
