"""Where an ascent goes on that ended on the wrong side of a contact onset.

Readings of velocities and accelerations jump where a contact begins or ends: by what an obstacle's
mass takes, by the force of a damper. A sample that lies beside such an instant is read before or
after it, and the likelihood has a step where the instant passes the sample. No derivative shows
it: an ascent that comes from the wrong side ends before it, and any parameter that moves the
instant a little seems to be worth what one reading is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.fit import Fit, inverse

Array = NDArray[np.float64]

OUTLYING = 6.0  # standard deviations of a reading: one in a billion is, of the noise alone
FEW = 8  # readings of one recording, set by hand: more are no single instants
SHARES = 2.0 ** np.arange(-6, 5)  # of what a parameter is uncertain by where all others are known
MEDIAN = 0.6745  # of normal numbers' sizes, standard deviations
GAINED = 3.0  # nats, for an ascent to go on, set by hand


def beyond_onset(fit: Fit, fixed: Sequence[int] = ()) -> Array | None:
    """A likelier point (d,) than a mode, beside it, where one reading is on the other side of a
    onset; None where no reading that may jump is far off, or nothing is gained.

    A gap moves all touches, the initial state those of one recording. Parameters `fixed` stay.
    """
    campaign = fit.density.oscillator.campaign
    if not campaign.stop or not np.isfinite(fit.log_posterior):
        return None
    rows = [
        recording.name
        for recording, part in zip(campaign.recordings, fit.linearisation, strict=True)
        if recording.order > 0 and 0 < _outlying(part.residual) <= FEW
    ]
    if not rows:
        return None
    ends = ("g", *(f"{key}[{name}]" for name in rows for key in ("g", "y0", "v0")))
    moving = [
        i for i, name in enumerate(fit.names) if i not in fixed and name.rpartition(".")[2] in ends
    ]
    with np.errstate(invalid="ignore", divide="ignore"):
        sd = 1.0 / np.sqrt(np.diag(inverse(fit.covariance))[moving])
    steps = np.outer(sd, np.concatenate([-SHARES, SHARES]))
    points = np.repeat(fit.mode[None], steps.size, axis=0)
    points[np.arange(steps.size), np.repeat(moving, 2 * SHARES.size)] += steps.ravel()
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return None
    found = np.nan_to_num(fit.density(points), nan=-np.inf)
    best = int(np.argmax(found))
    return points[best] if found[best] > fit.log_posterior + GAINED else None


def _outlying(residual: Array) -> int:
    """How many readings are far off, by what half of them are off at least."""
    size = np.abs(residual[residual != 0.0])  # what is set aside is 0
    return int(np.sum(size > OUTLYING * np.median(size) / MEDIAN)) if size.size else 0
