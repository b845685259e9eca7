"""What a bundled campaign hides: written when the campaign is made, opened once it is diagnosed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from bayesimpact.data.text_table import text_table
from bayesimpact.errors import InputError
from bayesimpact.inference.fit import Z90
from bayesimpact.model.units import display, number, signed, significant, typeset, without_zero
from bayesimpact.report.digits import digits
from bayesimpact.trial.rig.files import TRUTH_FILE

NAMES = ("c1", "k1", "c2", "g", "k2")
"""Parameters that are compared, beside those of the hidden effects."""


def open_truth(folder: Path) -> Mapping[str, Any]:
    """Effects and parameters, SI, from which the recordings of a bundled campaign were made.

    Raises
    ------
    InputError : the folder has no truth, or one that cannot be read
    """
    path = folder / TRUTH_FILE
    try:
        truth: Mapping[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return {"effects": list(truth["effects"]), "parameters": dict(truth["parameters"])}
    except (OSError, ValueError, KeyError, TypeError) as error:
        found = f"{type(error).__name__}: {error}"
        raise InputError(str(path), found, "a file with effects and parameters") from None


def compared(diagnosis: Mapping[str, Any], truth: Mapping[str, Any]) -> list[str]:
    """Answer and truth side by side, as lines of text.

    Parameters
    ----------
    diagnosis : content of diagnosis.json
    truth : of `open_truth`
    """
    before, after = (diagnosis["parameters"][side] for side in ("before", "after"))
    rows = [("", "base model", "off", "with what was added", "off", "truth")]
    for name, value in truth["parameters"].items():
        if name in after or name.partition("[")[0] in NAMES:
            found = before.get(name), after.get(name)
            unit = next((x["unit"] for x in found if x is not None), "")
            cells = [cell for x in found for cell in _estimate(x, found, value)]
            rows.append((name, *cells, _size(value, unit)))
    named = " + ".join(e["id"] for e in diagnosis["effects"]) or "nothing"
    hidden = " + ".join(truth["effects"]) or "nothing"
    rms, noise = diagnosis["fit"]["before"]["rms_m"], diagnosis["noise"]["sigma_m"]
    return [
        f"base fit: what it leaves is {rms / noise:.3f} times the noise",
        f"hidden: {hidden}",
        f"answer: {named} ({diagnosis['verdict']})",
        *text_table(rows),
        "(median ± half of the 90 % interval; off: from the truth, in standard deviations)",
    ]


def _estimate(
    estimate: Mapping[str, Any] | None, both: Sequence[Mapping[str, Any] | None], truth: float
) -> tuple[str, str]:
    """Median and half of its interval, with the report's digits, and the distance from the truth.

    `both` are the parameter's estimates of the base model and with what was added.
    """
    if estimate is None:
        return "", ""
    others = [x for x in both if x is not None and x is not estimate]
    shown = digits(estimate["unit"], estimate["median"], estimate["ci90"], others)
    low, high = estimate["ci90"]
    half = 0.5 * (high - low)
    off = (estimate["median"] - truth) / (half / Z90) if half > 0 else float("nan")
    around = number(half * shown.scale, without_zero(shown.places, half * shown.scale))
    text = f"{shown.value(estimate['median'])} ± {around}"
    return text, signed(off, 1) if isfinite(off) else ""


def _size(value: float, unit: str) -> str:
    shown = display(unit, abs(value))
    return f"{significant(value * shown.scale, 7).rstrip('0').rstrip('.')} {typeset(shown.unit)}"
