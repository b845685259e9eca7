"""A diagnosis in one paragraph."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from bayesimpact.diagnosis.location import Location
from bayesimpact.diagnosis.selection.families import CONTACT
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.units import two_digits
from bayesimpact.report.diagnosis.words import (
    REGIMES,
    ParameterShift,
    listed,
    span,
    title_of,
    together,
)

AS_MULTIPLE = (
    10.0  # a change of more than ten times the value is told as a multiple, not in per cent
)
TOLD = 2.0  # posterior standard deviations of a force, from which on its size means something
BAND_LIMITED = (
    " Between its samples the input is taken for band-limited: lines between them leave more "
    '(hold = "band_limited" in campaign.toml says so from the beginning).'
)
FAMILIES = {
    "free damping": "Damping of the suspension that is not viscous",
    "free stiffness": "Stiffness of the suspension that is not constant",
    CONTACT: "Physics of the contact beyond k2 and c2",
    "gap": "A gap that changes",
    "modes": "A further mode",
    "sensor": "Something of the measuring chain",
}
MOST_TOLD = 3  # alternatives in one sentence; a table has them all


@dataclass(frozen=True)
class Findings:
    """What a diagnosis found, to be told in one paragraph.

    Attributes
    ----------
    effects, statements : that are named, and a sentence on each
    alternatives : ids of other likely sets of effects, joined by " + "
    shifts : what the fitted model does to shared parameters
    detectable : what would have been seen where nothing is missing
    remains : what is left beside the named effects
    faults : what was wrong with recordings
    angle : readings are angles
    drifts : the likelier unknown force changes with time
    probe : all of the likeliest model of the catalogue acts in the measuring chain
    more : the fitted model has effects that are not named
    unproved : titles of those of the catalogue
    either : groups of effects, of each of which every likely set has one
    families : of effects, of each of which every likely set has some
    finished : the search was not ended by its limit
    band_limited : a good model asked for inputs that are so between their samples
    scatter : where nothing is told beside the fitted model, and readings scatter about it by more
        than their noise
    """

    verdict: str
    effects: tuple[Effect, ...] = ()
    statements: tuple[str, ...] = ()
    location: Location | None = None
    alternatives: tuple[str, ...] = ()
    shifts: Mapping[str, ParameterShift] = field(default_factory=dict)
    detectable: str = ""
    remains: str = ""
    faults: str = ""
    angle: bool = False
    drifts: bool = False
    probe: bool = False
    more: bool = False
    unproved: tuple[str, ...] = ()
    either: tuple[tuple[Effect, ...], ...] = ()
    families: Mapping[str, tuple[Effect, ...]] = field(default_factory=dict)
    finished: bool = True
    band_limited: bool = False
    scatter: str = ""

    @property
    def cost(self) -> str:
        """What the named effects do to other parameters."""
        cause = "Adding it" if len(self.effects) == 1 else "Adding them"
        return _moved(self.shifts, "The fitted model" if self.more else cause)

    @property
    def likely_models(self) -> str:
        """The models of which all that is told to be needed has to be a part."""
        return "every likely model" if self.finished else "every likely model that was tried"


def summary(found: Findings) -> str:
    """One paragraph on what was found."""
    return _found(found) + BAND_LIMITED * found.band_limited


def _found(found: Findings) -> str:
    if found.verdict == "adequate":
        said = "Nothing is missing: the base model describes the recordings down to the noise."
        if found.scatter:
            said = f"Nothing was found that the base model leaves out.{found.scatter}"
        return f"{said} {found.detectable}".strip()
    if found.location is None:
        said = "Nothing is missing beside faults of the recordings"
        return f"{said}:{found.faults}{found.scatter} {found.detectable}".strip()
    if not found.effects:
        return _unknown(found, found.location)
    if found.verdict == "ambiguous" and found.alternatives:
        told = f"{_ambiguous(found, found.location)}{found.cost}"
        return f"{told}{found.scatter}{found.faults}"
    titles, statements = listed(e.title for e in found.effects), " ".join(found.statements)
    if found.verdict == "partly":
        needed = "is needed" if len(found.effects) == 1 else "are needed"
        return (
            f"{_capital(titles)} {needed} by {found.likely_models}, but something else "
            f"is missing too. {statements}{_groups(found)}{found.cost}{_unproved(found)}"
            f"{found.remains}{found.faults}"
        )
    several = len(found.effects) > 1
    acts = [e.regime for e in found.effects] if several else [found.location.regime]
    place = listed(REGIMES[x] for x in together(acts))
    modes = all(e.family == "modes" for e in found.effects)
    if found.location.regime == "measurement" and modes:  # mechanics, but no force on the mass
        place = "which the probe sees beside the oscillator's motion"
    head = "The" if found.verdict == "named" else "Likeliest of what was compared, the"
    told = f"base model leaves out {titles}, {place}. {statements}{found.cost}"
    return f"{head} {told}{found.scatter}{found.faults}"


def _unknown(found: Findings, location: Location) -> str:
    cost = _moved(found.shifts, "Fitting a force in its place")
    force = _size_of_force(location, "N m" if found.angle else "N")
    slowly = " It may be a stiffness or damping that changes with time." if found.drifts else ""
    seen = found.probe and location.regime != "measurement"
    acts = "Seen as a force it would act" if seen else "It acts"
    head = "Something is missing that the catalogue does not hold."
    if found.either or found.families:
        head = "More is missing than the catalogue holds."
    if not found.finished:
        head = "Something is missing that the search has not found."
    if found.faults:  # they are all that has a name
        faults = f"Faults of recordings are set aside or corrected.{found.faults}"
        head = f"{faults} The rest is unknown."
    return (
        f"{head}{_groups(found)} {acts} {REGIMES[location.regime]}, mostly at "
        f"{span(location.displacement, 'rad' if found.angle else 'm')}, {force}."
        f"{slowly}{cost}{_unproved(found)}{found.remains}"
    )


def _unproved(found: Findings) -> str:
    """What else the fitted model holds."""
    if not found.unproved:
        return ""
    too = " too" if found.effects else ""
    why = "nothing proves" if found.finished else "was not compared with all that may do the same"
    return f" The fitted model holds {listed(found.unproved)}{too}, which {why}."


def _groups(found: Findings) -> str:
    """What is needed of groups whose members the recordings do not tell apart."""
    told = []
    for group in found.either:
        *some, last = (e.title for e in group)
        which = f"{'either ' if len(some) == 1 else ''}{', '.join(some)} or {last}"
        told.append(
            f" {_capital(which)} is needed by {found.likely_models}; "
            "the recordings cannot tell which."
        )
    for family, members in found.families.items():
        kind = FAMILIES.get(family, f"Something of the family '{family}'")
        *some, last = (e.title for e in members)
        told.append(
            f" {kind} is needed by {found.likely_models}: {', '.join(some)} or {last}, or several "
            "of these; the recordings cannot tell which."
        )
    return "".join(told)


def _ambiguous(found: Findings, location: Location) -> str:
    """What all likely sets have in common, and what they differ in."""
    own = [e.id for e in found.effects]
    sets = [own, *(a.split(" + ") for a in found.alternatives)]
    common = [i for i in own if all(i in ids for ids in sets)]
    rests = [listed(title_of(i) for i in ids if i not in common) for ids in sets]
    rest, *others = (r or "nothing more" for r in rests)
    apart = _either(others[:MOST_TOLD], len(others[MOST_TOLD:]))
    if common:
        needed = "is needed" if len(common) == 1 else "are needed"
        return (
            f"{_capital(listed(map(title_of, common)))} {needed} by {found.likely_models}. Beside "
            f"{'it' if len(common) == 1 else 'them'} the likeliest is {rest}, but the recordings "
            f"cannot tell that from {apart}."
        )
    mixed = location.regime == "measurement" and any(_is_mechanical(i) for ids in sets for i in ids)
    place = "" if mixed else f" {REGIMES[location.regime]}"
    return (
        f"Something is missing{place}; the likeliest is {rest}, but the recordings cannot tell "
        f"it from {apart}."
    )


def _either(sets: Sequence[str], more: int) -> str:
    """Alternatives, and how many further ones there are."""
    if not more:
        return " or ".join(sets)
    return f"{', '.join(sets)} or {more} other {'set' if more == 1 else 'sets'} of effects"


def _is_mechanical(effect_id: str) -> bool:
    return any(e.id == effect_id and e.regime != "measurement" for e in EFFECTS)


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _moved(shifts: Mapping[str, ParameterShift], cause: str) -> str:
    """What the added physics does to the obstacle's stiffness, or to what it moves most surely."""
    chosen = [n for n in shifts if n.startswith("k2")] or list(shifts)
    if not chosen:
        return ""
    sure = [n for n in chosen if not shifts[n].least] or chosen
    worst = max(sure, key=lambda n: abs(shifts[n].share))
    shift = shifts[worst]
    verb = "raises" if shift.share > 0 else "lowers"
    least = "at least " if shift.least else ""
    size = f"by {least}{two_digits(100 * abs(shift.share))} %"
    if shift.share > AS_MULTIPLE:
        size = f"to {least}{two_digits(1 + shift.share)} times its value"
    return f" {cause} {verb} {worst} {size}."


def _size_of_force(location: Location, unit: str) -> str:
    if location.force_rms is None:
        return "with a force whose size so large a misfit does not tell"
    size = two_digits(location.force_rms, unit)
    if location.force_rms > TOLD * location.force_sd:
        return f"with {size} rms"
    most = two_digits(location.force_rms + TOLD * location.force_sd, unit)
    return f"with a force whose size the recordings do not tell (0 to {most} rms)"
