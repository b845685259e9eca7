"""From a seed to a campaign and the truth about it.

Kinds and effects come in turn as the seed grows, so that consecutive seeds cover all of them; rig,
noise, shapes and sizes are random. A draw that cannot show its effect (too small on this rig at any
physical size, or two effects that are one and the same here) is thrown away and drawn again, from
the same seed.
"""

from __future__ import annotations

import numpy as np

from bayesimpact.errors import InputError, SimulationError
from bayesimpact.trial.draw.designs import RIG_DESIGNS, DrawnRig, draw_rig_design, log_uniform
from bayesimpact.trial.draw.drawn import DrawnTrial
from bayesimpact.trial.draw.faults import PLANTED_FAULTS, plant_fault
from bayesimpact.trial.draw.other_rig import OTHER_RIG, another_rig
from bayesimpact.trial.draw.planted_effects import PLANTED_EFFECTS
from bayesimpact.trial.draw.sensitivity import Sensitivity, clean_readings, truth_of_rig
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.draw.sizing import (
    Sized,
    Unsuitable,
    outside,
    pair,
    planted_effect_of,
    single,
)
from bayesimpact.trial.draw.strong import draw_strong
from bayesimpact.trial.rig.recordings import Effects, make_campaign

Rng = np.random.Generator

ATTEMPTS = 30

__all__ = ["DrawnTrial", "draw"]


def draw(settings: Settings, seed: int) -> DrawnTrial:
    """Draw the trial of one seed.

    Raises
    ------
    InputError : no rig of the settings can show the effect whose turn it is
    Unsuitable : no suitable draw in many attempts
    """
    if settings.regime == "strong":
        return draw_strong(settings, seed)
    kind = settings.kinds[seed % len(settings.kinds)]
    turn = seed // len(settings.kinds)
    reason = ""
    for child in np.random.SeedSequence(seed).spawn(ATTEMPTS):
        rng = np.random.default_rng(child)
        try:
            return _attempt(settings, seed, kind, turn, rng)
        except (SimulationError, Unsuitable) as error:
            reason = str(error)
    raise Unsuitable(
        f"seed {seed}, {kind}: {ATTEMPTS} draws in vain, the last one because {reason}"
    )


def _attempt(settings: Settings, seed: int, kind: str, turn: int, rng: Rng) -> DrawnTrial:
    ids = _effects(settings, kind, turn, rng)
    rig_kind = str(rng.choice(_possible(settings, ids)))
    design = draw_rig_design(rig_kind, str(rng.choice(_noises(settings, ids))), rng)
    strengths = [log_uniform(rng, settings.strength) for _ in ids]
    found: tuple[Sized, ...] = ()
    if kind in ("single", "fault_single"):
        found = (single(Sensitivity(design, rng), ids[0], strengths[0], settings.strength[0], rng),)
    elif kind == "pair":
        found = pair(Sensitivity(design, rng), ids, strengths, settings.strength[0], rng)
    elif kind == "outside":
        found = (outside(Sensitivity(design, rng), ids[0], strengths[0], rng),)
    drawn = _recorded(settings, seed, kind, design, found, rng)
    if kind not in ("fault", "fault_single"):
        return drawn
    faults = _faults(settings, ids)
    rounds = turn // len(settings.effects) if ids else 0  # another fault each time round
    effects = {one.effect: one.numbers for one in found}
    return _with_fault(drawn, design, effects, faults[(turn + rounds) % len(faults)], rng)


def _faults(settings: Settings, ids: tuple[str, ...]) -> list[str]:
    """Faults that some rig shows on which these effects can stand."""
    cases = max(RIG_DESIGNS[name].cases for name in _possible(settings, ids))
    known = [
        k for k, entry in PLANTED_FAULTS.items() if cases >= (2 if k == "case" else entry.stop)
    ]
    return [*known, OTHER_RIG]


def _with_fault(
    drawn: DrawnTrial, design: DrawnRig, effects: Effects, kind: str, rng: Rng
) -> DrawnTrial:
    """The same trial with a fault in one recording."""
    if kind == OTHER_RIG:
        campaign, fault = another_rig(drawn.campaign, design, effects, rng)
        return DrawnTrial(campaign, {**drawn.truth, "fault": fault})
    planted = plant_fault(drawn.campaign, kind, drawn.truth["noise_m"], rng)
    if planted is None:
        raise Unsuitable(f"a rig that cannot show the fault {kind}")
    return DrawnTrial(planted[0], {**drawn.truth, "fault": planted[1]})


def _effects(settings: Settings, kind: str, turn: int, rng: Rng) -> tuple[str, ...]:
    if kind in ("control", "fault"):
        return ()
    if kind == "outside":
        return (settings.outside[turn % len(settings.outside)],)
    first = settings.effects[turn % len(settings.effects)]
    if kind in ("single", "fault_single"):
        return (first,)
    partners = [
        e
        for e in settings.effects
        if e != first and _compatible(first, e) and _showing(settings, (first, e))
    ]
    if not partners:
        raise InputError("trial, effects", first, "at least two effects that can stand together")
    return first, str(rng.choice(partners))


def _compatible(first: str, second: str) -> bool:
    return not set(PLANTED_EFFECTS[first].slots) & set(PLANTED_EFFECTS[second].slots)


def _possible(settings: Settings, ids: tuple[str, ...]) -> list[str]:
    """Rigs of the settings that can show all of these effects; there must be one."""
    fits = _showing(settings, ids)
    if not fits:
        raise InputError(
            "trial, rig", ", ".join(settings.rig_kinds), f"a rig for {' + '.join(ids)}"
        )
    return fits


def _showing(settings: Settings, ids: tuple[str, ...]) -> list[str]:
    sizes = {n: (RIG_DESIGNS[n].cases, RIG_DESIGNS[n].releases) for n in settings.rig_kinds}
    return [
        name
        for name, (cases, releases) in sizes.items()
        if all(
            planted_effect_of(e).fits(cases, releases * max(cases, 1), RIG_DESIGNS[name].angle)
            for e in ids
        )
    ]


def _noises(settings: Settings, ids: tuple[str, ...]) -> list[str]:
    """Noise kinds of the settings; a filter is planted only where none is declared."""
    kinds = [n for n in settings.noises if n != "smoothed" or "smoothing" not in ids]
    if not kinds:
        raise InputError("trial, noise", ", ".join(settings.noises), "a noise without a filter")
    return kinds


def _recorded(
    settings: Settings,
    seed: int,
    kind: str,
    design: DrawnRig,
    found: tuple[Sized, ...],
    rng: Rng,
) -> DrawnTrial:
    effects = {one.effect: one.numbers for one in found}
    campaign = make_campaign(
        "blind trial",
        design.rig,
        design.releases,
        effects,
        design.chain,
        rate=design.rate,
        duration=design.duration,
        rng=rng,
        measurement=design.measurement,
        quantity=design.quantity,
    )
    clean = clean_readings(design, effects)
    noise = [r.samples - c for r, c in zip(campaign.recordings, clean, strict=True)]
    truth = {
        **truth_of_rig(settings, seed, kind, design),
        "planted": [
            {
                "id": one.effect,
                "parameters": one.numbers,
                "strength": one.strength,
                "score": one.score,
                "distinct": one.distinct,
                "nearest": one.nearest,
                "regimes": list(one.entry.regimes),
                "place_m": None if one.form.place is None else list(one.form.place),
            }
            for one in found
        ],
        "noise_rms_m": float(np.sqrt(np.mean(np.concatenate(noise) ** 2))),
    }
    return DrawnTrial(campaign, truth)
