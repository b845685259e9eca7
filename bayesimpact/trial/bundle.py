"""Makes the bundled campaigns again: `python -m bayesimpact.trial.bundle paper [--out FOLDER]`."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from bayesimpact.data.campaign import Beam, Campaign
from bayesimpact.trial.rig.files import TRUTH_FILE, write_campaign
from bayesimpact.trial.rig.measuring_chain import MeasuringChain
from bayesimpact.trial.rig.recordings import Effects, Release, Rig, make_campaign

PAPER_RIG = Rig(
    mass=0.503,
    c1=0.148,
    k1=808.556,
    c2=2.085,
    g=1.1e-3,
    k2={"1": 5350.156, "2": 4776.275, "3": 2959.249},
)
"""Identified values of Tian et al., Table 2."""

PAPER_BEAMS: Mapping[str, Beam] = {
    "1": Beam(length=0.133, width=0.010, thickness=3.05e-3, youngs_modulus=1.75e11),
    "2": Beam(length=0.139, width=0.010, thickness=3.05e-3, youngs_modulus=1.75e11),
    "3": Beam(length=0.130, width=0.010, thickness=2.47e-3, youngs_modulus=1.75e11),
}
"""Geometry of the elastic beams of Tian et al., Table 1."""

PAPER_HEIGHTS = (("a", -6.5e-3), ("b", -5.0e-3), ("c", -4.0e-3))

DECIMALS = 5  # of a millimetre in the files: 10 nm, 1/500 of the noise


def paper_releases(rng: np.random.Generator) -> tuple[Release, ...]:
    """Nine releases by hand from the far side: 0.05 mm and 1 mm/s of scatter (standard deviations).

    The rig has been released a little before the first sample, so it moves slowly there.
    """
    return tuple(
        Release(
            name=f"case{case}_{letter}",
            case=case,
            y0=float(height + 0.05e-3 * rng.standard_normal()),
            v0=float(1e-3 * rng.standard_normal()),
        )
        for case in PAPER_RIG.k2
        for letter, height in PAPER_HEIGHTS
    )


def paper_campaign() -> Campaign:
    """Nine recordings of 6 s at 1 kHz at the values of Table 2.

    White probe noise of 5 um, rest readings scattered by 10 um; nothing else.
    """
    return _recorded("simulated at the values of Table 2", 20180615)


def _recorded(words: str, seed: int, effects: Effects | None = None) -> Campaign:
    rng = np.random.default_rng(seed)
    releases = paper_releases(rng)
    offsets = {release.name: float(10e-6 * rng.standard_normal()) for release in releases}
    return make_campaign(
        f"Impact rig, three beams ({words})",
        PAPER_RIG,
        releases,
        effects,
        chain=MeasuringChain(noise=5e-6, offsets=offsets),
        rate=1000.0,
        duration=6.0,
        rng=rng,
        beams=PAPER_BEAMS,
    )


CONCEALED_EFFECTS: Mapping[str, Mapping[str, float]] = {
    "contact_damping_speed": {"coefficient": 0.06},
    "gap_wear": {"step": 8e-8},
}
"""What `data/concealed` hides: damping that grows with indentation speed, a bolt that wears."""


CONCEALED_SEED = 20231104
"""The median of 25 draws by the distance of the answer from the truth:
tests/benchmarks/typical_draw.py."""


def concealed_campaign(seed: int = CONCEALED_SEED) -> Campaign:
    """The campaign again, from a rig with two effects that the paper suspects of its own."""
    return _recorded("simulated; something is concealed", seed, CONCEALED_EFFECTS)


def concealed_truth() -> dict[str, object]:
    """What `concealed_campaign` hides, and the values it was made from."""
    rig = PAPER_RIG
    parameters = {"c1": rig.c1, "k1": rig.k1, "c2": rig.c2, "g": rig.g}
    parameters |= {f"k2[{case}]": value for case, value in rig.k2.items()}
    effects = {
        f"{effect}.{name}": value
        for effect, values in CONCEALED_EFFECTS.items()
        for name, value in values.items()
    }
    return {"effects": list(CONCEALED_EFFECTS), "parameters": parameters | effects}


CAMPAIGNS: Mapping[str, Callable[[], Campaign]] = {
    "paper": paper_campaign,
    "concealed": concealed_campaign,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Write one bundled campaign into `data/`, or into the folder given with --out."""
    parser = argparse.ArgumentParser(prog="python -m bayesimpact.trial.bundle")
    parser.add_argument("campaign", choices=sorted(CAMPAIGNS))
    parser.add_argument("--out", type=Path, help="folder to write (default: data/<campaign>)")
    chosen = parser.parse_args(arguments)
    folder = chosen.out or Path(__file__).resolve().parents[2] / "data" / chosen.campaign
    comment = f"Made by: python -m bayesimpact.trial.bundle {chosen.campaign}"
    write_campaign(folder, CAMPAIGNS[chosen.campaign](), decimals=DECIMALS, comment=comment)
    if chosen.campaign == "concealed":
        truth = json.dumps(concealed_truth(), indent=1)
        (folder / TRUTH_FILE).write_text(truth + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
