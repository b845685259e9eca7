"""Is what a model leaves slow noise of the measuring chain, and no force?

A force reaches the reading through the oscillator: its answer is largest about the oscillator's own
frequencies and small above. Noise that drifts does not pass through it. Both are compared on one
residual: white and AR(1) noise with a force of time (`discrepancy`), which any missing law of the
motion resembles more. Nor is a jump of the readings noise, though AR(1) noise follows it: what is
new in one reading is then far more than in all others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesimpact.data.faults.fault import gaussian_threshold
from bayesimpact.diagnosis.faults.compare import base_failed
from bayesimpact.diagnosis.measurement.whiteness import combined, ljung_box, whiteness_p
from bayesimpact.diagnosis.residual_force.discrepancy import discrepancy
from bayesimpact.diagnosis.thresholds import ALPHA, DECISIVE
from bayesimpact.inference.fit import Fit
from bayesimpact.inference.identify import Identification
from bayesimpact.inference.noise.refined import COLOURED
from bayesimpact.inference.noise.slow import SlowNoise, slow_noise
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.inference.refitted import refitted


def remaining_noise(fit: Fit) -> Noise | None:
    """The slow noise that a fit leaves; None where it leaves none, or anything else as well."""
    if whiteness_p(fit) >= ALPHA:
        return None
    found = slow_noise(fit)
    if found is None or found.log_evidence_gain < COLOURED:
        return None
    if combined([ljung_box(x) for x in found.residuals]) < ALPHA or _jumps(found):
        return None
    force = discrepancy(fit)
    if (
        force is None
        or found.log_evidence_gain < force.log_evidence_gain(fit, fit.log_posterior) + DECISIVE
    ):
        return None
    return found.noise


def _jumps(found: SlowNoise) -> bool:
    """Whether a reading is farther from what those before it predict than noise would be."""
    new = np.abs(np.concatenate(found.residuals))
    return bool(new.max() > gaussian_threshold(new.size))


def with_slow_noise(before: Identification) -> Identification:
    """The same under the slow noise that the base model leaves, if it leaves nothing else."""
    noise = None if base_failed(before.fit) else remaining_noise(before.fit)
    if noise is None:
        return before
    return replace(before, fit=refitted(before.fit, noise=noise), noise=noise)
