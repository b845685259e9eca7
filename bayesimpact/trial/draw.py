"""From a seed to a campaign and the truth about it.

Kinds and effects come in turn as the seed grows, so that consecutive seeds cover all of them; rig,
noise, shapes and sizes are random. A draw that cannot show its effect (too small on this rig at any
physical size, or two effects that are one and the same here) is thrown away and drawn again, from
the same seed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.errors import BayesimpactError, InputError
from bayesimpact.trial.benches import BENCHES, Design, draw_bench, log_uniform
from bayesimpact.trial.plants import CATALOGUE_PLANTS, OUTSIDE_PLANTS, Form, Plant
from bayesimpact.trial.rig import Effects, Parameters, make_campaign
from bayesimpact.trial.ruler import Ruler, clean_readings, true_parameters
from bayesimpact.trial.settings import Settings

Array = NDArray[np.float64]
Rng = np.random.Generator

LIMIT = 5.0  # standard errors that make the detection limit
ATTEMPTS = 30
CLOSE = 0.05  # relative error of a size that is good enough
LIKE = 0.99  # cosine beyond which two effects count as one


class Unsuitable(BayesimpactError):
    """This draw cannot show what it should."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A campaign and the truth about it, as a JSON object."""

    campaign: Campaign
    truth: Mapping[str, Any]


@dataclass(frozen=True)
class Sized:
    """A planted effect with its size found.

    Attributes
    ----------
    effect, numbers : what the rig gets
    strength : size in detection limits (of this effect beside its partner, for a pair)
    score : expected score of this effect alone
    distinct, nearest : distance, in standard errors, from the effect of the catalogue that imitates
        it best, and which that is; None in a pair
    form, plant : where it comes from
    """

    effect: str
    numbers: Parameters
    strength: float
    score: float
    form: Form
    plant: Plant
    distinct: float | None = None
    nearest: str | None = None


def draw(settings: Settings, seed: int) -> Drawn:
    """Draw the trial of one seed.

    Raises
    ------
    InputError : no rig of the settings can show the effect whose turn it is
    Unsuitable : no suitable draw in many attempts
    """
    kind = settings.kinds[seed % len(settings.kinds)]
    turn = seed // len(settings.kinds)
    reason = ""
    for child in np.random.SeedSequence(seed).spawn(ATTEMPTS):
        rng = np.random.default_rng(child)
        try:
            return _attempt(settings, seed, kind, turn, rng)
        except Unsuitable as error:
            reason = str(error)
    raise Unsuitable(
        f"seed {seed}, {kind}: {ATTEMPTS} draws in vain, the last one because {reason}"
    )


def _attempt(settings: Settings, seed: int, kind: str, turn: int, rng: Rng) -> Drawn:
    ids = _effects(settings, kind, turn, rng)
    bench = str(rng.choice(_possible(settings, ids)))
    design = draw_bench(bench, str(rng.choice(settings.noises)), rng)
    strengths = [log_uniform(rng, settings.strength) for _ in ids]
    found: tuple[Sized, ...] = ()
    if kind == "single":
        found = (single(Ruler(design, rng), ids[0], strengths[0], settings.strength[0], rng),)
    elif kind == "pair":
        found = pair(Ruler(design, rng), ids, strengths, settings.strength[0], rng)
    elif kind == "outside":
        found = (outside(Ruler(design, rng), ids[0], strengths[0], rng),)
    return _recorded(settings, seed, kind, design, found, rng)


def _effects(settings: Settings, kind: str, turn: int, rng: Rng) -> tuple[str, ...]:
    if kind == "control":
        return ()
    if kind == "outside":
        return (settings.outside[turn % len(settings.outside)],)
    first = settings.effects[turn % len(settings.effects)]
    if kind == "single":
        return (first,)
    partners = [e for e in settings.effects if e != first and _compatible(first, e)]
    if not partners:
        raise InputError("trial, effects", first, "at least two effects that can stand together")
    return first, str(rng.choice(partners))


def _compatible(first: str, second: str) -> bool:
    slot = CATALOGUE_PLANTS[first].slot
    return not slot or slot != CATALOGUE_PLANTS[second].slot


def _plant(effect: str) -> Plant:
    return CATALOGUE_PLANTS.get(effect) or OUTSIDE_PLANTS[effect]


def _possible(settings: Settings, ids: tuple[str, ...]) -> list[str]:
    """Benches of the settings that can show all of these effects."""
    sizes = {n: (BENCHES[n].cases, BENCHES[n].releases) for n in settings.benches}
    fits = [
        name
        for name, (cases, releases) in sizes.items()
        if all(_plant(e).fits(cases, releases * max(cases, 1)) for e in ids)
    ]
    if not fits:
        raise InputError("trial, rig", ", ".join(settings.benches), f"a rig for {' + '.join(ids)}")
    return fits


def single(ruler: Ruler, effect: str, strength: float, least: float, rng: Rng) -> Sized:
    """One effect of `strength` detection limits; effects that are on or off take what they have."""
    plant = _plant(effect)
    form = plant.form(ruler.design, rng)

    size = _solve(_score_of(ruler, effect, form), form, LIMIT * strength)
    response = _response(ruler, effect, form, size)
    value = float(np.linalg.norm(response))
    if value < LIMIT * least * (1 - CLOSE):
        raise Unsuitable(f"{effect} stands out by {value:.1f} standard errors only")
    apart = ruler.distinct(response, besides=effect)
    return Sized(effect, form.build(size), value / LIMIT, value, form, plant, *apart)


def outside(ruler: Ruler, effect: str, strength: float, rng: Rng) -> Sized:
    """A force outside the catalogue, `strength` limits away from the nearest single entry of it."""
    plant = _plant(effect)
    form = plant.form(ruler.design, rng)

    def score(size: float) -> float:
        return ruler.distinct(_response(ruler, effect, form, size))[0]

    size = _solve(score, form, LIMIT * strength)
    response = _response(ruler, effect, form, size)
    whole, (left, nearest) = float(np.linalg.norm(response)), ruler.distinct(response)
    return Sized(effect, form.build(size), left / LIMIT, whole, form, plant, left, nearest)


def pair(
    ruler: Ruler, ids: tuple[str, ...], strengths: list[float], least: float, rng: Rng
) -> tuple[Sized, ...]:
    """Two effects, each `strength` limits above what the other one could imitate of it."""
    plants = [_plant(e) for e in ids]
    forms = [plant.form(ruler.design, rng) for plant in plants]
    units = []
    for effect, form in zip(ids, forms, strict=True):
        size = _solve(_score_of(ruler, effect, form), form, LIMIT)
        units.append((size, _response(ruler, effect, form, size)))
    norms = [float(np.linalg.norm(d)) for _, d in units]
    cosine = float(units[0][1] @ units[1][1]) / max(norms[0] * norms[1], 1e-300)
    if abs(cosine) > LIKE:
        raise Unsuitable(f"{' and '.join(ids)} look alike, cosine {cosine:.3f}")
    own = np.sqrt(1 - cosine**2)  # share of either that the other cannot imitate
    found = []
    for i, (effect, form, plant) in enumerate(zip(ids, forms, plants, strict=True)):
        alone = norms[i] if form.start == 0 else LIMIT * strengths[i] / own
        size = units[i][0] * alone / norms[i]
        if size > form.largest or alone * own < LIMIT * least * (1 - CLOSE):
            raise Unsuitable(f"{effect} cannot be of a visible size beside its partner")
        found.append(Sized(effect, form.build(size), alone * own / LIMIT, alone, form, plant))
    return tuple(found)


def _score_of(ruler: Ruler, effect: str, form: Form) -> Callable[[float], float]:
    """Size -> expected score of the effect alone."""
    return lambda size: float(np.linalg.norm(_response(ruler, effect, form, size)))


def _response(ruler: Ruler, effect: str, form: Form, size: float) -> Array:
    return ruler.response({effect: form.build(size), **_others(form)}, form.reference)


def _others(form: Form) -> Effects:
    """What stays beside the effect; a reference that the effect itself contains does not."""
    return {k: v for k, v in form.reference.items() if k != "contact_no_tension"}


def _solve(score: Callable[[float], float], form: Form, target: float) -> float:
    """Size whose score is `target`: a power of the size, near enough, found as we go."""
    size = form.start
    if size == 0:
        return size
    power, last = 1.0, (0.0, 0.0)
    for _ in range(10):
        value = score(size)
        if not np.isfinite(value) or value < 1e-6 * target:
            raise Unsuitable("the effect cannot be seen at all")
        if abs(value / target - 1) < CLOSE:
            return size
        if last[0] > 0 and size != last[0]:
            power = float(np.clip(np.log(value / last[1]) / np.log(size / last[0]), 0.5, 3.0))
        last = (size, value)
        size *= min(1e3, (target / value) ** (1 / power))
        if size > form.largest:
            raise Unsuitable("the effect would have to be unphysically large")
    raise Unsuitable("no size has the wanted score")


def _recorded(
    settings: Settings,
    seed: int,
    kind: str,
    design: Design,
    found: tuple[Sized, ...],
    rng: Rng,
) -> Drawn:
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
    )
    clean = clean_readings(design, effects)
    noise = [r.samples - c for r, c in zip(campaign.recordings, clean, strict=True)]
    truth = {
        "schema": "bayesimpact/trial-truth/1",
        "seed": seed,
        "settings": settings.document(),
        "kind": kind,
        "bench": design.bench,
        "noise_kind": design.noise_kind,
        "planted": [
            {
                "id": one.effect,
                "parameters": one.numbers,
                "strength": one.strength,
                "score": one.score,
                "distinct": one.distinct,
                "nearest": one.nearest,
                "regimes": list(one.plant.regimes),
                "place_m": None if one.form.place is None else list(one.form.place),
            }
            for one in found
        ],
        "mass_kg": design.rig.mass,
        "parameters": true_parameters(design),
        "rate_hz": design.rate,
        "duration_s": design.duration,
        "noise_m": design.chain.noise,
        "noise_correlation": design.chain.correlation,
        "rounding_m": design.chain.rounding,
        "noise_rms_m": float(np.sqrt(np.mean(np.concatenate(noise) ** 2))),
    }
    return Drawn(campaign, truth)
