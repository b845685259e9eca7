"""Formulas as entries of diagnosis.json, and the best one as a file."""

from __future__ import annotations

from typing import Any

from bayesimpact.diagnosis.formulas.listing import Formula, Formulas, formula_text
from bayesimpact.formula.write import effect_file
from bayesimpact.model.effects.effect import Scales
from bayesimpact.model.parameters import angular

EFFECT_FILE = "effect_found.py"


def formula_entries(
    formulas: Formulas | None, scales: Scales, *, angle: bool
) -> list[dict[str, Any]]:
    """Formulas, likeliest first; `unit` is that of the sizes, a letter each."""
    return [] if formulas is None else [_entry(f, scales, angle) for f in formulas.ranked]


def _entry(f: Formula, scales: Scales, angle: bool) -> dict[str, Any]:
    units = [angular(t.unit) if angle else t.unit for t in f.terms]
    contact = all(t.region == "contact" for t in f.terms)
    yardstick = scales.contact_force if contact else scales.force
    return {
        "formula": formula_text(f.terms, angle=angle),
        "unit": ", ".join(units),
        "sizes": list(f.sizes),
        "log_odds": f.log_odds,
        "probability": f.probability,
        "peak_n": f.peak,
        "percent": 100 * f.peak / yardstick,
        "of": f"the peak elastic force of the {'obstacle' if contact else 'suspension'}",
        "fitted": f.refitted,
        "alike": list(f.alike),
    }


def found_file(formulas: Formulas) -> str:
    """The text of `EFFECT_FILE`: the likeliest formula."""
    first = formulas.ranked[0]
    odds = f"log odds {first.log_odds:.1f}"
    status = f" and named ({odds})" if formulas.named else f" as a guess ({odds}); it is not proved"
    angle = formulas.reference.density.oscillator.campaign.angular
    return effect_file(first.terms, first.effects, first.sizes, status, angle=angle)
