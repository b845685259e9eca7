"""What came into a high-pass, from what it let through.

The filter loses a constant and nothing else: a signal is its reading and w times the integral of
that, up to a constant. But an offset of the reading is a line after it, and noise adds up: this
serves where a motion is looked at, the likelihood passes simulations through the filter instead.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.data.recording import Recording


def before_high_pass(recording: Recording, offset: float, state: float = 0.0) -> Recording:
    """What came into a recording's high-pass, which had settled on `state`, where the readings
    after it are counted from `offset`; the recording itself where it has none.
    """
    if not recording.high_pass:
        return recording
    passed = recording.samples - offset
    taken = np.zeros(passed.size)
    taken[1:] = np.cumsum(0.5 * recording.interval * (passed[1:] + passed[:-1]))
    samples = passed + 2.0 * np.pi * recording.high_pass * taken + state
    return replace(recording, samples=samples, high_pass=0.0)


def settled_reading(recording: Recording) -> float:
    """Mean of the second half of the readings, where a high-pass has settled best."""
    used = np.ones(recording.samples.size, dtype=np.bool_)
    used = used if recording.used is None else recording.used
    second = slice(recording.samples.size // 2, None)
    kept = recording.samples[second][used[second]]
    return float(np.mean(kept if kept.size else recording.samples))


def as_it_came(recording: Recording) -> Recording:
    """The same for an offset and a state that are not known yet."""
    return before_high_pass(recording, settled_reading(recording))
