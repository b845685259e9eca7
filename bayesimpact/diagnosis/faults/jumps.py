"""Readings of an acceleration that jump within the posterior: beside a contact's begin or end.

Damping in contact makes an acceleration jump at the touch and at the release. A reading taken just
there lies on one side of the jump or on the other, by changes of the parameters that all other
readings allow: the likelihood has a step within the posterior, which no climb crosses and no
curvature knows. A few such readings on the wrong side are worth a hundred nats, and any effect that
moves contacts by a microsecond seems to be needed. They say nothing else, and are set aside.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.campaign import Campaign
from bayesimpact.data.gaps import runs, without
from bayesimpact.inference.fit import Fit

Masks = tuple[NDArray[np.bool_], ...]

DRAWS = 24  # of the posterior
JUMP = 5.0  # standard deviations of the noise: elsewhere draws change a reading by about one
WIDER = 3.0  # times the posterior, whose Laplace approximation knows no step
MOST = 0.02  # of the readings: where more change the posterior is wide, and nothing is set aside


def jumping_readings(fit: Fit, rng: np.random.Generator) -> Masks:
    """Per recording which readings (n,) jump; () without accelerations and a stop, or jumps."""
    o = fit.target.oscillator
    if not o.campaign.stop or all(r.order != 2 for r in o.campaign.recordings):
        return ()
    draws = fit.draws(rng, DRAWS, WIDER)
    draws = np.clip(draws, fit.target.priors.lower, fit.target.priors.upper)
    noise, found = fit.target.likelihood.noise, []
    for r, recording in enumerate(o.campaign.recordings):
        there, *every = o.predict_recording(r, np.vstack([fit.mode, draws]))
        change = np.max(np.abs(np.nan_to_num(np.array(every)) - there), axis=0)
        jumps = change > JUMP * noise.level * noise.scales[recording.order]
        found.append(jumps & (recording.order == 2))
    share = float(np.mean(np.concatenate(found)))
    return tuple(found) if 0.0 < share < MOST else ()


def without_readings(campaign: Campaign, which: Masks) -> Campaign:
    """A campaign without some readings of its recordings."""
    pairs = zip(campaign.recordings, which, strict=True)
    recordings = tuple(without(r, runs(bad)) if bad.any() else r for r, bad in pairs)
    count = sum(int(bad.sum()) for bad in which)
    note = f"{count} readings beside jumps of the acceleration, which the posterior does not place"
    return replace(campaign, recordings=recordings, notes=(*campaign.notes, note))
