"""What the diagnosis says of real recordings, beside what is known of them.

    python tests/benchmarks/real_recordings.py FOLDER

FOLDER holds campaigns `pendulum` (free swing of an encoder pendulum: its sine, and dry friction in
the bearing) and `ship_roll` (roll decay of a ship model: quadratic drag).
They are not part of this project; what is absent is skipped.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import bayesimpact as bi
from bayesimpact.diagnosis.loop import Diagnosis


@dataclass(frozen=True)
class Known:
    """What is known of a campaign: effects, and the residual that is left, % of the signal."""

    effects: tuple[str, ...]
    residual: float
    recording: str


KNOWN: Mapping[str, Known] = {
    "pendulum": Known(("pendulum_sine", "coulomb_friction"), 0.83, "free_swing_3"),
    "ship_roll": Known(("quadratic_drag",), 2.0, "roll_21338"),
}


def residual_percent(found: Diagnosis, recording: str) -> float:
    """Root mean square of what is left of a recording, % of its standard deviation."""
    recordings = found.after.density.oscillator.campaign.recordings
    r = [x.name for x in recordings].index(recording)
    left = np.sqrt(np.mean(found.after.residuals[r] ** 2))
    return float(100 * left / np.std(recordings[r].samples))


def main(argv: Sequence[str] | None = None) -> dict[str, Diagnosis]:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", choices=sorted(KNOWN), action="append")
    given = parser.parse_args(argv)
    folder, only = given.folder, given.only or list(KNOWN)
    results = {}
    for name, known in KNOWN.items():
        if name not in only:
            continue
        if not (folder / name / "campaign.toml").exists():
            print(f"{name}: not here, skipped")
            continue
        found = bi.diagnose(bi.load(folder / name), rng=np.random.default_rng(0))
        results[name] = found
        print(f"{name}: {found.verdict} {' + '.join(e.id for e in found.effects)}")
        print(f"  known: {' + '.join(known.effects)}")
        left = residual_percent(found, known.recording)
        print(f"  residual of {known.recording}: {left:.2f} % (published {known.residual} %)")
        if found.remains is not None:
            print("  something remains")
    return results


if __name__ == "__main__":
    main()
