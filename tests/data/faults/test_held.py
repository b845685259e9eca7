"""Held readings in words."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.faults.find import recording_faults
from bayesimpact.data.read import load_campaign


@pytest.mark.parametrize(("same", "words"), [
    (True, "72 readings held at 1.1 mm in 2 place(s)"), (False, "72 readings held in 2 place(s)"),
])  # fmt: skip
def test_readings_held_at_several_values_are_told_without_one(same: bool, words: str) -> None:
    recording = load_campaign(bundled_campaign("paper")).recordings[1]
    x = recording.samples.copy()
    x[2500:2532] = 1.1e-3
    x[4000:4040] = 1.1e-3 if same else 0.7e-3
    (fault,) = recording_faults(replace(recording, samples=x))
    assert len(fault.spans) == 2 and fault.statement.startswith(words)
