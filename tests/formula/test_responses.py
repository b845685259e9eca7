"""Responses to small forces along a motion, against motions simulated with these forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_rig import PLAIN, PLAIN_RELEASES, RELEASES, RIG, record, vector

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.input import Input
from bayesimpact.data.recording import Recording
from bayesimpact.formula.grammar import ONE, Power, Term
from bayesimpact.formula.law import effect_id, effect_of, starts_of
from bayesimpact.formula.responses import forces_along, largest_force, motion_of, responses
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import identify
from bayesimpact.model.oscillator import build_oscillator

SIGN, V, DRAG = Power(0.0, True), Power(1.0, True), Power(2.0, True)
FREE = (
    Term("everywhere", ONE, SIGN),
    Term("everywhere", ONE, DRAG),
    Term("everywhere", Power(3.0, True)),
    Term("everywhere", Power(1.0, True), SIGN),
    Term("everywhere", ONE, V, drift=1),
    Term("everywhere", ONE, SIGN, fade=0.05),
    Term("everywhere", ONE, V, fade=0.1),
    Term("everywhere", ONE, V, fade=0.1, lorentzian=True),
    Term("beyond", Power(1.0, False), side=-1, place=3e-3),
    Term("bump", Power(1.0, True), ONE, -1, 2e-3, 7e-4),
    Term("bump", ONE, V, -1, 2e-3, 7e-4),
    Term("box", ONE, V, -1, 2e-3, 7e-4),
    Term("box", ONE, SIGN, -1, 2e-3, 7e-4),
)
CONTACT = (
    Term("contact", ONE),
    Term("contact", Power(1.5, False)),
    Term("contact", Power(1.0, False), V),
    Term("contact", ONE, DRAG),
    Term("contact", Power(1.0, False), place=5e-4),
)


def fitted(campaign: Campaign) -> Fit:
    return identify(campaign, rng=np.random.default_rng(0), search=False).fit


@pytest.fixture(scope="module")
def with_stop() -> Fit:
    return fitted(record(rig=RIG, releases=RELEASES[:2], duration=1.0))


@pytest.fixture(scope="module")
def without_stop() -> Fit:
    return fitted(record(rig=PLAIN, releases=PLAIN_RELEASES[:1], duration=1.0))


@pytest.fixture(scope="module")
def driven() -> Fit:
    """Forced by noise, nine samples a period, until e^-170 of what began it is left."""
    rng, n = np.random.default_rng(5), 5000
    force = Input(1e5 * np.convolve(rng.standard_normal(n), np.ones(4) / 4, mode="same"))
    recording = Recording("driven", "", np.zeros(n), 1.6e-3, input=force)
    oscillator = build_oscillator(Campaign("driven", 1.0, (recording,), stop=False))
    known = {name: 0.0 for name in oscillator.layout.names} | {"c1": 43.0, "k1": 190e3}
    (samples,) = oscillator.displacements(vector(oscillator.layout, known))
    reach = float(np.abs(samples).max())
    samples = samples + 1e-4 * reach * rng.standard_normal(n)
    return fitted(Campaign("driven", 1.0, (replace(recording, samples=samples),), stop=False))


def simulated(fit: Fit, term: Term, size: float) -> tuple[np.ndarray, ...]:
    """Difference of two simulated motions over the size of the force that makes it, m/unit."""
    campaign = fit.density.oscillator.campaign
    effect = effect_of(term, 1.0, 6.5e-3, 0.3, signed=True)
    assert effect.law is not None  # dry friction as a law too: the motion does not stick here
    with_it = build_oscillator(campaign, (effect,))
    known = dict(zip(fit.names, fit.mode, strict=True)) | starts_of(term)
    both = []
    for value in (size, -size):
        values = known | {f"{effect_id(term)}.size": value}
        both.append(with_it.displacements(vector(with_it.layout, values)))
    return tuple((a - b) / (2 * size) for a, b in zip(*both, strict=True))


def away(fit: Fit, term: Term) -> float:
    """Largest difference of both responses over the larger one, all recordings."""
    motions = [motion_of(fit, r) for r in range(len(fit.predicted))]
    size = 5e-4 / max(largest_force([m], [term], [1.0]) for m in motions)
    wanted = simulated(fit, term, size)
    found = [responses(m, [term])[0][0] for m in motions]
    return max(
        float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(found, wanted, strict=True)
    )


@pytest.mark.parametrize("term", FREE, ids=effect_id)
def test_response_is_that_of_a_simulation_without_a_stop(without_stop: Fit, term: Term) -> None:
    assert away(without_stop, term) < 0.02


@pytest.mark.parametrize("term", FREE[1:4], ids=effect_id)
def test_response_to_an_input_outlasts_what_began_the_motion(driven: Fit, term: Term) -> None:
    assert len(motion_of(driven, 0).changes.stretches) > 3
    assert away(driven, term) < 0.02


@pytest.mark.parametrize("term", (*FREE, *CONTACT), ids=effect_id)
def test_response_is_that_of_a_simulation_with_a_stop(with_stop: Fit, term: Term) -> None:
    assert away(with_stop, term) < 0.02


def test_forces_that_share_factors_are_those_of_the_terms_alone() -> None:
    y, v, t = (np.random.default_rng(i).uniform(-1, 1, 50) for i in range(3))
    path = 6e-3 * y, 0.3 * v, 6e-3 * y - 1e-3, 1 + t
    for term, force in zip((*FREE, *CONTACT), forces_along(path, (*FREE, *CONTACT)), strict=True):
        np.testing.assert_allclose(force, term.force(*path), rtol=1e-12, err_msg=term.text())
