"""Is a force or a hum that a model calls harmonic really steady?

It has one amplitude in all recordings and keeps it. A resonance that rings down, or a damping that
drifts, can be imitated by one, but not without remains close to its line: amplitudes that differ
between recordings, and modulation within them. Both show as lines at its frequency and one
reciprocal duration to either side, with an amplitude and a phase of their own in every recording.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesimpact.diagnosis.score_test.directions import is_periodic, is_steady
from bayesimpact.diagnosis.score_test.forced_responses import simulated_responses
from bayesimpact.diagnosis.score_test.harmonics import Blocks, blocks_of, hums, projected
from bayesimpact.inference.fit import Fit
from bayesimpact.model.effects.effect import Effect, Scales

Array = NDArray[np.float64]

SIDEBANDS = np.array([-1.0, 0.0, 1.0])  # reciprocals of the longest recording
RANK = 1e-2  # less of a line is what the model's own amplitude and phases leave, to second order


def steadiness(fit: Fit, scales: Scales) -> tuple[float, ...]:
    """p-values that what a model calls periodic is steady, one per periodic effect in it."""
    found = []
    for effect in fit.density.oscillator.acting:
        if is_periodic(effect) and is_steady(effect):
            lines = fit.value(f"{effect.id}.frequency") + SIDEBANDS / scales.duration
            recordings = range(len(fit.linearisation))
            found.append(
                _p_value(fit, [_blocks(fit, r, effect, lines, scales) for r in recordings])
            )
    return tuple(found)


def _blocks(fit: Fit, r: int, effect: Effect, lines: Array, scales: Scales) -> Blocks:
    if effect.observe is None:
        return blocks_of(fit, r, simulated_responses(fit, r, lines, scales)[None])
    return blocks_of(fit, r, hums(fit, r, lines)[None])


def _p_value(fit: Fit, blocks: list[Blocks]) -> float:
    information, score = (x[0] for x in projected(fit, blocks))
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = values > RANK * values[-1]
    numbers = (score / scale) @ vectors[:, kept] / np.sqrt(values[kept])
    return float(stats.chi2.sf(numbers @ numbers, int(kept.sum())))
