"""The force that the base model leaves unexplained, along the recorded motion."""

from __future__ import annotations

import numpy as np

from bayesimpact.diagnosis.thresholds import LARGE
from bayesimpact.report.cycles import offset_of
from bayesimpact.report.results import Array, Results


def is_rough(results: Results) -> bool:
    """Whether the force follows from a problem that was linearised about a large misfit."""
    diagnosis = results.diagnosis or {}
    misfit = ((diagnosis.get("fit") or {}).get("before") or {}).get("reduced_chi2")
    return diagnosis.get("verdict") != "adequate" and misfit is not None and misfit > LARGE**2


def force_in_time(results: Results, r: int, predicted: Array) -> tuple[Array, Array] | None:
    """Posterior mean and standard deviation (n,) of the unexplained force, N.

    The force is a(y) + b(y) v (see `force_arrays`), taken where the motion is.

    Parameters
    ----------
    r : the recording
    predicted : (n,) reading of the model whose motion it is

    Returns
    -------
    None where the results hold no force
    """
    arrays = results.diagnosis_arrays
    if "force_y" not in arrays:
        return None
    recording = results.recordings[r]
    y = recording.motion(predicted, offset_of(results, recording))
    v = np.gradient(y, recording.interval)
    a, b, a_sd, b_sd, ab = (
        np.interp(y, arrays["force_y"], arrays[f"force_{key}"])
        for key in ("a", "b", "a_sd", "b_sd", "ab")
    )
    variance = a_sd**2 + (b_sd * v) ** 2 + 2 * v * ab
    return a + b * v, np.sqrt(np.maximum(variance, 0.0))
