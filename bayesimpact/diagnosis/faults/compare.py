"""Which recording disagrees with the others, and what is wrong with it.

1. Every recording is identified alone, and where that leaves much, once more with the other sign.
2. Where it still leaves more than chance, samples may be missing (see `slip`): believed if the
   recording fits with its readings put where they belong.
3. The recordings' own parameters are compared (see `together`); the likeliest fault is corrected if
   its log odds against no fault, all faults being equally likely beforehand, pass the threshold.
   Few recordings whose physics is not known differ anyhow, and no odds pass. There one is enough
   that is likelier than none, of a recording whose amplitude lies between the others', if that
   corrected leaves `EXCESS` times less, and leaving out any other recording does not.
4. The campaign is fitted before and after; a correction that does not improve it is not believed.
5. Again from 3, until nothing is found, or a third of the recordings has been corrected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.faults.fault import Fault
from bayesimpact.data.faults.find import applied
from bayesimpact.diagnosis.faults.alone import (
    Alone,
    SharedModel,
    fit_alone,
    inverted,
    own_fit,
)
from bayesimpact.diagnosis.faults.correct import as_fault, corrected
from bayesimpact.diagnosis.faults.slip import find_shift, slip_fault
from bayesimpact.diagnosis.faults.together import (
    CERTAIN,
    Hypothesis,
    Weighed,
    hypotheses,
    weigh_all,
)
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.noise.whitening import Noise

Array = NDArray[np.float64]

MISFIT = 4.0  # reduced chi-squared of a recording alone from which on the other sign is tried
# Of that misfit, at most, for the other sign to be believed; as much more than the others have, or
# than alone, is a reason to try it.
REVERSED = 0.25
WORST = 1.5  # times a recording's misfit, that the worst one has at most: set by hand
FEW = 3  # of such recordings: what is missing from all of them is no sign
SIGNIFICANT = 4.0  # standard errors of a reduced chi-squared that call for a comparison
SHARE = 1 / 3  # of the recordings, at most, that may be faulty: the others are the majority
LEAST = 3  # recordings: of two that differ neither is the faulty one
DIFFERENT = {
    "recording_gain": "another gain or gap",
    "recording_clock": "another clock",
    "recording_case": "another obstacle",
}
"""What is different in a recording, in words; of another rig a parameter."""
FAILED = 0.5  # of the signal's root mean square left: no fit at all


@dataclass(frozen=True, eq=False)
class Compared:
    """A fault found by comparison.

    Attributes
    ----------
    fault : what it is
    campaign : with this fault, and those found before it, corrected
    before, after : reduced chi-squared of the shared model without and with this correction
    alternatives : other explanations with their probabilities, the likeliest first
    """

    fault: Fault
    campaign: Campaign
    before: float
    after: float
    alternatives: tuple[tuple[str, float], ...] = ()


def base_failed(fit: Fit) -> bool:
    """True when a fit leaves more than half of the signal: no effect is worth a search then."""
    return bool(not np.isfinite(fit.rms) or fit.rms > FAILED * fit.signal)


def misfits(fit: Fit) -> bool:
    """Whether the base fit misses any recording by more than chance, so that comparing is due."""
    likelihood = fit.density.likelihood
    chi2 = fit.sums / likelihood.noise.level**2 / likelihood.sizes
    return bool(np.any(chi2 > largest_by_chance(chi2, likelihood.sizes, likelihood.noise)))


def largest_by_chance(chi2: Array, sizes: Array, noise: Noise) -> Array:
    """Misfit (R,) up to which a recording agrees with the noise level and with the others.

    `chi2` (R,) are the reduced misfits, `sizes` (R,) the independent numbers of the recordings.
    """
    relative = 2.0 * (noise.level_error if np.isfinite(noise.level_error) else 0.0)
    # against the noise level, and against each other, where the level's error cancels
    usual = min(float(np.median(chi2)), 1.0 + SIGNIFICANT * relative)
    return np.asarray(max(usual, 1e-300) * (1.0 + SIGNIFICANT * np.sqrt(2 / sizes)))


def compare_recordings(fit: Fit, model: SharedModel) -> tuple[Compared, ...]:
    """Faults by comparison of a campaign's recordings, the most certain first; () when all agree.

    Nothing is compared where `fit`, the `model`'s to the campaign, is adequate in every recording.
    """
    if not misfits(fit):
        return ()
    campaign = fit.density.oscillator.campaign
    alone = {r.name: fit_alone(campaign, r, model) for r in campaign.recordings}
    signs, campaign, chi2 = _signs(campaign, alone, model, fit)
    slips, campaign, chi2 = _slips(campaign, alone, model, fit, chi2)
    differing: list[Compared] = []
    allowed = int(SHARE * len(campaign.recordings))
    while len(differing) < allowed:
        step = _next(campaign, alone, model, chi2, allowed - len(differing))
        if step is None:
            break
        differing.append(step)
        name, campaign, chi2 = step.fault.recording, step.campaign, step.after
        changed = [r for r in campaign.recordings if r.name == name]
        alone[name] = fit_alone(campaign, changed[0], model) if changed else None
    return (*signs, *slips, *differing)


def _signs(
    campaign: Campaign, alone: dict[str, Alone | None], model: SharedModel, fit: Fit
) -> tuple[list[Compared], Campaign, float]:
    """Recordings that only fit with the other sign, corrected; `alone` is brought up to date."""
    found, chi2 = list[Compared](), fit.reduced_chi2
    if not campaign.stop:
        return found, campaign, chi2
    first, others = _doubted(campaign, alone, fit)
    turned = _turned(campaign, alone, model, first)
    if turned:
        turned = sorted(turned + _turned(campaign, alone, model, others))
    for i, nats in turned:
        recording = campaign.recordings[i]
        guess = Weighed(Hypothesis("recording_reversed", i), nats)
        campaign = corrected(campaign, i, guess)
        fault = as_fault(recording, guess, nats, CERTAIN)
        if len(turned) == len(campaign.recordings):
            words = "the stop lies on the negative side in every recording"
            fault = replace(fault, statement=words)
        found.append(Compared(fault, campaign, chi2, chi2))
    if found:
        after = _chi2(campaign, model)
        found = [replace(f, after=after) for f in found]
        chi2 = after
    return found, campaign, chi2


def _doubted(
    campaign: Campaign, alone: dict[str, Alone | None], fit: Fit
) -> tuple[list[int], list[int]]:
    """Recordings that the other sign is tried of first, and those only where one of these has it.

    What fits alone about as well as the others, and together with them about as well as alone, has
    their sign; of such recordings a few that are nearly as bad as the worst one stand for all.
    """
    rows = [alone[r.name] for r in campaign.recordings]
    own = np.array([np.inf if one is None else one.reduced_chi2 for one in rows])
    sums = fit.sums / fit.density.likelihood.sizes
    together = sums / fit.density.likelihood.noise.level**2
    doubted = [int(i) for i in np.argsort(-own, kind="stable") if own[i] >= MISFIT]
    usual = float(np.median(own))
    apart = [
        i for i in doubted if not (own[i] * REVERSED <= usual and together[i] * REVERSED <= own[i])
    ]
    first = apart or [i for i in doubted if own[i] * WORST >= own[doubted[0]]][:FEW]
    return first, [i for i in doubted if i not in first]


def _turned(
    campaign: Campaign, alone: dict[str, Alone | None], model: SharedModel, numbers: Sequence[int]
) -> list[tuple[int, float]]:
    """Which of some recordings fit with the other sign only, and by how many nats."""
    found = []
    for i in numbers:
        recording = campaign.recordings[i]
        own = alone[recording.name]
        misfit = np.inf if own is None else own.reduced_chi2
        other = fit_alone(campaign, inverted(recording), model)
        if other is not None and other.reduced_chi2 < REVERSED * misfit:
            alone[recording.name] = other
            size = recording.samples.size
            nats = size * np.log(misfit / other.reduced_chi2) / 2 if own else float(size)
            found.append((i, float(nats)))
    return found


def _slips(
    campaign: Campaign,
    alone: dict[str, Alone | None],
    model: SharedModel,
    fit: Fit,
    chi2: float,
) -> tuple[list[Compared], Campaign, float]:
    """Recordings that fit once samples are where they belong; `alone` is brought up to date."""
    found: list[Compared] = []
    recordings = campaign.recordings
    misfit = np.array(
        [np.inf if (a := alone[r.name]) is None else a.reduced_chi2 for r in recordings]
    )
    least = largest_by_chance(misfit, fit.density.likelihood.sizes, model.noise)
    for i in np.flatnonzero(misfit > least):
        known = alone[recordings[i].name]
        own = known.fit if known is not None else own_fit(campaign, recordings[i], model)
        shifted = find_shift(campaign, recordings[i], model, own)
        if shifted is None or shifted[1].reduced_chi2 > least[i]:
            continue
        fault = slip_fault(recordings[i], shifted[0])
        try:
            one = applied(recordings[i], [fault])[0]
        except ValueError:  # neither part is long enough to go on with
            continue
        campaign = replace(
            campaign,
            recordings=tuple(one if r.name == one.name else r for r in campaign.recordings),
        )
        alone[one.name] = fit_alone(campaign, one, model)
        after = _chi2(campaign, model)
        found.append(Compared(fault, campaign, chi2, after))
        chi2 = after
    return found, campaign, chi2


def _next(
    campaign: Campaign, alone: dict[str, Alone | None], model: SharedModel, chi2: float, most: int
) -> Compared | None:
    """The likeliest fault of what is left, corrected; None when there is none to believe.

    Up to `most` recordings may be faulty.
    """
    known = [(i, a) for i, r in enumerate(campaign.recordings) if (a := alone[r.name]) is not None]
    if len(known) < LEAST:
        return None
    own = [a for _, a in known]
    cases = [campaign.recordings[i].case for i, _ in known]
    none, ranked, needed = weigh_all(own, cases, campaign.stop, most)
    prior = -np.log(len(hypotheses(cases, campaign.stop)) - 1)
    best = ranked[0]
    odds = best.log_evidence - none.log_evidence + prior
    if odds < min(needed, 0.0):
        return None
    number = known[best.hypothesis.recording][0]
    after = corrected(campaign, number, best)
    value = _chi2(after, model)
    nats = log_likelihood_gain(chi2, value, campaign)
    if nats <= needed:
        return None
    if odds >= needed:
        fault = as_fault(campaign.recordings[number], best, odds, needed)
        return Compared(fault, after, chi2, value, _alternatives(ranked, own))
    sizes = [a.amplitude for a in own]
    is_between = min(sizes) < own[best.hypothesis.recording].amplitude < max(sizes)
    if not (is_between and _alone_differs(campaign, model, number, chi2, value)):
        return None
    fault = as_fault(campaign.recordings[number], best, nats, needed)
    none = replace(none, log_evidence=none.log_evidence - prior)
    return Compared(fault, after, chi2, value, _alternatives([*ranked, none], own))


def _alone_differs(
    campaign: Campaign, model: SharedModel, number: int, chi2: float, corrected_chi2: float
) -> bool:
    """Whether `EXCESS` times less is left with one recording corrected, and with no other one left
    out: most of the misfit is of that one, whatever else all of them miss.
    """
    if EXCESS * corrected_chi2 > chi2:
        return False
    for other in range(len(campaign.recordings)):
        if other != number:
            rest = campaign.recordings[:other] + campaign.recordings[other + 1 :]
            if _chi2(replace(campaign, recordings=rest), model) < EXCESS * corrected_chi2:
                return False
    return True


def _alternatives(ranked: Sequence[Weighed], own: Sequence[Alone]) -> tuple[tuple[str, float], ...]:
    """Explanations beside the first with their probabilities among all of them."""
    evidence = np.array([w.log_evidence for w in ranked])
    share = np.exp(evidence - evidence[0])
    share /= share.sum()
    names = []
    others = list(zip(ranked, share, strict=True))[1:]
    for weighed, p in sorted(others, key=lambda one: -one[1])[:3]:
        if p > 1e-3 and not weighed.hypothesis.id:
            names.append(("physics that recordings show differently", float(p)))
        elif p > 1e-3:
            what = DIFFERENT.get(weighed.hypothesis.id, f"another {weighed.hypothesis.what}")
            names.append((f"{what} of {own[weighed.hypothesis.recording].recording}", float(p)))
    return tuple(names)


def _chi2(campaign: Campaign, model: SharedModel) -> float:
    """Reduced chi-squared of the model's mode for a campaign; infinite where it has none."""
    fit = model.fitted(campaign)
    return float("inf") if fit is None else fit.reduced_chi2


def log_likelihood_gain(before: float, after: float, campaign: Campaign) -> float:
    """Nats that a correction gains by its reduced chi-squared, at the noise that remains."""
    samples = sum(r.count for r in campaign.recordings)
    found = 0.5 * samples * (before - after) / max(after, 1.0)
    return float(found) if np.isfinite(after) else -np.inf
