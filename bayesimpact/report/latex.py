"""Tables for a paper's supplement: LaTeX with booktabs, nothing else needed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from bayesimpact.formula.law import is_formula_id
from bayesimpact.model.units import MINUS, quantity, typeset
from bayesimpact.report.diagnosis.change_view import NUISANCES, change_words
from bayesimpact.report.diagnosis.formula_text import latex_formula, letter
from bayesimpact.report.diagnosis.limit_view import not_found
from bayesimpact.report.diagnosis.words import title_of
from bayesimpact.report.digits import Digits, digits
from bayesimpact.report.names import in_words, of_recordings, split
from bayesimpact.report.results import Results

_SPECIAL = {c: f"\\{c}" for c in "&%$#_{}"} | {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
}  # fmt: skip
_TYPESET = {
    MINUS: "$-$", "×": r"$\times$", "µ": r"$\mu$", "χ": r"$\chi$", "±": r"$\pm$", "–": "--",
    "\N{NO-BREAK SPACE}": "~", "\N{NARROW NO-BREAK SPACE}": r"\,", "<": "$<$", ">": "$>$",
}  # fmt: skip
_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_SUPERSCRIPTS = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")


def latex_tables(results: Results) -> str:
    """Parameters, and of a diagnosis both models and the limits of what was not found."""
    blocks = [_parameters(results)]
    diagnosis = results.diagnosis or {}
    if diagnosis.get("verdict") not in (None, "adequate"):
        blocks.append(_models(diagnosis))
    limits = [x for x in not_found(results) if x.get("upper95") is not None]
    if limits:
        blocks.append(_limits(limits))
    head = f"% {escaped(results.name)}: tables by bayesimpact; needs \\usepackage{{booktabs}}\n"
    return head + "\n".join(block for block in blocks if block)


def escaped(text: str) -> str:
    """Any text as LaTeX: special characters escaped, signs and superscripts as mathematics."""
    text = _SUPERSCRIPTS.sub(lambda m: f"\0{m[0].translate(_RAISED)}\1", text)
    text = "".join(_SPECIAL.get(c) or _TYPESET.get(c, c) for c in text)
    return text.replace("\0", "$^{").replace("\1", "}$")


def symbol(name: str) -> str:
    """A parameter's name: "k2[1]" becomes "$k_{2}$[1]"."""
    effect, own, key = split(name)
    known = letter(name.partition("[")[0])
    before = f"{effect}: " if effect else ""
    return escaped(before) + _own_symbol(known or own) + escaped(key)


def _own_symbol(own: str) -> str:
    """A letter or a letter with a number as mathematics, words as they are."""
    if len(own) == 1:
        return f"${own}$"
    if len(own) == 2 and own[1].isdigit():
        return f"${own[0]}_{{{own[1]}}}$"
    return escaped(own)


def _table(caption: str, columns: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    body = "\n".join(f"{' & '.join(row)} \\\\" for row in rows)
    return (
        f"\\begin{{table}}\n\\caption{{{caption}}}\n\\begin{{tabular}}{{{columns}}}\n\\toprule\n"
        f"{' & '.join(head)} \\\\\n\\midrule\n{body}\n\\bottomrule\n\\end{{tabular}}\n"
        "\\end{table}\n"
    )


def _parameters(results: Results) -> str:
    centre = results.centre
    rows = []
    for row in results.select("physical", "effect"):
        shown = results.digits(row)
        rows.append((symbol(row.name), *_cells(shown, row.median, row.ci90), _unit(shown)))
    caption = f"Parameters of {escaped(results.name)}: {centre} and 90\\,\\% interval."
    return _table(caption, "lrll", ("parameter", centre, r"90\,\% interval", "unit"), rows)


def _cells(shown: Digits, median: float, ends: Sequence[float]) -> tuple[str, str]:
    return escaped(shown.value(median)), escaped(shown.interval(ends))


def _unit(shown: Digits) -> str:
    return escaped(typeset(shown.unit))


def _models(diagnosis: Mapping[str, Any]) -> str:
    both = diagnosis.get("parameters") or {}
    before, after = both.get("before", {}), both.get("after", {})
    rows = []
    for name, old in before.items():
        if name not in after or name.partition("[")[0] in NUISANCES:
            continue
        new = after[name]
        cells: list[str] = []
        for one, other in ((old, new), (new, old)):
            shown = digits(one["unit"], one["median"], one["ci90"], (other,))
            cells += _cells(shown, one["median"], one["ci90"])
        rows.append((symbol(name), *cells, _unit(shown), escaped(change_words(old, new))))
    if not rows:
        return ""
    ids = ", ".join(map(_name, diagnosis.get("effects", ())))
    caption = "Parameters of the base model and with what was added" + (
        f" ({ids})." if ids else "."
    )
    head = (
        "parameter",
        "base",
        r"90\,\% interval",
        "extended",
        r"90\,\% interval",
        "unit",
        "change",
    )
    return _table(caption, "lrlrllr", head, rows)


def _name(effect: Mapping[str, Any]) -> str:
    """What an effect is called, or the formula that it is."""
    if is_formula_id(effect["id"]) and effect.get("title"):
        return "force " + latex_formula(effect["title"].removeprefix("force "))
    return escaped((effect.get("title") or title_of(effect["id"])) + of_recordings(effect))


def _limits(limits: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        (
            escaped(title_of(str(x["id"]))),
            _own_symbol(in_words(str(x.get("parameter", "")))),
            escaped(quantity(float(x["upper95"]), str(x.get("unit", "")))),
        )
        for x in limits
    ]
    caption = r"Effects that were not found: 95\,\% upper limits of their sizes."
    return _table(caption, "llr", ("effect", "parameter", "upper limit"), rows)
