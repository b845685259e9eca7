"""Campaigns that nobody expects but the door lets in: each ends in a report with all its parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from campaigns import TOML, csv, decay, write
from small_rig import record

from bayesimpact.data.read import load_campaign
from bayesimpact.workflow import fit_campaign

PLAIN = 'name = "rig"\nmass_kg = 0.503\nstop = false\n[[recording]]\nfile = "a.csv"\n'
FAR = '[priors]\nk1 = { distribution = "normal", mean = 1600.0, sd = 1e-3 }\n'
NAMES = (
    PLAIN.replace("stop = false\n", "").replace('"rig"', '"$x$ <b>&amp; \\\\frac{ é"')
    + f'case = "{"$][" * 66}"\n'
)


def noisy(samples: np.ndarray) -> np.ndarray:
    return samples + 5e-6 * np.random.default_rng(0).standard_normal(samples.size)


def of_the_rig(rest: int = 0) -> str:
    """A release of the small rig, after some samples at rest in the hand."""
    samples = record(seed=3, duration=1.0).recordings[0].samples
    return csv(noisy(np.concatenate([np.full(rest, samples[0]), samples])), interval=1e-3)


STRANGE = {
    "no noise": (PLAIN, csv()),
    "no noise and no contact": (TOML, csv()),
    "steps of 1 mm": (PLAIN, csv(np.round(noisy(decay()), 3))),
    "growing": (PLAIN, csv(noisy(decay())[::-1])),
    "a mass of 1e-15 kg": (PLAIN.replace("0.503", "1e-15"), csv(noisy(decay()))),
    "a prior of twice the stiffness": (PLAIN + FAR, csv(noisy(decay()))),
    "rest before the release": (TOML, of_the_rig(300)),
    "names": (NAMES, of_the_rig()),
}


@pytest.mark.parametrize("kind", STRANGE)
def test_a_strange_campaign_ends_in_a_report(kind: str, tmp_path: Path) -> None:
    toml, content = STRANGE[kind]
    campaign = load_campaign(write(tmp_path / "campaign", toml, a=content, b=content))
    made = fit_campaign(campaign, tmp_path / "out")
    assert dict(made.failed) == {}
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000
    assert all(np.isfinite(row.median) for row in made.results.rows)
