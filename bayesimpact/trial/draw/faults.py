"""Faults put into recordings of the independent rig, and whether an answer finds them.

Sizes run from just visible to plain to see, logarithmically. A fault is put into one recording at
random; everything else about the campaign is sound.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayesimpact.data.campaign import Campaign, Smoothing
from bayesimpact.data.recording import Recording
from bayesimpact.model.measurement import smooth
from bayesimpact.trial.draw.designs import log_uniform

Rng = np.random.Generator
Place = tuple[float, float]


@dataclass(frozen=True)
class PlantedFault:
    """One kind of fault.

    Attributes
    ----------
    id : under which it has to be found
    put : (recording, noise m, generator) -> recording, place in s, size
    timed : whether the place has to be found as well as the recording
    stop : whether it needs an obstacle, or several, to be seen at all
    """

    id: str
    put: Callable[[Recording, float, Rng], tuple[Recording, Place, float]]
    timed: bool = True
    stop: bool = False


def _period(recording: Recording) -> float:
    from bayesimpact.data.period import crossing_period

    return crossing_period(recording.samples, 1.0) or recording.samples.size / 10


def _new(
    recording: Recording, samples: np.ndarray, first: int, end: int
) -> tuple[Recording, Place]:
    """The recording with other samples, and the place in time of samples first..end-1."""
    dt = recording.interval
    return replace(recording, samples=samples), (first * dt, (end - 1) * dt)


def _middle(recording: Recording, length: int, rng: Rng) -> int:
    """A place in the first two thirds, where there is motion."""
    size = recording.samples.size
    return int(rng.integers(size // 20, max(2 * size // 3 - length, size // 20 + 1)))


def spikes(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """One to five spikes of one to three samples, 15 to 400 times the noise."""
    x, size = r.samples.copy(), noise * log_uniform(rng, (15.0, 400.0))
    count, width = int(rng.integers(1, 6)), int(rng.integers(1, 4))
    places = sorted(
        int(i) for i in rng.choice(np.arange(50, x.size - 50, 60), count, replace=False)
    )
    for i in places:
        x[i : i + width] += size * rng.choice([-1, 1])
    return *_new(r, x, places[0], places[-1] + width), size


def held(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """A reading held, or zeros, for 8 to 200 samples."""
    x, count = r.samples.copy(), int(log_uniform(rng, (8.0, 200.0)))
    i = _middle(r, count, rng)
    x[i : i + count] = 0.0 if rng.random() < 0.3 else x[i - 1]
    return *_new(r, x, i, i + count), float(count)


def slip(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """A fiftieth to a quarter of a period lost, or written twice."""
    count = max(2, int(log_uniform(rng, (0.02, 0.25)) * _period(r)))
    i = _middle(r, count, rng) + count
    x = r.samples
    lost = rng.random() < 0.7
    new = np.delete(x, np.arange(i, i + count)) if lost else np.concatenate([x[:i], x[i - count :]])
    return *_new(r, new, i - 1, i + 1), float(count if lost else -count)


def clipped(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """A range that ends at 60 to 95 % of the largest excursion away from the stop."""
    limit = float(r.samples.min()) * rng.uniform(0.6, 0.95)
    hit = np.flatnonzero(r.samples <= limit)
    return *_new(r, np.maximum(r.samples, limit), int(hit[0]), int(hit[-1]) + 1), limit


def start(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """Rest before the release for 0.3 to 5 periods, or a slow pull as well."""
    count = int(log_uniform(rng, (0.3, 5.0)) * _period(r))
    first = float(np.mean(r.samples[:2]))
    still = np.full(count, first)
    if rng.random() < 0.4:
        pull = int(3 * _period(r))
        ramp = first * np.linspace(0.0, 1.0, pull)
        still = np.concatenate([np.zeros(count), ramp, still])
    still = still + noise * rng.standard_normal(still.size)
    x = np.concatenate([still, r.samples])
    return *_new(r, x, 0, still.size), float(still.size)


def louder(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """Noise 4 to 30 times as large over a tenth to a third of the recording."""
    count = int(rng.uniform(0.1, 0.33) * r.samples.size)
    i = int(rng.integers(0, r.samples.size - count))
    x, by = r.samples.copy(), log_uniform(rng, (4.0, 30.0))
    x[i : i + count] += by * noise * rng.standard_normal(count)
    return *_new(r, x, i, i + count), by


def reversed_sign(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """The other sign."""
    return *_new(r, -r.samples, 0, r.samples.size), -1.0


def gain(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """A gain 0.3 to 20 % off, or a factor of 1000."""
    by = 1.0 + log_uniform(rng, (0.003, 0.2)) * rng.choice([-1, 1])
    by = 1e3 if rng.random() < 0.2 else float(by)
    return *_new(r, r.samples * by, 0, r.samples.size), by


def clock(r: Recording, noise: float, rng: Rng) -> tuple[Recording, Place, float]:
    """A clock 0.02 to 1 % off."""
    by = float(1.0 + log_uniform(rng, (2e-4, 1e-2)) * rng.choice([-1, 1]))
    return replace(r, interval=r.interval * by), (0.0, r.duration), by


PLANTED_FAULTS: Mapping[str, PlantedFault] = {
    "spikes": PlantedFault("recording_spikes", spikes),
    "held": PlantedFault("recording_held", held),
    "slip": PlantedFault("recording_slip", slip),
    "clipped": PlantedFault("recording_clipped", clipped),
    "start": PlantedFault("recording_start", start),
    "noise": PlantedFault("recording_noise", louder),
    "reversed": PlantedFault("recording_reversed", reversed_sign, False, True),
    "gain": PlantedFault("recording_gain", gain, False, True),
    "clock": PlantedFault("recording_clock", clock, False, True),
    "case": PlantedFault("recording_case", reversed_sign, False, True),
    "duplicate": PlantedFault("recording_duplicate", reversed_sign, False),
}
"""Kinds of faults by a word. Labels and duplicates change the campaign, see `plant_fault`."""


def plant_fault(
    campaign: Campaign, kind: str, noise: float, rng: Rng
) -> tuple[Campaign, dict[str, Any]] | None:
    """A campaign with one fault, and the truth about it; None where the rig cannot show it."""
    entry = PLANTED_FAULTS[kind]
    if (entry.stop and not campaign.stop) or (kind == "case" and len(campaign.cases) < 2):
        return None
    recordings = list(campaign.recordings)
    number = int(rng.integers(len(recordings)))
    one = recordings[number]
    place, size = (0.0, one.duration), 1.0
    if kind == "case":
        other = rng.choice([c for c in campaign.cases if c != one.case])
        recordings[number] = replace(one, case=str(other))
    elif kind == "duplicate":
        one = replace(one, name=f"{one.name}_again")
        recordings.append(one)
    else:
        spoiled, place, size = entry.put(one, noise, rng)
        recordings[number] = _filtered(kind, one, spoiled, campaign.measurement.smoothing)
    truth = {
        "id": entry.id,
        "recording": one.name,
        "start_s": place[0],
        "end_s": place[1],
        "size": size,
        "timed": entry.timed,
    }
    return replace(campaign, recordings=tuple(recordings)), truth


def _filtered(
    kind: str, sound: Recording, spoiled: Recording, smoothing: Smoothing | None
) -> Recording:
    """Noise that a fault adds passes the campaign's filter as all noise does."""
    if smoothing is None or kind not in ("start", "noise"):
        return spoiled
    samples = spoiled.samples.copy()
    if kind == "start":
        before = samples.size - sound.samples.size
        samples[:before] = smooth(samples, smoothing, sound.interval)[:before]
    else:
        samples = sound.samples + smooth(samples - sound.samples, smoothing, sound.interval)
    return replace(spoiled, samples=samples)


def score_fault(truth: Mapping[str, Any], found: Sequence[Mapping[str, Any]]) -> str:
    """`named`, `missed`, `elsewhere` (another recording or time) or `wrong name`.

    `found` are faults with id, recording, start_s and end_s, notices left out. A duplicate may be
    called by either name; times have to overlap.
    """
    if not found:
        return "missed"
    ids = {f["id"] for f in found}
    if ids != {truth["id"]}:
        return "wrong name"
    names = {truth["recording"], truth["recording"].removesuffix("_again")}
    for fault in found:
        if fault["recording"] not in names:
            return "elsewhere"
        overlaps = fault["start_s"] <= truth["end_s"] and truth["start_s"] <= fault["end_s"]
        if truth["timed"] and not overlaps:
            return "elsewhere"
    return "named"
