"""The diagnosis in words that a lab person understands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesimpact.diagnosis.faults.compare import base_failed
from bayesimpact.diagnosis.remainder import Remainder
from bayesimpact.diagnosis.selection.outcome import leaves_something
from bayesimpact.formula.law import is_formula_id
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.effects import EFFECTS
from bayesimpact.model.effects.effect import Effect
from bayesimpact.model.units import span_of, two_digits

SHARED = ("k2", "k1", "c1", "c2", "g")
OPEN = 0.5  # half-width of a 90 % interval over the median: more than 0.5 leaves a size open
LEAST_PROBABILITY = 0.1  # probability among all sets of effects that were fitted

REGIMES = {
    "free": "in the suspension, wherever the mass moves",
    "contact": "in contact with the obstacle",
    "entry": "where contact begins",
    "exit": "where contact ends",
    "everywhere": "throughout the motion",
    "measurement": "in the measuring chain, not in the mechanics",
}


_IN_CONTACT = frozenset(("contact", "entry", "exit"))


def together(regimes: Iterable[str]) -> list[str]:
    """Where effects act that are told in one sentence: each regime once, and contact for several of
    its stages.
    """
    found = list(dict.fromkeys(regimes))
    return ["contact"] if len(found) > 1 and _IN_CONTACT.issuperset(found) else found


def statement(effect: Effect, size: str, share: float) -> str:
    """One sentence on an effect: what it is and how large."""
    return effect.statement.format(size=size, share=f"{two_digits(100 * share)} %")


def left_open(effect: Effect, values: Mapping[str, Mapping[str, Any]]) -> str:
    """A sentence where the interval of an effect's size is wide beside it; else empty.

    `values` are parameters with medians and intervals. The first of an effect is its size.
    """
    own = [v for name, v in values.items() if name.startswith(f"{effect.id}.")]
    if not own:
        return ""
    (low, high), median, unit = own[0]["ci90"], own[0]["median"], own[0]["unit"]
    if 0.5 * (high - low) <= OPEN * abs(median):
        return ""
    name = effect.parameters[0].name.replace("_", " ")
    return f" What remains leaves that open: its {name} may be {span((low, high), unit)}."


@dataclass(frozen=True)
class ParameterShift:
    """How adding physics changed a parameter: `share` of its value before, towards `after`.

    Where the interval after is wide, `share` is that of its end next to the value before, and
    `least` is true: the change is at least that.
    """

    share: float
    least: bool = False


def parameter_shifts(
    before: Mapping[str, Mapping[str, Any]], after: Mapping[str, Mapping[str, Any]]
) -> dict[str, ParameterShift]:
    """Changes of shared parameters that their intervals prove; the others are left out."""
    shifts = {}
    for name, old in before.items():
        new = after.get(name)
        if new is None or name.split("[")[0] not in SHARED:
            continue
        shift = parameter_shift(old, new)
        if shift is not None:
            shifts[name] = shift
    return shifts


def parameter_shift(old: Mapping[str, Any], new: Mapping[str, Any]) -> ParameterShift | None:
    """Change of one parameter; None where its intervals before and after overlap."""
    (low, high), start = new["ci90"], old["median"]
    overlap = old["ci90"][0] <= high and old["ci90"][1] >= low
    if not start or overlap or not excludes(new, start):
        return None
    near, far = sorted((low, high), key=lambda end: abs(end - start))
    shares = [(value - start) / abs(start) for value in (new["median"], near, far)]
    wide = abs(shares[2]) > 2 * abs(shares[1])  # two digits of the median would mean nothing
    return ParameterShift(shares[1], least=True) if wide else ParameterShift(shares[0])


def excludes(content: Mapping[str, Any], value: float) -> bool:
    """True when a 90 % interval leaves a value out, on its wider side's width to either side.

    An interval cut at a bound (a damping is not negative) leaves out what lies at the bound, though
    nothing is likelier there.
    """
    (low, high), median = content["ci90"], content["median"]
    return bool(abs(value - median) > max(high - median, median - low))


def title_of(effect_id: str) -> str:
    """What an effect of the catalogue is called; an id in words for others, but a formula's, which
    is no name.
    """
    if is_formula_id(effect_id):
        return "a formula"
    known = {e.id: e.title for e in EFFECTS}
    return known.get(effect_id, effect_id.replace("_", " "))


def titles_of(ids: str) -> str:
    """Titles for ids joined by " + "; words and formulas stay what they are."""
    parts = ids.split(" + ")
    return ids if any(" " in part for part in parts) else listed(map(title_of, parts))


def nearest(sets: Sequence[tuple[str, float]]) -> str:
    """The likeliest sets of effects where none is enough, ids with probabilities, in a sentence."""
    told = [f"{titles_of(ids)} ({100 * p:.0f} %)" for ids, p in sets if p >= LEAST_PROBABILITY]
    if not told:
        return ""
    comes = "comes" if len(told) == 1 else "come"
    return f" Of the catalogue {' or '.join(told)} {comes} nearest, but not near enough."


def remaining(left: Remainder | None, unit: str = "m") -> str:
    """What is left, in a sentence; empty where nothing is. `unit` is that of the readings."""
    if left is None:
        return ""
    size = "less than the noise"
    if left.rms > 0.0:
        size = (
            f"{two_digits(left.rms, unit)} rms ({two_digits(100 * left.share)} % of the signal; "
            f"the residual is {two_digits(left.over_noise)} times the noise"
            f"{', of which only a bound is known' if left.over_noise < 1.0 else ''})"
        )
    guess = f"; likeliest: {titles_of(left.guess)}" if left.guess else ""
    return (
        f" Unexplained remains {size}, {REGIMES[left.regime]}{guess}. The intervals allow for it."
    )


def noise_words(noise: Noise) -> str:
    """A sentence where what a model leaves was taken for slow noise, for one that grows with the
    motion, or an input's; else empty.
    """
    if noise.forces is not None:
        size = f"{100 * noise.forces.share:.2g} % of it"
        return f" The noise of the measured input ({size}) moves the model: intervals allow for it."
    if noise.grows and not noise.is_independent:
        share, jitter = (term * noise.level for term in noise.growth)
        rate = f"changes faster, as by time stamps that jitter by {1e3 * jitter:.2g} ms"
        size = f"is larger, by {100 * share:.2g} % of it"
        where = " and ".join(words for words, term in ((rate, jitter), (size, share)) if term)
        return (
            f" What the model leaves is taken for noise that is larger where the reading {where}."
        )
    if noise.is_independent or not noise.others:
        return ""
    return (
        " What the model leaves is taken for noise that is slow as well as white "
        f"({noise.kind}): no force explains it as well."
    )


def scatter_words(fit: Fit) -> str:
    """A sentence where readings scatter about a model beside which nothing is told by more than
    their noise, and what that is uncertain by; else empty.
    """
    if not leaves_something(fit):
        return ""
    over = two_digits(float(np.sqrt(fit.reduced_chi2)))
    return (
        f" The readings scatter about it {over} times as much as their noise does within short "
        "windows; no effect and no force was found that explains the rest."
    )


def failure(fit: Fit, *, explained: bool = False) -> str:
    """A sentence where the base model leaves more than half of the signal; else empty. Likely
    reasons are told where the answer has not `explained` it.
    """
    if not base_failed(fit):
        return ""
    if explained:
        return "The base model alone leaves more than half of the signal. "
    reasons = ["a wrong sign, unit or clock of the recordings"]
    inputs = [r.input for r in fit.density.oscillator.campaign.recordings if r.input is not None]
    if inputs:
        wrong = "sign, delay or kind" if all(i.free for i in inputs) else "sign, scale or kind"
        hint = "" if all(i.free for i in inputs) else ' (gain = "free" lets the scale be found)'
        reasons.append(f"a wrong {wrong} of the input{hint}")
    reasons.append("a stop that is not there or not declared")
    return (
        "The base fit failed: it leaves more than half of the signal. Likely reasons are "
        f"{', '.join(reasons)}, or strong physics outside the base model. "
    )


def listed(titles: Iterable[str]) -> str:
    """Words with commas and an "and"."""
    *first, last = [*titles] or [""]
    return f"{', '.join(first)} and {last}" if first else last


def span(ends: Sequence[float], unit: str) -> str:
    """A range in words."""
    return span_of(ends, unit).replace("\N{NO-BREAK SPACE}", " ")
