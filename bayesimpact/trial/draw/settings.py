"""What a run of blind trials is made of, apart from the seeds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from bayesimpact.errors import InputError
from bayesimpact.model.effects import UNTRIED
from bayesimpact.trial.draw.designs import NOISES, RIG_DESIGNS
from bayesimpact.trial.draw.planted_effects import PLANTED_EFFECTS
from bayesimpact.trial.draw.planted_outside import OUTSIDE_EFFECTS
from bayesimpact.trial.draw.strong_effects import CATALOGUE_STRONG, STRONG_OUTSIDE
from bayesimpact.trial.draw.strong_rigs import STRONG_RIGS

REGIMES = ("weak", "strong")
KINDS = ("control", "single", "pair", "outside")
DEFAULT_STRENGTH = (1.5, 6.0)  # times the detection limit
DEFAULT_RIG_KINDS = tuple(name for name in RIG_DESIGNS if name != "small")
PLANTED = tuple(e for e in PLANTED_EFFECTS if e not in UNTRIED)
DEFAULT_MISFIT = (3.0, 300.0)  # base misfit over the noise, as real recordings have it
STRONG_KINDS = ("several", "several_outside")
STRONG_DEFAULTS: Mapping[str, Any] = {
    "kinds": ("several", "several", "several_outside"),
    "effects": tuple(CATALOGUE_STRONG),
    "outside": tuple(STRONG_OUTSIDE),
    "rig_kinds": tuple(STRONG_RIGS),
    "noises": ("white", "ar1"),
    "rest": 0.25,
}
"""What the strong regime draws from where nothing is said."""


@dataclass(frozen=True)
class Settings:
    """What a run draws from; with a seed it determines a trial completely.

    Attributes
    ----------
    kinds : of trials, in turn; a kind named twice comes twice as often
    effects : ids of the catalogue that may be planted, in turn
    outside : forces outside the catalogue, in turn
    strength : smallest and largest size, in detection limits (a limit is five standard errors)
    rig_kinds : rigs, drawn at random
    noises : kinds of noise, drawn at random
    search : whether the diagnosis runs its global search (and samples, where it writes a report)
    regime : weak (effects near the detection limit) or strong (several at once, a large misfit)
    misfit : strong only: range of the base misfit, in standard deviations of the noise
    rest : strong only: share of trials whose recordings begin before the release
    report : whether the diagnosis goes the whole way of the command, report and figures included
    """

    kinds: tuple[str, ...] = KINDS
    effects: tuple[str, ...] = PLANTED
    outside: tuple[str, ...] = tuple(OUTSIDE_EFFECTS)
    strength: tuple[float, float] = DEFAULT_STRENGTH
    rig_kinds: tuple[str, ...] = DEFAULT_RIG_KINDS
    noises: tuple[str, ...] = NOISES
    search: bool = True
    regime: str = "weak"
    misfit: tuple[float, float] = DEFAULT_MISFIT
    rest: float = 0.0
    report: bool = False

    def __post_init__(self) -> None:
        if self.regime not in REGIMES:
            raise InputError("trial, regime", self.regime, ", ".join(REGIMES))
        strong = self.regime == "strong"
        known = {
            "kinds": STRONG_KINDS if strong else (*KINDS, "fault", "fault_single"),
            "effects": tuple(CATALOGUE_STRONG if strong else PLANTED_EFFECTS),
            "outside": tuple(STRONG_OUTSIDE if strong else OUTSIDE_EFFECTS),
            "rig_kinds": tuple(STRONG_RIGS if strong else RIG_DESIGNS),
            "noises": ("white", "ar1") if strong else (*NOISES, "slow"),
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
        low, high = self.misfit
        if not 1 < low <= high:
            raise InputError("trial, misfit", f"{low} {high}", "1 < LOW <= HIGH")
        if not 0 <= self.rest <= 1:
            raise InputError("trial, rest", f"{self.rest}", "a share from 0 to 1")

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        content: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return content


def settings_from(content: Mapping[str, Any]) -> Settings:
    """The settings that `Settings.document` wrote."""
    names = [f.name for f in fields(Settings)]
    values: dict[str, Any] = {}
    for name in names:
        if name not in content:  # written before there was this setting
            continue
        value = content[name]
        values[name] = tuple(value) if isinstance(value, list) else value
    return Settings(**values)


def strong_settings(**given: Any) -> Settings:
    """Settings of the strong regime; what is not given is as `STRONG_DEFAULTS` says."""
    return Settings(**{**STRONG_DEFAULTS, "regime": "strong", **given})
