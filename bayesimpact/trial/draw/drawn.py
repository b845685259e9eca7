"""What a draw hands over: a campaign to diagnose, and the truth about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bayesimpact.data.campaign import Campaign


@dataclass(frozen=True, eq=False)
class DrawnTrial:
    """A campaign and the truth about it, as a JSON object."""

    campaign: Campaign
    truth: Mapping[str, Any]
