"""What a run of blind trials is made of, apart from the seeds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from bayesimpact.errors import InputError
from bayesimpact.trial.benches import BENCHES, NOISES
from bayesimpact.trial.plants import CATALOGUE_PLANTS, OUTSIDE_PLANTS

KINDS = ("control", "single", "pair", "outside")
DEFAULT_STRENGTH = (1.5, 6.0)  # times the detection limit
DEFAULT_BENCHES = tuple(name for name in BENCHES if name != "small")


@dataclass(frozen=True)
class Settings:
    """What a run draws from; with a seed it determines a trial completely.

    Attributes
    ----------
    kinds : of trials, in turn; a kind named twice comes twice as often
    effects : ids of the catalogue that may be planted, in turn
    outside : forces outside the catalogue, in turn
    strength : smallest and largest size, in detection limits (a limit is five standard errors)
    benches : rigs, drawn at random
    noises : kinds of noise, drawn at random
    search : whether the diagnosis runs its global search
    """

    kinds: tuple[str, ...] = KINDS
    effects: tuple[str, ...] = tuple(CATALOGUE_PLANTS)
    outside: tuple[str, ...] = tuple(OUTSIDE_PLANTS)
    strength: tuple[float, float] = DEFAULT_STRENGTH
    benches: tuple[str, ...] = DEFAULT_BENCHES
    noises: tuple[str, ...] = NOISES
    search: bool = True

    def __post_init__(self) -> None:
        known = {
            "kinds": KINDS,
            "effects": tuple(CATALOGUE_PLANTS),
            "outside": tuple(OUTSIDE_PLANTS),
            "benches": tuple(BENCHES),
            "noises": NOISES,
        }
        for name, accepted in known.items():
            given = getattr(self, name)
            wrong = [entry for entry in given if entry not in accepted]
            if wrong or not given:
                found = ", ".join(wrong) or "nothing"
                raise InputError(f"trial, {name}", found, ", ".join(accepted))
        low, high = self.strength
        if not 0 < low <= high:
            raise InputError("trial, strength", f"{low} {high}", "0 < LOW <= HIGH")

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        content: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return content


def settings_from(content: Mapping[str, Any]) -> Settings:
    """The settings that `Settings.document` wrote."""
    names = [f.name for f in fields(Settings)]
    values: dict[str, Any] = {}
    for name in names:
        value = content[name]
        values[name] = tuple(value) if isinstance(value, list) else value
    return Settings(**values)
