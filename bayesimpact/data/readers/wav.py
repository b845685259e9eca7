"""WAV audio: by SciPy; the numbers as stored, without a unit."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from scipy.io import wavfile

from bayesimpact.data.readers.channel import Channel, check_values, split


def read(path: Path, content: bytes) -> list[Channel]:
    """A channel per track, at the file's rate."""
    rate, samples = wavfile.read(BytesIO(content))
    check_values(samples.size, path)
    tracks = samples.reshape(len(samples), -1)
    found = []
    for i in range(tracks.shape[1]):
        found += split(f"track_{i + 1}", tracks[:, i], interval=1.0 / rate)
    return found
