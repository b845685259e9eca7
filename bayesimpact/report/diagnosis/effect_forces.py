"""The forces of the effects that were named, along the recorded motion.

They are on the left-hand side of the equation of motion, as in the catalogue, at the mode and
along the motion of the extended model: where they are large is where the effects act. The force
that the base model leaves unexplained (`force_in_time`) need not be large there: what changes of
the base parameters imitate is taken out of it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayesimpact.diagnosis.refits.size import force_along
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.effects.effect import Effect, Numbers
from bayesimpact.model.parameters import SLOTS, WITHOUT, instance_name
from bayesimpact.report.cycles import Cycle, contact_onsets, contacts, cycles, offset_of
from bayesimpact.report.diagnosis.words import title_of
from bayesimpact.report.names import is_fault
from bayesimpact.report.results import Array, RecordingResult, Results

_GAP, _STIFFNESS = SLOTS.index("g"), SLOTS.index("k2")


def effect_forces(results: Results, r: int, part: slice) -> dict[str, Array]:
    """Title of an effect -> its force (k,) at the samples `part` of recording r, N (N m of angles).

    Of the catalogue's effects that are forces of displacement, velocity and time, a gap that wears
    included; effects with a memory and those of the measuring chain are left out.
    """
    named = {effect["id"] for effect in (results.diagnosis or {}).get("effects") or ()}
    known = {row.name: row.mode for row in results.rows}
    recording = results.recordings[r]
    forces = {}
    for effect in EFFECTS:
        if effect.id in named:
            found = _force(results, effect, recording, known, part)
            if found is not None:
                forces[effect.title] = found
    return forces


def shown_cycle(results: Results) -> Cycle | None:
    """The cycle in which the extended model gains most, of those in which a named effect has a
    force, where one has; None where none gains.
    """
    gaining = sorted((c for c in cycles(results) if c.gain > 0), key=lambda c: -c.gain)
    for cycle in gaining:
        forces = effect_forces(results, cycle.recording, slice(cycle.first, cycle.last))
        if any(np.any(force) for force in forces.values()):
            return cycle
        if not forces:
            break
    return gaining[0] if gaining else None


def without_force(results: Results) -> list[str]:
    """Titles of named effects of which `effect_forces` knows no force."""
    told = (results.diagnosis or {}).get("effects") or ()
    known = effect_forces(results, 0, slice(0, 1))
    titles = [title_of(e["id"]) for e in told if not is_fault(e)]
    return [title for title in titles if title not in known]


def _force(
    results: Results,
    effect: Effect,
    recording: RecordingResult,
    known: Mapping[str, float],
    part: slice,
) -> Array | None:
    numbers = _numbers(effect, recording, known)
    if numbers is None:
        return None
    y = recording.motion(recording.predicted, offset_of(results, recording))
    v = np.gradient(y, recording.interval)[part]
    slots = _slots(recording, known)
    law = effect.law
    if law is not None and law.rate is None and law.travel is None:
        return force_along(law, y[part], v, recording.times[part], numbers, slots)
    if "friction" in effect.binds:
        return np.asarray(numbers[0] * np.sign(v))
    motion, level = contacts(results, recording)
    if "gap_step" in effect.binds and level is not None:
        before = np.searchsorted(contact_onsets(motion, level), np.arange(y.size), "right") - 1
        touching = motion >= level
        worn = np.where(touching, numbers[0] * np.maximum(before, 0), 0.0)
        return np.asarray(-slots[_STIFFNESS] * worn[part])
    return None


def _numbers(
    effect: Effect, recording: RecordingResult, known: Mapping[str, float]
) -> Numbers | None:
    """The effect's parameters in its own order; None where the results lack one."""
    keys = {"campaign": None, "case": recording.case, "recording": recording.name}
    found = [
        p.fixed if p.fixed is not None else known.get(instance_name(effect, p, keys[p.scope]))
        for p in effect.parameters
    ]
    return None if any(x is None for x in found) else [float(x) for x in found if x is not None]


def _slots(recording: RecordingResult, known: Mapping[str, float]) -> Array:
    """The oscillator's parameters for a recording, as laws take them."""
    keys = ("", f"[{recording.case}]", f"[{recording.name}]")
    slots = np.array([WITHOUT.get(name, 0.0) for name in SLOTS])
    for i, name in enumerate(SLOTS):
        for key in keys:
            slots[i] = known.get(name + key, slots[i])
    own = [value for name, value in known.items() if name.endswith(f".g[{recording.name}]")]
    if own:  # a gap of every recording's own
        slots[_GAP] = own[0]
    elif not any(f"g{key}" in known for key in keys):
        slots[_GAP] = np.inf
    return slots
