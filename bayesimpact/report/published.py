"""Values to set beside the results: published ones, and those of beam theory."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.campaign import Campaign
from bayesimpact.errors import InputError

TABLE_2: Mapping[str, float] = MappingProxyType(
    {
        "c1": 0.148,
        "k1": 808.556,
        "c2": 2.085,
        "g": 1.1e-3,
        "k2[1]": 5350.156,
        "k2[2]": 4776.275,
        "k2[3]": 2959.249,
    }
)
"""Tian, Yin, Liu and Londono Monsalve, Table 2, SI units: the paper's rig and three beams."""

PUBLISHED = "Table 2"
BEAM = "beam theory"


def references(campaign: Campaign) -> dict[str, Mapping[str, float]]:
    """Label -> parameter -> value: Table 2 for the bundled campaign, beams where given."""
    found: dict[str, Mapping[str, float]] = {}
    if _is_bundled(campaign):
        found[PUBLISHED] = TABLE_2
    if campaign.beams:
        found[BEAM] = {f"k2[{case}]": beam.stiffness for case, beam in campaign.beams.items()}
    return found


def _is_bundled(campaign: Campaign) -> bool:
    if campaign.folder is None:
        return False
    try:
        return campaign.folder.resolve() == bundled_campaign("paper").resolve()
    except InputError:
        return False
