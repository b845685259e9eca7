"""Sizes, shifts and sentences of a diagnosis."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_rig
from effect_rigs import BY_ID, with_effect

from bayesimpact.diagnosis.words import parameter_shifts, statement, summary


def test_shifts_are_what_ignoring_did(small):
    moved = replace(small.fit, mode=small.fit.mode - 3 * small.fit.sd)
    shifts = parameter_shifts(small.fit, moved)
    assert set(shifts) == {"c1", "k1", "c2", "g", "k2[1]", "k2[2]"}
    np.testing.assert_allclose(list(shifts.values()), 3.0)
    split = with_effect(small, "gap_per_recording")
    assert "g" not in parameter_shifts(small.fit, split)


@pytest.mark.parametrize("effect_id", BY_ID)
def test_every_effect_has_its_sentence(effect_id):
    text = statement(BY_ID[effect_id], "3 N", 0.012, {"k1": -1.0, "k2[1]": 7.25})
    assert "{" not in text and "3 N" in text
    assert text.endswith("Ignoring it moved k2[1] by +7.2 of its standard deviations.")
    assert "Ignoring" not in statement(BY_ID[effect_id], "3 N", 0.012, {})


def place(regime: str):
    return SimpleNamespace(regime=regime, displacement=(-2e-3, 1.5e-3), force_rms=0.012)


def test_the_paragraph():
    friction = (BY_ID["coulomb_friction"],)
    shifts = {"k1": 1.0, "k2[1]": -8.2, "k2[2]": 3.0}
    said = summary("adequate", (), (), None, (), {}, "Limits.")
    assert said.startswith("Nothing is missing") and said.endswith("Limits.")
    said = summary("named", friction, ("It rubs.",), place("free"), (), shifts, "")
    assert "dry friction" in said and "It rubs." in said and "suspension" in said
    assert "k2[1] by 8.2" in said
    said = summary("ambiguous", friction, ("",), place("contact"), ("gap_wear",), shifts, "")
    assert "gap_wear" in said and "cannot tell" in said and "obstacle" in said
    said = summary("unknown", (), (), place("contact"), (), {"k1": -4.0}, "")
    assert "-2.00 and 1.50 mm" in said and "0.012 N rms" in said and "k1 by 4.0" in said
    wide = SimpleNamespace(regime="free", displacement=(-0.3, 0.31), force_rms=0.012)
    said = summary("unknown", (), (), wide, (), {}, "", angle=True)
    assert "-0.30 and 0.31 rad" in said and "0.012 N m rms" in said


def test_recordings_keep_their_truth(small):
    """The helpers above leave the shared fit as it was."""
    assert small.fit.value("k1") == pytest.approx(small_rig.RIG.k1, rel=1e-3)
