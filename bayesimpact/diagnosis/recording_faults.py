"""Faults of recordings as part of a diagnosis: found, corrected before any physics is searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault, fault_document
from bayesimpact.data.faults.find import set_aside
from bayesimpact.diagnosis.faults.compare import (
    Compared,
    base_failed,
    compare_recordings,
    misfits,
)
from bayesimpact.diagnosis.faults.outliers import residual_spikes, without_spikes
from bayesimpact.inference.identify import Identification, identify


@dataclass(frozen=True, eq=False)
class Corrected:
    """A campaign with the faults of its recordings set aside or corrected.

    Attributes
    ----------
    identification : of the base model on the corrected campaign
    own : faults found in the recordings themselves, notices among them
    compared : faults found by comparing recordings, in the order of their correction
    """

    identification: Identification
    own: tuple[Fault, ...] = ()
    compared: tuple[Compared, ...] = ()

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Faults that were set aside or corrected."""
        kept = self.identification.fit.target.oscillator.campaign.keep_faults
        own = () if kept else tuple(f for f in self.own if f.action != "notice")
        return (*own, *(c.fault for c in self.compared))


def cleaned_campaign(campaign: Campaign, *, rng: np.random.Generator, search: bool) -> Corrected:
    """Set aside what the recordings show of themselves, and fit the base model.

    With `faults = "keep"` in campaign.toml nothing is changed.

    Raises
    ------
    InputError : a recording shows no oscillation
    """
    cleaned, own = set_aside(campaign)
    found = Corrected(identify(cleaned, rng=rng, search=search), own)
    return found if campaign.keep_faults else _without_spikes(found, campaign, rng=rng)


def _without_spikes(found: Corrected, as_read: Campaign, *, rng: np.random.Generator) -> Corrected:
    """The same without spikes that the fit shows, if it is right about all other samples.

    Where it is not, what stands out at a contact may be physics.
    """
    fit = found.identification.fit
    spikes = () if base_failed(fit) else residual_spikes(fit)
    if not spikes:
        return found
    campaign = without_spikes(fit.target.oscillator.campaign, spikes)
    again = identify(campaign, rng=rng, search=False)
    if misfits(again.fit):
        return found
    again = replace(again, search=found.identification.search)
    return Corrected(again, (*found.own, *(_as_read(f, campaign, as_read) for f in spikes)))


def _as_read(fault: Fault, campaign: Campaign, as_read: Campaign) -> Fault:
    """A fault with its samples counted from the recording's first as it was read."""
    now, before = ({r.name: r for r in c.recordings}[fault.recording] for c in (campaign, as_read))
    cut = round((now.start - before.start) / now.interval)
    return replace(fault, spans=tuple((a + cut, b + cut) for a, b in fault.spans))


def compared_campaign(before: Corrected, *, rng: np.random.Generator, search: bool) -> Corrected:
    """The same with faults corrected that comparing the recordings shows; as it was without any."""
    campaign = before.identification.fit.target.oscillator.campaign
    compared = () if campaign.keep_faults else compare_recordings(before.identification)
    if not compared:
        return before
    return Corrected(identify(compared[-1].campaign, rng=rng, search=search), before.own, compared)


def as_effects(corrected: Corrected) -> list[dict[str, Any]]:
    """Faults as entries of diagnosis.json's effects (family `recording`)."""
    by_comparison = {id(c.fault): c for c in corrected.compared}
    return [_entry(f, by_comparison.get(id(f))) for f in corrected.faults]


def fault_entries(corrected: Corrected) -> list[dict[str, Any]]:
    """All faults, notices too, for diagnosis.json's `faults`."""
    entries = [
        fault_document(f) | {"action": f.action, "chi2_before": None, "chi2_after": None}
        for f in corrected.own
    ]
    return entries + [
        fault_document(c.fault)
        | {"action": "correct", "chi2_before": c.before, "chi2_after": c.after}
        for c in corrected.compared
    ]


def _entry(fault: Fault, compared: Compared | None) -> dict[str, Any]:
    others = sum(p for _, p in compared.alternatives) if compared else 0.0
    size = float(fault.size) if np.isfinite(fault.size) else 0.0
    return {
        "id": fault.id,
        "title": fault.id.removeprefix("recording_").replace("_", " "),
        "family": "recording",
        "statement": f"Recording {fault.recording}: {fault.statement}.",
        "probability": max(0.0, 1.0 - others),
        "delta_log_evidence": float(fault.strength) if compared else None,
        "parameters": {
            f"{fault.id}.size[{fault.recording}]": {
                "unit": fault.unit,
                "median": size,
                "ci90": [size, size],
            }
        },
        "location": place([fault]),
        "size": {"value": size, "unit": fault.unit, "percent": None, "of": ""},
    }


def place(faults: Sequence[Fault]) -> dict[str, Any]:
    """Where faults lie, as diagnosis.json's location."""
    return {
        "regime": "measurement",
        "share": 1.0,
        "displacement_m": None,
        "velocity_m_s": None,
        "time_s": [min(f.start_s for f in faults), max(f.end_s for f in faults)],
        "recordings": list(dict.fromkeys(f.recording for f in faults)),
        "cases": [],
        "force_rms_n": None,
    }


def in_words(faults: Sequence[Fault]) -> str:
    """Faults in a sentence each; empty without any."""
    return "".join(f" Recording {f.recording}: {f.statement}." for f in faults)
