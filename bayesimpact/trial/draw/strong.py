"""Draws of the strong regime: two to four effects at once, misfits of 3 to 300 times the noise.

Shapes and sizes come first, each within what is physical for it; then the base model is fitted to
what the rig records without noise; then the noise is drawn such that the misfit is in its range,
the probe or encoder can have it, and every effect stands out by `LEAST` standard errors beside all
others (`identifiable`). A draw for which there is no such noise is thrown away; how many were, and
why, is part of the truth.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.recording import Recording
from bayesimpact.errors import BayesimpactError, InputError, SimulationError
from bayesimpact.inference.identify import identify
from bayesimpact.trial.draw.designs import DrawnRig, log_uniform
from bayesimpact.trial.draw.drawn import DrawnTrial
from bayesimpact.trial.draw.identifiable import stand_outs
from bayesimpact.trial.draw.sensitivity import clean_readings, truth_of_rig
from bayesimpact.trial.draw.settings import Settings
from bayesimpact.trial.draw.sizing import LIMIT, Unsuitable
from bayesimpact.trial.draw.strong_effects import (
    CATALOGUE_STRONG,
    SORTS,
    STRONG_OUTSIDE,
    TIMED,
    WEIGHTS,
    Chosen,
    chosen,
)
from bayesimpact.trial.draw.strong_rigs import (
    GROUPS,
    draw_rig,
    is_pendulum,
    noise_range,
    with_noise,
)
from bayesimpact.trial.rig.recordings import record

Array = NDArray[np.float64]
Rng = np.random.Generator

ATTEMPTS = 60
LEAST = 3 * LIMIT  # standard errors by which every effect stands out: three detection limits
PROVISIONAL = 1e-4  # noise of the fit that measures the misfit, of the largest release
MOST = 4  # effects in one trial
REST = (0.3, 2.0)  # duration of a rest segment, free periods


def draw_strong(settings: Settings, seed: int) -> DrawnTrial:
    """Draw the trial of one seed; kinds come in turn, and rigs with, without a stop, pendulums.

    Raises
    ------
    Unsuitable : no suitable draw in many attempts
    """
    kind = settings.kinds[seed % len(settings.kinds)]
    groups = [g for g, names in GROUPS.items() if set(names) & set(settings.rig_kinds)]
    group = groups[seed // len(settings.kinds) % len(groups)]
    thrown: Counter[str] = Counter()
    for child in np.random.SeedSequence(seed).spawn(ATTEMPTS):
        try:
            return _attempt(settings, seed, kind, group, thrown, np.random.default_rng(child))
        except Unsuitable as error:
            thrown[str(error)] += 1
        except SimulationError:
            thrown["a motion that the rig cannot follow"] += 1
    raise Unsuitable(f"seed {seed}, {kind}: {ATTEMPTS} draws in vain, {dict(thrown)}")


def _attempt(
    settings: Settings, seed: int, kind: str, group: str, thrown: Mapping[str, int], rng: Rng
) -> DrawnTrial:
    resting = bool(rng.random() < settings.rest)
    rig_kind = str(rng.choice([b for b in GROUPS[group] if b in settings.rig_kinds]))
    design = draw_rig(rig_kind, str(rng.choice(settings.noises)), rng)
    if resting:  # let go from rest
        releases = tuple(replace(r, v0=0.0) for r in design.releases)
        design = replace(design, releases=releases)
    ids = _ids(settings, kind, design, resting, rng)
    found = [chosen(effect, design, rng) for effect in ids]
    effects = {c.effect: c.form.build(c.size) for c in found}
    try:
        left = base_misfit(design, clean_readings(design, effects))
    except BayesimpactError as error:
        raise Unsuitable(f"no base fit: {type(error).__name__}") from error
    least, most = noise_range(design)
    least, most = max(least, left / settings.misfit[1]), min(most, left / settings.misfit[0])
    if least > most:
        raise Unsuitable("no noise of this probe gives a misfit in the range")
    rivals = _rivals(design, ids, rng) if kind == "several_outside" else {}
    own = stand_outs(design, found, rivals)
    weakest = int(np.argmin(own))
    if min(own) < LEAST * least:
        raise Unsuitable(f"{ids[weakest]} is hidden by the others")
    noise = log_uniform(rng, (least, min(most, min(own) / LEAST)))
    final = with_noise(design, noise)
    rests = _rests(final, rng) if resting else {}
    campaign = _recorded(final, effects, rests, rng)
    truth = _truth(settings, seed, kind, final, found)
    truth |= {
        "misfit": float(np.hypot(left, noise) / noise),
        "rejected": dict(thrown),
        "rest_s": rests,
        "noise_rms_m": noise,
    }
    for planted, size in zip(truth["planted"], own, strict=True):
        planted["strength"] = size / noise / LIMIT
    return DrawnTrial(campaign, truth)


def _ids(settings: Settings, kind: str, design: DrawnRig, resting: bool, rng: Rng) -> list[str]:
    """Effects of the trial: at most one of a sort, the force outside the catalogue last."""
    count = int(rng.integers(2, MOST + 1))
    pendulum = is_pendulum(design.rig_kind)
    ids = ["pendulum_sine"] if pendulum else []
    outside = [e for e in _fit(settings.outside, STRONG_OUTSIDE, design, resting)]
    last = [str(rng.choice(outside))] if kind == "several_outside" else []
    sorts = {
        sort: [e for e in _fit(settings.effects, CATALOGUE_STRONG, design, resting) if e in names]
        for sort, names in SORTS.items()
    }
    sorts.pop("odd spring" if pendulum else "", None)
    sorts = {
        sort: [e for e in names if e != "pendulum_sine"]
        for sort, names in sorts.items()
        if any(e != "pendulum_sine" for e in names)
    }
    needed = count - len(ids) - len(last)
    if len(sorts) < needed:
        found = ", ".join(settings.effects)
        raise InputError(
            "trial, effects", found, f"effects of {needed} sorts for {design.rig_kind}"
        )
    weights = np.array([WEIGHTS.get(sort, 1.0) for sort in sorts])
    if needed:
        picked = rng.choice(list(sorts), needed, replace=False, p=weights / weights.sum())
        ids += [str(rng.choice(sorts[str(sort)])) for sort in picked]
    return ids + last


def _fit(
    names: tuple[str, ...], entries: Mapping[str, Any], design: DrawnRig, resting: bool
) -> list[str]:
    """Those that this rig can show."""
    cases, recordings = len(design.rig.k2), len(design.releases)
    return [e for e in names if entries[e].fits(cases, recordings) and not (resting and e in TIMED)]


def _rivals(design: DrawnRig, ids: list[str], rng: Rng) -> dict[str, Any]:
    """Every other effect of the catalogue that this rig can show, each a little of it."""
    slots = {s for e in ids if e in CATALOGUE_STRONG for s in CATALOGUE_STRONG[e].slots}
    result = {}
    known = tuple(e for e in CATALOGUE_STRONG if e not in ("pendulum_sine", *ids))
    for effect in _fit(known, CATALOGUE_STRONG, design, False):
        entry = CATALOGUE_STRONG[effect]
        if not slots.intersection(entry.slots):
            form = entry.form(design, rng)
            result[effect] = form.build(form.start)
    return result


def base_misfit(design: DrawnRig, readings: tuple[Array, ...]) -> float:
    """Rms of what the base model leaves of readings without noise, m or rad.

    The fit is the one that every command begins with; a little white noise is added for it, for it
    estimates the noise from the recordings.
    """
    rng = np.random.default_rng(0)
    small = PROVISIONAL * design.amplitude
    noisy = [r + small * rng.standard_normal(r.size) for r in readings]
    campaign = _campaign(design, noisy)
    fit = identify(campaign, rng=rng, search=False).fit
    rms = fit.rms
    return float(np.sqrt(max(rms**2 - small**2, 0.0)))


def _rests(design: DrawnRig, rng: Rng) -> dict[str, float]:
    """Seconds at rest before the release, for every recording."""
    period = 2 * np.pi / design.omega
    return {
        r.name: round(float(rng.uniform(*REST)) * period * design.rate) / design.rate
        for r in design.releases
    }


def _recorded(
    design: DrawnRig, effects: Mapping[str, Any], rests: Mapping[str, float], rng: Rng
) -> Campaign:
    samples = [
        record(
            design.rig, release, effects, design.chain,
            rate=design.rate, duration=design.duration, rng=rng, rest=rests.get(release.name, 0.0),
        )
        for release in design.releases
    ]  # fmt: skip
    return _campaign(design, samples)


def _campaign(design: DrawnRig, samples: list[Array]) -> Campaign:
    quantity = "angle" if is_pendulum(design.rig_kind) else "displacement"
    recordings = tuple(
        Recording(r.name, r.case, s, 1 / design.rate, quantity=quantity)  # type: ignore[arg-type]
        for r, s in zip(design.releases, samples, strict=True)
    )
    return Campaign("blind trial", design.rig.mass, recordings, bool(design.rig.k2))


def _truth(
    settings: Settings, seed: int, kind: str, design: DrawnRig, found: list[Chosen]
) -> dict[str, Any]:
    return {
        **truth_of_rig(settings, seed, kind, design),
        "planted": [
            {
                "id": c.effect,
                "outside": c.outside,
                "parameters": c.form.build(c.size),
                "regimes": list(c.entry.regimes),
                "place_m": None if c.form.place is None else list(c.form.place),
            }
            for c in found
        ],
    }
