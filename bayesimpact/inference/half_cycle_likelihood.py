"""Log likelihood by half cycles: the parts that leave-one-out cross-validation may leave out.

Leaving one part out asks how well all others predict it, and counts the parts as independent.
- Samples are none: under a model that is wrong, neighbours of one motion err together, each is told
  by the next, and the difference of two models comes with a standard error that is far too small.
- Recordings neither: each has a release and a rest reading of its own, which nothing else tells.
  Left out, these fall back to their priors, and the importance weights fail (Pareto k above 0.7).
- A half cycle, from one passage through rest to the next, holds one whole impact or the free half
  cycle between two; the motion before and after it tells its release, and what the model lacks
  shows in each anew.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.likelihood import Likelihood

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_BLOCKS = 1000
"""Most parts of all recordings together; where more would be, a part is several half cycles."""
_CHUNK_SAMPLES = 4_000_000  # residuals held at once, so that memory stays bounded


@dataclass(frozen=True, eq=False)
class Blocks:
    """Consecutive parts of one recording: the first sample of each, and what each has of the whole.

    Attributes
    ----------
    first : (K,) first samples
    sizes : (K,) independent numbers
    log_volumes : (K,) log determinants of the whitening
    shift : samples of the recording before the first of the whitened signal
    """

    first: Index
    sizes: Array
    log_volumes: Array
    shift: int


def half_cycle_blocks(likelihood: Likelihood, theta: Array) -> tuple[Blocks, ...]:
    """The parts of every recording, by the motion that the model has at `theta` (d,)."""
    displacements = likelihood.oscillator.displacements(theta)
    return tuple(_blocks(likelihood, r, y) for r, y in enumerate(displacements))


def log_likelihood(likelihood: Likelihood, theta: Array, blocks: tuple[Blocks, ...]) -> Array:
    """Log likelihood (B, K) of the parts of all recordings one after another, for draws (B, d).

    Their sum over a recording is that of `Likelihood.per_recording`; -inf where inadmissible.
    """
    counts = likelihood.oscillator.counts
    size = max(1, _CHUNK_SAMPLES // (counts.size * int(counts.max())))
    parts = [_chunk(likelihood, theta[i : i + size], blocks) for i in range(0, len(theta), size)]
    return np.concatenate(parts)


def _blocks(likelihood: Likelihood, r: int, displacement: Array) -> Blocks:
    noise, recording = likelihood.noise, likelihood.oscillator.campaign.recordings[r]
    counted = np.ones(displacement.size) if recording.used is None else 1.0 * recording.used
    white = np.zeros(int(likelihood.sizes[r]))
    signal, start = noise.in_time(white, displacement.size, recording.interval, recording.used)
    shift = round(start / recording.interval)
    counted[:shift] = counted[shift + signal.size :] = 0.0
    passages = np.flatnonzero(np.diff(displacement > 0.0)) + 1
    most = max(MOST_BLOCKS // len(likelihood.sizes), 1)
    every = -(-(passages.size + 1) // most)
    first = np.append(0, passages[every - 1 :: every])
    ends = np.append(first[1:], counted.size)
    contained = np.array([counted[a:b].sum() for a, b in zip(first, ends, strict=True)])
    first, contained = first[contained > 0.0], contained[contained > 0.0]
    sizes = likelihood.sizes[r] * contained / contained.sum()
    volumes = likelihood.log_volume[r] * contained / contained.sum()
    if noise.grows:
        logs = counted * np.log(noise.relative_sd(recording))
        own = np.add.reduceat(logs, first)
        volumes += contained / contained.sum() * own.sum() - own
    return Blocks(first, sizes, volumes, shift)


def _chunk(likelihood: Likelihood, theta: Array, blocks: tuple[Blocks, ...]) -> Array:
    found = []
    seen = likelihood.seen(theta)
    recordings = likelihood.oscillator.campaign.recordings
    for r, (recording, b) in enumerate(zip(recordings, blocks, strict=True)):
        white = likelihood.residual(r, seen[r])
        signal, _ = likelihood.noise.in_time(
            white, recording.samples.size, recording.interval, recording.used
        )
        places = np.clip(b.first - b.shift, 0, signal.shape[1] - 1)
        squares = signal**2
        if likelihood.steps[r] > 0.0:
            squares = squares + likelihood.coarse_squares(r, seen[r])
        sums = np.add.reduceat(squares, places, axis=1)
        sigma = theta[:, likelihood.sigma_columns[r], None]
        with np.errstate(divide="ignore", invalid="ignore"):
            value = b.log_volumes - b.sizes * (np.log(sigma) + 0.5 * np.log(2 * np.pi))
            value = value - sums / (2 * sigma**2)
        found.append(np.where((sigma > 0) & np.isfinite(value), value, -np.inf))
    return np.concatenate(found, axis=1)
