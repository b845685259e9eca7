"""Faults found in the recordings themselves, as lines for a terminal and lines of campaign.toml."""

from __future__ import annotations

from collections.abc import Sequence

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault
from bayesimpact.data.gaps import excluded
from bayesimpact.data.recording import Recording

SHOWN = 6  # places of one fault whose samples are listed


def fault_lines(campaign: Campaign, faults: Sequence[Fault]) -> list[str]:
    """What was found, where, and what to write under which [[recording]]; [] without faults."""
    if not faults:
        return []
    lines = ["", "found in the recordings themselves"]
    for fault in faults:
        lines.append(f"  {fault.recording}: {fault.id}: {fault.statement}")
        lines.append(f"    {_samples(fault)}")
    hard = [fault for fault in faults if fault.action != "notice"]
    if not hard:
        return lines
    if campaign.keep_faults:
        return [*lines, '  kept in: campaign.toml says faults = "keep"']
    lines.append("  set aside before any fit; to state it, in campaign.toml under [[recording]]:")
    for recording in campaign.recordings:
        keys = remedies(recording, [f for f in hard if f.recording == recording.name])
        if keys:
            lines.append(f"    {recording.name}:")
            lines += [f"      {key}" for key in keys]
    return [*lines, '  to keep them in, at the top of campaign.toml: faults = "keep"']


def remedies(recording: Recording, faults: Sequence[Fault]) -> list[str]:
    """Keys of one recording that deal with all its faults: one list of spans, the tightest ends."""
    skip = [f.remedy for f in faults if f.action == "skip"]
    if skip:
        return skip[:1]
    ends: dict[str, float] = {}
    for fault in faults:
        for line in fault.remedy.splitlines() if fault.action == "cut" else ():
            key, _, value = line.partition(" = ")
            tightest = max if key == "start_s" else min
            ends[key] = tightest(ends.get(key, float(value)), float(value))
    keys = [f"{key} = {value:.9g}" for key, value in sorted(ends.items(), reverse=True)]
    spans = sorted({span for f in faults if f.action == "exclude" for span in f.spans})
    return [*keys, excluded(recording, spans)] if spans else keys


def _samples(fault: Fault) -> str:
    """Sample numbers and how strongly it shows."""
    places = [f"{a}" if b == a + 1 else f"{a} to {b - 1}" for a, b in fault.spans[:SHOWN]]
    more = f" and {len(fault.spans) - SHOWN} more" if len(fault.spans) > SHOWN else ""
    return (
        f"samples {', '.join(places)}{more}; statistic {fault.strength:.3g}, counts from "
        f"{fault.threshold:.3g} on"
    )
