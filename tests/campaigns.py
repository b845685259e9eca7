"""Writes small campaigns for the tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np

TOML = """name = "rig"
mass_kg = 0.503

[[recording]]
file = "a.csv"
case = "1"

[[recording]]
file = "b.csv"
case = "2"
"""


def decay(n: int = 600, interval: float = 2e-3, amplitude: float = 6e-3) -> np.ndarray:
    """A decaying cosine of 6.4 Hz, (n,), m."""
    t = np.arange(n) * interval
    return -amplitude * np.exp(-0.15 * t) * np.cos(2 * np.pi * 6.4 * t)


def csv(
    samples: np.ndarray | None = None,
    *,
    interval: float = 2e-3,
    header: str = "time_s,displacement_m",
    start: float = 0.0,
    separator: str = ",",
    scale: float = 1.0,
    time_scale: float = 1.0,
) -> str:
    """Text of a recording; the header's names and the scales must belong together."""
    samples = decay() if samples is None else samples
    rows = [
        f"{(start + i * interval) * time_scale:.9g}{separator}{value * scale:.12g}"
        for i, value in enumerate(samples)
    ]
    return "\n".join([header, *rows]) + "\n"


def write(folder: Path, toml: str | bytes = TOML, **files: str | bytes | None) -> Path:
    """Write campaign.toml and recordings (a.csv and b.csv by default; None leaves one out)."""
    folder.mkdir(parents=True, exist_ok=True)
    contents = {"a": csv(), "b": csv(), **files}
    for name, content in {
        "campaign.toml": toml,
        **{f"{n}.csv": c for n, c in contents.items()},
    }.items():
        if content is not None:
            data = content if isinstance(content, bytes) else content.encode()
            (folder / name).write_bytes(data)
    return folder
