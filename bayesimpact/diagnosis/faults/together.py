"""Do the recordings agree? Their own parameters as data of a linear model in logarithms.

    log theta_r = log theta + log k2[case of r] + what a hypothesis allows recording r + error_r

The errors are those of the single fits and a scatter common to all, taken robustly from the
recordings themselves: physics that the model lacks makes recordings differ, and is no fault of one.
A probe's gain moves the gap alone (the motion scales with the displacement), a clock moves k1 and
k2 by twice and c1 and c2 by once its logarithm: every hypothesis is a direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.diagnosis.faults.alone import Alone

Array = NDArray[np.float64]

WIDTH = {"recording_gain": 1.0, "recording_clock": 0.05, "recording_other_rig": 0.5}
"""Prior standard deviation of the logarithm of what a hypothesis frees."""

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
    what : the parameter of another rig
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
            found.append(Hypothesis("recording_clock", r, (-1.0, -2.0, -1.0, 0.0, -2.0)))
            found.append(Hypothesis("recording_gain", r, (0.0, 0.0, 0.0, 1.0, 0.0)))
            found += [Hypothesis("recording_case", r, (), c) for c in known if c != case]
    return found


def scatter(alone: Sequence[Alone], cases: Sequence[str]) -> Array:
    """Variance (p,) by which the recordings' logarithms differ beyond their errors, robustly."""
    logs = np.array([a.log for a in alone])
    errors = np.array([np.diag(a.covariance) for a in alone])
    result = np.zeros(logs.shape[1])
    for p in range(logs.shape[1]):
        measured = errors[:, p] < 10.0
        groups = list(cases) if p == 4 else [""] * len(alone)
        off = []
        for group in dict.fromkeys(groups):
            own = [i for i, g in enumerate(groups) if g == group and measured[i]]
            if len(own) > 1:
                middle = np.median(logs[own, p])
                # a median of n values already follows them: n / (n - 1) of the variance is left
                off += list(np.abs(logs[own, p] - middle) * np.sqrt(len(own) / (len(own) - 1)))
        if len(off) >= 3:
            total = (np.median(off) / 0.6745) ** 2
            result[p] = max(total - float(np.median(errors[measured, p])), 0.0)
    return result


def weigh(
    alone: Sequence[Alone], cases: Sequence[str], hypothesis: Hypothesis, extra: Array
) -> Weighed:
    """Log evidence of a hypothesis: generalised least squares with flat priors of what is shared.

    `extra` (p,) is the scatter. Only differences between hypotheses mean anything.
    """
    labels = list(cases)
    if hypothesis.case is not None:
        labels[hypothesis.recording] = hypothesis.case
    known = list(dict.fromkeys(cases))
    size = alone[0].log.size
    shared = 4 if size == 5 else size
    columns = shared + (len(known) if size == 5 else 0) + bool(hypothesis.direction)
    matrix, right = np.zeros((columns, columns)), np.zeros(columns)
    constant = 0.0
    for r, one in enumerate(alone):
        design = np.zeros((size, columns))
        design[range(shared), range(shared)] = 1.0
        if size == 5:
            design[4, shared + known.index(labels[r])] = 1.0
        if hypothesis.direction and r == hypothesis.recording:
            design[:, -1] = hypothesis.direction
        weight = np.linalg.inv(one.covariance + np.diag(extra))
        matrix += design.T @ weight @ design
        right += design.T @ weight @ one.log
        constant += float(one.log @ weight @ one.log)
    matrix += 1e-9 * np.eye(columns)
    if hypothesis.direction:
        matrix[-1, -1] += 1.0 / WIDTH[hypothesis.id] ** 2
    solution = np.linalg.solve(matrix, right)
    misfit = constant - float(right @ solution)
    numbers = sum(int(np.sum(np.diag(one.covariance) < 10.0)) for one in alone)
    agreement = float(stats.chi2.sf(misfit, max(numbers - columns, 1)))
    value = -0.5 * misfit
    value -= 0.5 * float(np.linalg.slogdet(matrix)[1])
    if not hypothesis.direction:
        return Weighed(hypothesis, value, agreement)
    value -= float(np.log(WIDTH[hypothesis.id]))
    sd = float(np.sqrt(np.linalg.inv(matrix)[-1, -1]))
    return Weighed(hypothesis, value, agreement, float(solution[-1]), sd)


def weigh_all(
    alone: Sequence[Alone], cases: Sequence[str], stop: bool
) -> tuple[Weighed, list[Weighed]]:
    """No fault, and every fault, the likeliest first.

    Scatter comes in only where the recordings differ by more than their errors even under the
    likeliest fault: it hides what the correlations of their parameters tell.
    """
    every = hypotheses(cases, stop)
    for extra in (np.zeros(alone[0].log.size), scatter(alone, cases)):
        weighed = [weigh(alone, cases, h, extra) for h in every]
        ranked = sorted(weighed[1:], key=lambda w: -w.log_evidence)
        if max(weighed[0].agreement, ranked[0].agreement) > AGREE:
            break
    return weighed[0], ranked
