"""All faults of a campaign's recordings, and the campaign without them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.clipped import behind_filter, find_clipped
from bayesimpact.data.faults.duplicate import find_duplicates
from bayesimpact.data.faults.fault import Fault, Span
from bayesimpact.data.faults.held import find_held
from bayesimpact.data.faults.hum import find_hum_notice
from bayesimpact.data.faults.loud_part import find_loud_part
from bayesimpact.data.faults.noise import find_noise, loud_recordings
from bayesimpact.data.faults.quantised import find_quantised
from bayesimpact.data.faults.shock import find_shock
from bayesimpact.data.faults.slip import find_slips
from bayesimpact.data.faults.spikes import find_spikes
from bayesimpact.data.faults.start import find_start
from bayesimpact.data.faults.tail import without_tail
from bayesimpact.data.faults.wander import without_wander
from bayesimpact.data.gaps import without
from bayesimpact.data.recording import Recording

DETECTORS: tuple[Callable[[Recording], list[Fault]], ...] = (
    find_quantised,
    find_held,
    find_clipped,
    find_start,
    find_noise,
    find_spikes,
    find_loud_part,
    find_slips,
    find_shock,
    find_hum_notice,
)
"""In this order, each on the recording without what the earlier ones found."""

FREE = (find_start, find_noise, find_loud_part, find_shock, find_hum_notice)
"""Those that know a free decay only: under an input, rest, loud parts and lines are what it makes
of them."""
DRIVEN = tuple(detector for detector in DETECTORS if detector not in FREE)


def find_faults(campaign: Campaign) -> tuple[Fault, ...]:
    """Everything found in the recordings themselves, in their order; sample numbers as read."""
    smoothing = campaign.measurement.smoothing
    found = [
        behind_filter(fault, r, smoothing)
        for r in campaign.recordings
        for fault in recording_faults(r)
    ]
    found += find_duplicates(campaign.recordings)
    found += loud_recordings([r for r in campaign.recordings if r.input is None])
    order = [r.name for r in campaign.recordings]
    return tuple(sorted(found, key=lambda fault: order.index(fault.recording)))


def recording_faults(recording: Recording) -> list[Fault]:
    """What is wrong with one recording, from itself alone."""
    found: list[Fault] = []
    rest, offset = recording, 0
    for detector in DETECTORS if recording.input is None else DRIVEN:
        new = [_shifted(fault, offset) for fault in detector(rest)]
        new = [fault for fault in new if _fresh(recording, fault)]
        found += new
        for fault in new:
            try:
                rest, offset = applied(recording, found)
            except ValueError:  # hardly anything would be left: it stays, and is told
                found[-1] = replace(fault, action="notice", remedy="")
    return found


def _shifted(fault: Fault, by: int) -> Fault:
    return replace(fault, spans=tuple((a + by, b + by) for a, b in fault.spans))


def _fresh(recording: Recording, fault: Fault) -> bool:
    """False where everything found was set aside already by campaign.toml."""
    if recording.used is None or fault.action == "notice":
        return True
    return any(recording.used[a:b].any() for a, b in fault.spans)


def applied(recording: Recording, faults: Sequence[Fault]) -> tuple[Recording, int]:
    """The recording without its faults, and how many samples its start has lost.

    Raises `ValueError` when less than a fifth of the samples would be left.
    """
    spans: list[Span] = [s for f in faults if f.action == "exclude" for s in f.spans]
    rest = without(recording, spans) if spans else recording
    first, end = 0, recording.samples.size
    for fault in faults:
        if fault.action == "cut":
            for a, b in fault.spans:
                first, end = (max(first, b), end) if a == 0 else (first, min(end, a))
    if end - first < 0.2 * recording.samples.size:
        raise ValueError(f"{end - first} of {recording.samples.size} samples left")
    if (first, end) == (0, recording.samples.size):
        return rest, 0
    return rest.part(first, end), first


def set_aside(campaign: Campaign) -> tuple[Campaign, tuple[Fault, ...]]:
    """The campaign without the faults found in its recordings, and the faults.

    With `faults = "keep"` in campaign.toml the campaign stays as it is; faults are told all the
    same. What was done stands in `Campaign.notes`, which reports print; of repeated readings of a
    motion that has died away (`tail`), and of a zero that wanders, there are notices, too.
    """
    faults = find_faults(campaign)
    if campaign.keep_faults:
        return campaign, faults
    kept, changed = list[Recording](), list[Fault]()
    for recording in campaign.recordings:
        own = [f for f in faults if f.recording == recording.name]
        if not any(f.action == "skip" for f in own):
            moving, lost = applied(recording, own)
            rest, tail = without_tail(moving)
            rest, wander = without_wander(rest)
            kept.append(rest)
            changed += [_shifted(f, lost) for f in (tail, wander) if f]
    hard = [f for f in faults if f.action != "notice"]
    if not (hard or changed):
        return campaign, faults
    skipped = {f.recording: f.statement for f in hard if f.action == "skip"}
    notes = tuple(f"{f.recording}, {f.statement}" for f in (*hard, *changed))
    cleaned = replace(
        campaign,
        recordings=tuple(kept),
        skipped={**campaign.skipped, **skipped},
        notes=(*campaign.notes, *notes),
    )
    return cleaned, (*faults, *changed)
