"""Which fault of which recording do the recordings' own parameters speak for?

Every hypothesis is a direction of one recording's logarithms (see `hierarchical`), or another
label: a probe's gain moves the gap alone (the motion scales with the displacement), a clock moves
k1 and k2 by twice and c1 and c2 by once its logarithm, and a mass, of which a free motion tells all
parameters as multiples, all of these by once its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesimpact.diagnosis.faults.alone import Alone
from bayesimpact.diagnosis.faults.hierarchical import Differences, Freed
from bayesimpact.diagnosis.thresholds import DECISIVE

WIDTH = {"recording_gain": 1.0, "recording_clock": 0.05, "recording_other_rig": 0.5}
"""Prior standard deviation of the logarithm of what a hypothesis frees."""

CERTAIN = 12.0
"""Log odds of a fault over none where the single fits' errors alone are taken for what makes
recordings differ: tails heavier than Gaussian are common, and 12 nats are 4.9 standard deviations
beyond the price of one unknown. Where trends and scatter are allowed for, `DECISIVE` odds do."""

LIKELIEST = 12  # faults whose evidence is summed over all widths

AGREE = 1e-3  # chance of larger differences, from which on errors alone explain them


@dataclass(frozen=True)
class Hypothesis:
    """What one recording is allowed to differ in.

    Attributes
    ----------
    id : of the fault; "" for none
    recording : position of the recording
    direction : of its logarithms, per unit of the unknown; () for a mere change of label
    case : the label it would have; None as given
    what : the parameter of another rig, or its mass
    """

    id: str = ""
    recording: int = -1
    direction: tuple[float, ...] = ()
    case: str | None = None
    what: str = ""


@dataclass(frozen=True, eq=False)
class Weighed:
    """A hypothesis with its log evidence, and the unknown that it frees with its error.

    `agreement` is the chance that recordings that agree under it differ by as much as they do.
    """

    hypothesis: Hypothesis
    log_evidence: float
    agreement: float = 0.0
    value: float = 0.0
    sd: float = 0.0


def hypotheses(cases: Sequence[str], stop: bool) -> list[Hypothesis]:
    """Nothing wrong, and every single fault of every single recording."""
    found = [Hypothesis()]
    known = list(dict.fromkeys(cases))
    names = ("c1", "k1", "c2", "k2") if stop else ("c1", "k1")
    places = {"c1": 0, "k1": 1, "c2": 2, "k2": 4}
    size = 5 if stop else 2
    for r, case in enumerate(cases):
        for name in names:
            unit = tuple(float(i == places[name]) for i in range(size))
            found.append(Hypothesis("recording_other_rig", r, unit, None, name))
        if stop:
            mass = (-1.0, -1.0, -1.0, 0.0, -1.0)
            found.append(Hypothesis("recording_other_rig", r, mass, None, "mass"))
            found.append(Hypothesis("recording_clock", r, (-1.0, -2.0, -1.0, 0.0, -2.0)))
            found.append(Hypothesis("recording_gain", r, (0.0, 0.0, 0.0, 1.0, 0.0)))
            found += [Hypothesis("recording_case", r, (), c) for c in known if c != case]
    return found


def weigh_all(
    alone: Sequence[Alone], cases: Sequence[str], stop: bool, most: int
) -> tuple[Weighed, list[Weighed], float]:
    """No fault; faults, the likeliest first; the log odds that one needs over none.

    Trends and scatter come in only where the recordings differ by more than their errors even under
    the likeliest faults of up to `most` of them: they hide what the correlations of their
    parameters tell.
    """
    none, *every = hypotheses(cases, stop)
    recordings = Recordings(alone, cases)
    base = recordings.weighed([none], exact=True)
    ranked = _ranked([recordings.weighed([h], exact=True) for h in every])
    chosen = [ranked[0]]
    while max(base.agreement, chosen[-1].agreement) <= AGREE and len(chosen) < most:
        known = [w.hypothesis for w in chosen]
        faulty = {h.recording for h in known}
        others = [h for h in every if h.recording not in faulty]
        chosen.append(_ranked([recordings.weighed([*known, h], exact=True) for h in others])[0])
    if max(base.agreement, chosen[-1].agreement) > AGREE:
        first, *others = (w.hypothesis for w in chosen)
        joint = recordings.weighed([*others, first], exact=True)
        best = replace(joint, log_evidence=ranked[0].log_evidence)
        return base, [best, *ranked[1:]], CERTAIN
    likely = sorted(every, key=lambda h: -recordings.roughly(h))[:LIKELIEST]
    ranked = _ranked([recordings.weighed([h], exact=False) for h in likely])
    return recordings.weighed([none], exact=False), ranked, DECISIVE


def _ranked(found: Sequence[Weighed]) -> list[Weighed]:
    return sorted(found, key=lambda w: -w.log_evidence)


class Recordings:
    """The recordings' own parameters, and what hypotheses make of them."""

    def __init__(self, alone: Sequence[Alone], cases: Sequence[str]) -> None:
        self.alone, self.cases = alone, cases

    def weighed(self, faults: Sequence[Hypothesis], *, exact: bool) -> Weighed:
        """Evidence of several faults together, and what the last of them frees."""
        found, freed = self._differences(faults, exact=exact), self._freed(faults)
        value, share, at = found.evidence(freed)
        agreement = found.agreement(freed, share, at)
        if not faults[-1].direction:
            return Weighed(faults[-1], value, agreement)
        return Weighed(faults[-1], value, agreement, *found.estimate(freed, share, at))

    def roughly(self, fault: Hypothesis) -> float:
        """Its evidence where trends may be of any size and nothing scatters."""
        return self._differences([fault], exact=False).roughly(self._freed([fault]))

    def _differences(self, faults: Sequence[Hypothesis], *, exact: bool) -> Differences:
        labels = list(self.cases)
        for fault in faults:
            if fault.case is not None:
                labels[fault.recording] = fault.case
        return Differences(self.alone, labels, exact=exact)

    def _freed(self, faults: Sequence[Hypothesis]) -> list[Freed]:
        found = []
        for fault in faults:
            if fault.direction:
                direction = np.zeros((len(self.alone), len(fault.direction)))
                direction[fault.recording] = fault.direction
                found.append((direction, WIDTH[fault.id]))
        return found
