"""Which recordings are considered."""

from __future__ import annotations

from dataclasses import replace

import pytest
from rivals import base_rivalry

from bayesimpact.design.candidates import first_designs, highest, repeats, variants
from bayesimpact.diagnosis.residual_force.learned import learned_force
from bayesimpact.inference.identify import Identification


def test_releases_against_every_obstacle_and_without(small: Identification) -> None:
    rivals = base_rivalry(small)
    found = first_designs(rivals)
    assert {d.case for d in found if d.kind == "release"} == {"1", "2"}
    assert all(d.y0 < 0 and d.v0 == 0 and d.joins for d in found if d.kind == "release")
    assert max(-d.y0 for d in found) == pytest.approx(1.5 * highest(rivals))
    removed = [d for d in found if d.kind == "stop removed"]
    assert removed and not any(d.stop or d.joins for d in removed)


def test_repeats_are_the_recordings_themselves(small: Identification) -> None:
    found = repeats(base_rivalry(small))
    recordings = small.fit.density.oscillator.campaign.recordings
    assert [d.repeats for d in found] == [r.name for r in recordings]
    assert [d.samples for d in found] == [r.samples.size for r in recordings]


def test_a_learned_force_is_not_trusted_beyond_its_place(small: Identification) -> None:
    rivals = base_rivalry(small)
    learned = replace(rivals.hypotheses[0], effects=(learned_force(-7e-3, 4e-3, 1.0, 1.0),))
    found = first_designs(replace(rivals, hypotheses=(learned,)))
    assert max(-d.y0 for d in found) == pytest.approx(highest(rivals))


def test_variants_change_one_thing_each(small: Identification) -> None:
    rivals = base_rivalry(small)
    design = first_designs(rivals)[3]
    longer, faster, nearer, farther = variants(design, rivals)
    assert longer.duration == 2 * design.duration and longer.interval == design.interval
    assert faster.interval == design.interval / 4 and faster.duration == design.duration
    assert nearer.gap_shift == -farther.gap_shift < 0 and not nearer.joins
