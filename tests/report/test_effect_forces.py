"""Forces of named effects along the motion, against laws written out here."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from diagnosed import diagnosed

from bayesimpact.report.captions import caption
from bayesimpact.report.cycles import contacts, offset_of
from bayesimpact.report.diagnosis.effect_forces import effect_forces, shown_cycle, without_force
from bayesimpact.report.figures.story import story_figures
from bayesimpact.report.results import Array, Results, Row

VALUES = {
    "contact_damping_speed.coefficient": 0.06,
    "gap_wear.step": 2e-6,
    "coulomb_friction.force": 1e-3,
    "quadratic_drag.coefficient": 0.02,
    "contact_relaxation.stiffness": 100.0,
    "contact_relaxation.time": 0.01,
}
WHOLE = slice(None)


def named(*ids: str) -> Results:
    """A diagnosis that names these effects, with rows of their parameters."""
    results = diagnosed(effects=[{"id": i, "parameters": {}} for i in ids])
    rows = [row(results.rows[0], name, x) for name, x in VALUES.items()]
    return with_base(replace(results, rows=(*results.rows, *rows)))


def with_base(results: Results) -> Results:
    """With a base model that is wrong everywhere."""
    wrong = np.concatenate([r.predicted + 3e-5 for r in results.recordings])
    arrays = {**results.diagnosis_arrays, "before_predicted": wrong}
    return replace(results, diagnosis_arrays=arrays)


def row(like: Row, name: str, value: float) -> Row:
    return replace(like, name=name, unit="-", role="effect", mode=value, median=2 * value)


def motion(results: Results) -> tuple[Array, Array]:
    recording = results.recordings[0]
    y = recording.predicted - offset_of(results, recording)
    return y, np.gradient(y, recording.interval)


@pytest.mark.parametrize(
    "effect", ["contact_damping_speed", "gap_wear", "coulomb_friction", "quadratic_drag"]
)
def test_forces_are_those_of_the_laws_at_the_mode(effect: str) -> None:
    results = named(effect)
    y, v = motion(results)
    known = {r.name: r.mode for r in results.rows}
    gap, stiffness = known["g"], known[f"k2[{results.recordings[0].case}]"]
    inside = y > gap
    earlier, before = np.zeros(y.size), 0
    for i in range(1, y.size):
        before += bool(inside[i] and not inside[i - 1])
        earlier[i] = max(before - 1, 0)
    laws: dict[str, Any] = {
        "contact_damping_speed": 0.06 * np.abs(v) * v * inside,
        "gap_wear": -stiffness * 2e-6 * earlier * inside,
        "coulomb_friction": 1e-3 * np.sign(v),
        "quadratic_drag": 0.02 * np.abs(v) * v,
    }
    (found,) = effect_forces(results, 0, WHOLE).values()
    assert np.any(laws[effect]) and np.max(np.abs(laws[effect] - found)) < 1e-12


def test_laws_with_a_memory_are_left_out_and_said_to_be() -> None:
    results = named("contact_relaxation", "quadratic_drag")
    assert list(effect_forces(results, 0, WHOLE)) == ["quadratic drag"]
    assert without_force(results) == ["relaxation of the obstacle"]
    assert "being no force along it: relaxation of the obstacle" in caption("story", results)


def test_the_picture_shows_the_force_of_what_was_named_and_where_it_acts() -> None:
    """Once what was left unexplained, largest in free flight, beside "beginning of contact"."""
    results = named("contact_damping_speed")
    lowest = story_figures(results)["story"].axes[-1]
    (line,) = (x for x in lowest.lines if "contact damping" in str(x.get_label()))
    assert "named" in lowest.get_ylabel() and "forces of what was named" in caption(
        "story", results
    )
    t, force = (np.asarray(x) for x in (line.get_xdata(), line.get_ydata()))
    cycle = shown_cycle(results)
    assert cycle is not None
    recording = results.recordings[cycle.recording]
    y, level = contacts(results, recording)
    assert level is not None and np.any(force)
    assert not np.any(force[np.interp(t, recording.times, y) < level])
    bare = story_figures(with_base(diagnosed(effects=[], verdict="unknown")))["story"].axes[-1]
    assert "unexplained" in bare.get_ylabel()
