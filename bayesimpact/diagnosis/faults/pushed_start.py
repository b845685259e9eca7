"""A start under a hand's push, by the equation of motion along the measured motion.

What a push does to a simulation lasts to its end, and a mode of the release or a drift is found in
its place. Along the measured motion a force is seen while it acts, and only then: recordings from
which its time is left out obey their equation with the same laws, and leave a small part of what
all of them leave. Laws that act at large amplitudes alone are among those that are asked for.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesimpact.data.faults.fault import Fault, start_fault
from bayesimpact.diagnosis.candidates.likely_sets import LikelySets
from bayesimpact.diagnosis.thresholds import EXCESS
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

INSTANTS = (0.25, 0.5, 1.0, 1.5, 2.0)  # of a free period, from which on the motion may be free
MOST = 3  # effects that the equation may have
BETTER = EXCESS**2  # times less left of the power, four of the force: set by hand
NEARLY = 0.8  # of the best such ratio: the earliest instant that reaches so much is taken


def pushed_starts(fit: Fit, effects: Sequence[Effect], scales: Scales) -> tuple[Fault, ...]:
    """First instants of free recordings without a stop that no law explains beside the rest; of
    motions with one channel each.

    What still falls at the last instant is no push: a misfit that decays with the motion.
    """
    campaign = fit.density.oscillator.campaign
    channels = any(r.motion_name for r in campaign.recordings)
    driven = fit.density.oscillator.inputs is not None
    if campaign.stop or campaign.keep_faults or driven or channels or scales.stiffness <= 0.0:
        return ()
    period = 2 * np.pi * float(np.sqrt(scales.mass / scales.stiffness))
    whole, found = _left(fit, effects, scales), []
    for r, recording in enumerate(campaign.recordings):
        *firsts, last = (round(share * period / recording.interval) for share in INSTANTS)
        if whole is None or recording.samples.size < 4 * last:
            continue

        def ratio(first: int, r: int = r, whole: float = whole) -> float:
            rest = _left(_from(fit, r, first), effects, scales)
            return 0.0 if rest is None else whole / rest

        most = ratio(last)
        if most < BETTER:
            continue
        for first in firsts:
            reached = ratio(first)
            if reached >= max(BETTER, NEARLY * most):
                found.append(start_fault(recording, first, reached, BETTER))
                break
    return tuple(found)


def _from(fit: Fit, r: int, first: int) -> Fit:
    """The fit, as problems are posed about it, to recordings of which one begins later."""
    recordings = list(fit.density.oscillator.campaign.recordings)
    recordings[r] = recordings[r].part(first, recordings[r].samples.size)
    return fit.with_recordings(recordings)


def _left(fit: Fit, effects: Sequence[Effect], scales: Scales) -> float | None:
    """What the likeliest set leaves per independent number; None where nothing is told."""
    problem = LikelySets(fit, effects, scales)
    sets = problem.best(MOST)
    if not sets:
        return None
    return float(np.exp(problem.solve(problem.shaped([e.id for e in sets[-1].effects]))[1]))
