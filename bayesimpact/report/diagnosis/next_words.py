"""The next recording in words: a sentence, the rows of its table, the table of the command line.

All from the content of next.json alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesimpact.data.text_table import text_table
from bayesimpact.model.units import decimals, number, quantity, significant
from bayesimpact.report.diagnosis.words import titles_of

Content = Mapping[str, Any]

MOST = 12
"""Designs in a table; the best repeat of a recording always is."""
LIKELY = 0.5
"""Chance to settle below which the sentence says that no single recording is likely to."""
APART = "*"
APART_WORDS = (
    "* a campaign of its own, for diagnose takes one gap, and a stop throughout or none; figures "
    "are those of both taken together"
)


def design_words(design: Content, *, angle: bool = False) -> str:
    """What to record: "a release from 8.84 mm against case 2, 2.6 s at 500 Hz"."""
    length = "rad" if angle else "m"
    times = f"{significant(design['duration_s'], 2)} s at {design['sample_rate_hz']:.5g} Hz"
    if design["repeats"]:
        return f"{design['repeats']} once more, {times}"
    words = f"a release from {quantity(design['y0_m'], length)}"
    if design["kind"] == "stop removed":
        words += " with the stop removed"
    elif design["case"]:
        words += f" against case {design['case']}"
    if design["gap_shift_m"]:
        way = "farther" if design["gap_shift_m"] > 0 else "nearer"
        words += f" moved {quantity(abs(design['gap_shift_m']), length)} {way}"
    return f"{words}, {times}"


def chosen(content: Content) -> Content | None:
    """The proposal: the best design that can stand in the same campaign; None without any."""
    return next((d for d in content["designs"] if d["same_campaign"]), None)


def best_repeat(content: Content) -> Content | None:
    """The best of the recordings made once more."""
    return next((d for d in content["designs"] if d["repeats"]), None)


def sentence(content: Content) -> str:
    """The proposal in one sentence; "" without one."""
    best, again = chosen(content), best_repeat(content)
    if best is None:
        return ""
    what = design_words(best, angle=content["angle"])
    compare = again is not None and again is not best
    if not content["open"]:
        words = (
            f"The next recording that narrows {stiffness(best)} most is {what}: by {_share(best)}"
        )
        return words + (f" (the best repeat: {_share(again)})." if compare and again else ".")
    odds = f"expected ln odds {nats(best['expected_log_odds'])}"
    if compare and again:
        odds += f", {nats(again['expected_log_odds'])} for the best repeat of a recording"
    chance = best["chance_to_settle"]
    if chance is None:
        return f"To tell the models that are left apart, record {what} next ({odds})."
    if chance < LIKELY:
        return (
            f"No single recording is likely to settle it; the best next one is {what} "
            f"({odds}; chance {_percent(chance)})."
        )
    return f"To settle it, record {what} next ({odds}; chance {_percent(chance)})."


def stiffness(design: Content) -> str:
    """Whose interval is told: k2, or k1 without a stop."""
    return next((name.partition("[")[0] for name in design["half_ci90"]), "k2").rpartition(".")[2]


def nats(value: float) -> str:
    """Expected ln odds for a table: two digits, whole numbers from 10 on."""
    if value < 0.05:
        return "0"
    return number(value, 0) if value >= 10 else number(value, min(decimals(value, 2), 1))


def shown(content: Content) -> list[Content]:
    """Designs of a table, best first."""
    designs = list(content["designs"])
    again = best_repeat(content)
    kept = designs[:MOST]
    if again is not None and again not in kept:
        kept = [*kept[:-1], again]
    apart = next((d for d in designs if not d["same_campaign"]), None)
    if apart is not None and apart not in kept:
        kept.append(apart)
    return kept


def next_rows(content: Content) -> list[tuple[str, str, str, str, str]]:
    """Rank, design, expected ln odds, chance to settle, narrowing of the stiffness."""
    return [
        (
            str(d["rank"]),
            design_words(d, angle=content["angle"]) + ("" if d["same_campaign"] else f" {APART}"),
            "" if d["expected_log_odds"] is None else nats(d["expected_log_odds"]),
            "" if d["chance_to_settle"] is None else _percent(d["chance_to_settle"]),
            _share(d),
        )
        for d in shown(content)
    ]


def next_view(content: Content | None) -> dict[str, Any] | None:
    """What the section of the report shows; None without designs."""
    if not content or not content["designs"]:
        return None
    rows = next_rows(content)
    return {
        "sentence": content["sentence"],
        "rivals": [
            (titles_of(" + ".join(r["effects"])) or "the base model", _percent(r["probability"]))
            for r in content["rivals"]
        ]
        if content["open"]
        else [],
        "rows": rows,
        "has_odds": bool(rows[0][2]),
        "has_chance": bool(rows[0][3]),
        "stiffness": stiffness(content["designs"][0]),
        "apart": APART_WORDS.removeprefix("* ") if _has_apart(content) else "",
    }


def table_lines(content: Content) -> list[str]:
    """The table as lines of text."""
    view = next_view(content)
    if view is None:
        return ["no design could be compared: every model's motion fails"]
    heads = ["", "recording", "ln odds", "settles", f"{view['stiffness']} narrower"]
    rows = [heads, *map(list, view["rows"])]
    kept = [0, 1, *([2] if view["has_odds"] else []), *([3] if view["has_chance"] else []), 4]
    lines = text_table([[row[k] for k in kept] for row in rows], left=(1,))
    return [*lines, *([APART_WORDS] if _has_apart(content) else [])]


def _has_apart(content: Content) -> bool:
    return not all(d["same_campaign"] for d in shown(content))


def _percent(share: float) -> str:
    if share >= 0.995:
        return "> 99 %"
    return "< 1 %" if share < 0.005 else f"{100 * share:.0f} %"


def _share(design: Content) -> str:
    return f"{100 * design['narrowing']:.0f} %"
