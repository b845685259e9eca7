"""Several channels of one motion under a measured input: they share its state and its input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from driven_rigs import SAMPLES, driven_rig

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.channels import keepers
from bayesimpact.data.input import Input
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify

SEEDS = {0: "a sweep, with a stop", 6: "noise, without", 3: "a base read in space, with a stop"}


def channels(seed: int) -> tuple[Campaign, dict[str, float]]:
    """A probe and an accelerometer on one rig, each with noise of its own; what is true."""
    probe, second = (driven_rig(seed, quantity) for quantity in ("displacement", "acceleration"))
    (first,), (other,) = probe.campaign.recordings, second.campaign.recordings
    # both drew the same numbers: others are put in the place of the accelerometer's
    offset = second.truth["offset[a]"]
    drawn = np.random.default_rng([seed, 1]).standard_normal((1, SAMPLES))[0]
    clean = other.samples - _noise_of(probe.noise, first, probe, second.noise)
    acc = replace(other, name="a_acc", samples=clean + second.noise * drawn)
    together = tuple(replace(r, motion_name="run 1") for r in (first, acc))
    return replace(probe.campaign, recordings=together), probe.truth | {"offset[a_acc]": offset}


def _noise_of(level: float, first: Recording, probe: object, wanted: float) -> np.ndarray:
    """The noise that the rig drew, in another level."""
    given = first.input
    assert given is not None
    clean = probe.displacement + given.carried(first.interval, 0) + 2.0 * level  # type: ignore[attr-defined]
    return (first.samples - clean) / level * wanted


def mode(campaign: Campaign, *, search: bool = False) -> Fit:
    return identify(campaign, rng=np.random.default_rng(0), search=search).fit


@pytest.mark.parametrize("seed", SEEDS)
def test_both_channels_tell_of_one_motion(seed: int) -> None:
    both, truth = channels(seed)
    assert keepers(both.recordings) == ("a", "a")
    fit, alone = mode(both), mode(replace(both, recordings=both.recordings[:1]))
    assert fit.converged and fit.reduced_chi2 == pytest.approx(1.0, abs=0.1)
    assert set(fit.names) == {*alone.names, "offset[a_acc]"}
    known = [(fit.value(name) - value) / fit.sd[fit.names.index(name)] for name, value in
             truth.items()]  # fmt: skip
    assert np.abs(known).max() < 4.0
    for name in ("c1", "k1", "y0[a]", "v0[a]"):
        assert fit.sd[fit.names.index(name)] < 0.95 * alone.sd[alone.names.index(name)], name


def test_search_and_guess_agree() -> None:
    both, _ = channels(0)
    assert identify(both, rng=np.random.default_rng(0), evaluations=3000).agree


def test_excerpts_of_channels_begin_together() -> None:
    """Though an accelerometer's largest readings come elsewhere."""
    both, _ = channels(0)
    late = both.recordings[1].samples * np.linspace(0.0, 1.0, SAMPLES) ** 8
    apart = replace(both, recordings=(both.recordings[0], replace(both.recordings[1],
                                                                  samples=late)))  # fmt: skip
    period = 2 * np.pi * np.sqrt(both.mass / 1e3)
    first, second = apart.excerpt(3 * period).recordings
    assert first.start == second.start and first.samples.size == second.samples.size
    alone = replace(apart, recordings=apart.recordings[1:])
    assert alone.excerpt(3 * period).recordings[0].start > first.start


def test_they_are_written_and_read(tmp_path: Path) -> None:
    both, _ = channels(0)
    both.save(tmp_path)
    assert keepers(load_campaign(tmp_path).recordings) == ("a", "a")


CHANGES: dict[str, Callable[[Input], Input | None]] = {
    "none": lambda given: None,
    "another": lambda given: replace(given, samples=1.01 * given.samples),
    "another gain": lambda given: replace(given, free=not given.free),
}


@pytest.mark.parametrize("change", CHANGES)
def test_another_input_is_refused(tmp_path: Path, change: str) -> None:
    both, _ = channels(0)
    first, second = both.recordings
    assert second.input is not None
    other = replace(second, input=CHANGES[change](second.input))
    replace(both, recordings=(first, other)).save(tmp_path)
    with pytest.raises(InputError, match=r"key motion: found .* with another input") as refused:
        load_campaign(tmp_path)
    assert "accepted: that of a, of this motion" in str(refused.value)
