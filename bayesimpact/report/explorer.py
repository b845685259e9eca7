"""The interactive part of report.html: its data, compactly, and its scripts.

Everything is inside the page: recordings as base64 of 32-bit floats, residuals and forces as 16-bit
integers with a scale, the plotting library and the page's own script word for word as in their
files, which the page's policy allows by their hashes (see `policy`).
"""

from __future__ import annotations

import base64
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bayesimpact.inference.fit import Z90
from bayesimpact.model.units import display, typeset
from bayesimpact.report.cycles import (
    before_predicted,
    contact_onsets,
    contacts,
    stop_level,
)
from bayesimpact.report.diagnosis.effect_forces import shown_cycle
from bayesimpact.report.diagnosis.force_in_time import force_in_time, is_rough
from bayesimpact.report.figures.force_map import force_unit
from bayesimpact.report.figures.recordings import shown_recordings
from bayesimpact.report.figures.style import response, response_word
from bayesimpact.report.results import Array, RecordingResult, Results

FOLDER = Path(__file__).parent / "template"
LIBRARY = FOLDER / "vendor" / "uPlot-1.6.32.iife.min.js"
LIBRARY_STYLE = FOLDER / "vendor" / "uPlot-1.6.32.min.css"
MOST_SAMPLES = 120_000
"""Samples in the page, 16 bytes each as base64: 1.9 MB of the 6 MB that a report may have."""
_INTEGERS = 32767


@cache
def scripts() -> tuple[str, str]:
    """The plotting library with its licence, and the explorer: the same in all pages."""
    own = FOLDER / "explorer.js"
    return LIBRARY.read_text(encoding="utf-8"), own.read_text(encoding="utf-8")


@cache
def style() -> str:
    """Style of the plotting library."""
    return LIBRARY_STYLE.read_text(encoding="utf-8")


def explorer_words(results: Results) -> str:
    """What is in the explorer, where that is not everything, and what is rough in it."""
    shown, most = _extent(results)
    words = []
    if len(shown) < len(results.recordings):
        words.append(
            f"{len(shown)} of {len(results.recordings)} recordings are here: those of every case "
            "that fit worst."
        )
    if any(results.recordings[r].samples.size > most for r in shown):
        words.append(f"Of each recording the first {most} samples are here.")
    if _has_force(results) and is_rough(results):
        words.append(
            "The base model misses by far more than the noise: the unexplained force, of a "
            "linearised problem, is a rough guide only."
        )
    return " ".join(words)


def explorer_data(results: Results) -> str:
    """Content of the page's data block: JSON that holds no "<"."""
    shown, most = _extent(results)
    before = before_predicted(results)
    best = shown_cycle(results)
    force = force_unit(results, results.diagnosis_arrays) if _has_force(results) else None
    content: dict[str, Any] = {
        "word": response_word(results),
        "unit": typeset(response(results).unit),
        "forceUnit": "" if force is None else typeset(force.unit),
        "models": ["model"] if before is None else ["base model", "with what was added"],
        "first": 0 if best is None or best.recording not in shown else shown.index(best.recording),
        "recordings": [],
    }
    for r in shown:
        recording, size = results.recordings[r], min(results.recordings[r].samples.size, most)
        level = stop_level(results, recording)
        motion, in_contact = contacts(results, recording)
        old = None if before is None else before[r]
        unit = display(recording.unit, _residual_size(recording, old))
        item: dict[str, Any] = {
            "name": recording.name,
            "case": recording.case,
            "interval": recording.interval,
            "level": None if level is None else level * response(results, recording).scale,
            "noise": _number(recording.noise_rms * unit.scale),
            "words": [
                response_word(results, recording),
                typeset(response(results, recording).unit),
                typeset(unit.unit),
            ],
            "impacts": [] if in_contact is None else contact_onsets(motion, in_contact).tolist(),
            "best": best.first if best is not None and best.recording == r else None,
            "samples": _floats(recording.samples[:size] * response(results, recording).scale),
            "residuals": [
                _integers((recording.samples - model)[:size] * unit.scale)
                for model in ([recording.predicted] if old is None else [old, recording.predicted])
            ],
            "toUnit": response(results, recording).scale / unit.scale,
        }
        found = force_in_time(results, r, recording.predicted if old is None else old)
        if found is not None and force is not None:
            mean, sd = found
            item["force"] = _integers(mean[:size] * force.scale)
            item["forceBand"] = _integers(Z90 * sd[:size] * force.scale)
        content["recordings"].append(item)
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _residual_size(recording: RecordingResult, before: Array | None) -> float:
    """Root mean square of the larger of the residuals that are shown, or the noise."""
    left = recording.residual if before is None else recording.samples - before
    rms = float(np.sqrt(np.mean(left**2)))
    return max(rms, recording.noise_rms) if np.isfinite(rms) else recording.noise_rms


def _has_force(results: Results) -> bool:
    return "force_y" in results.diagnosis_arrays


def _extent(results: Results) -> tuple[list[int], int]:
    """Positions of the recordings that are shown, and most samples of each."""
    shown = list(range(len(results.recordings)))
    if sum(r.samples.size for r in results.recordings) > MOST_SAMPLES:
        names = {r.name for r in shown_recordings(results)}
        shown = [i for i, r in enumerate(results.recordings) if r.name in names]
    sizes = sorted(results.recordings[i].samples.size for i in shown)
    most, left = MOST_SAMPLES, MOST_SAMPLES
    for k, size in enumerate(sizes):  # short ones are whole, the others share what is left
        most = left // (len(sizes) - k)
        left -= min(size, most)
    return shown, max(most, 2)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _floats(values: Array) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")


def _integers(values: Array) -> dict[str, Any]:
    """16-bit integers, and the size of one; the lowest stands for what is not finite."""
    known = np.isfinite(values)
    scale = float(np.max(np.abs(values[known]), initial=0.0)) / _INTEGERS or 1.0
    integers = np.where(known, np.round(np.where(known, values, 0.0) / scale), -_INTEGERS - 1)
    data = base64.b64encode(integers.astype("<i2").tobytes())
    return {"scale": scale, "data": data.decode("ascii")}
