"""Records the small cases of this folder anew: `python tests/cases/make.py`, from the root.

Each is a campaign as a user has it, recorded by the independent rig, with `answer.json`: what was
planted, and what a diagnosis that looks for `effects` has to say. A case that once broke belongs
here too, with its answer.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import small_rig  # noqa: E402

from bayesimpact.data.campaign import Campaign  # noqa: E402

LOOKED_FOR = ("coulomb_friction", "quadratic_drag", "contact_hardening", "sensor_drift")


def write(
    name: str,
    campaign: Campaign,
    verdict: str,
    planted: dict[str, dict[str, float]] | None = None,
    faults: tuple[tuple[str, str], ...] = (),
) -> None:
    """One case; the base model's values and those of what was planted are its truth."""
    rig = small_rig.RIG if campaign.stop else small_rig.PLAIN
    values = {"c1": rig.c1, "k1": rig.k1}
    if campaign.stop:
        values |= {"c2": rig.c2, "g": rig.g, **{f"k2[{c}]": k2 for c, k2 in rig.k2.items()}}
    for effect, numbers in (planted or {}).items():
        values |= {f"{effect}.{key}": value for key, value in numbers.items()}
    answer: dict[str, Any] = {
        "effects": LOOKED_FOR,
        "verdict": verdict,
        "named": sorted(planted or {}),
        "faults": faults,
        "truth": values,
    }
    campaign.save(HERE / name)
    text = json.dumps(answer, indent=1) + "\n"
    (HERE / name / "answer.json").write_text(text, encoding="utf-8")


def main() -> None:
    """All of them."""
    stopped = {"rate": 500.0, "duration": 1.2}
    write("nothing_missing", small_rig.record(1, **stopped), "adequate")
    friction = {"coulomb_friction": {"force": 5e-3}}
    plain = small_rig.record(
        2,
        friction,
        rig=small_rig.PLAIN,
        releases=small_rig.PLAIN_RELEASES,
        rate=200.0,
        duration=3.0,
    )
    write("dry_friction_without_a_stop", plain, "named", friction)
    hard = {"contact_hardening": {"stiffness": 1e9}}
    write("a_stop_that_hardens", small_rig.record(3, hard, **stopped), "named", hard)
    right = small_rig.record(4, **stopped)
    first, second, third = right.recordings
    loud = replace(second, samples=1.05 * second.samples)
    scaled = replace(right, recordings=(first, loud, third))
    write("a_gain_of_5_percent", scaled, "named", faults=(("recording_gain", "b"),))


if __name__ == "__main__":
    main()
