"""The next recording in words, as a table and as a figure."""

from __future__ import annotations

from typing import Any

from diagnosed import diagnosed, diagnosis_figures

from bayesimpact.report.diagnosis.next_words import (
    MOST,
    design_words,
    next_view,
    sentence,
    table_lines,
)
from bayesimpact.report.diagnosis.view import diagnosis_view
from bayesimpact.report.html import render


def design(rank: int, **changes: Any) -> dict[str, Any]:
    """A release of 8.84 mm against case 2."""
    return {
        "rank": rank, "kind": "release", "case": "2", "y0_m": -8.84e-3, "v0_m_s": 0.0,
        "duration_s": 2.58, "sample_rate_hz": 500.0, "stop": True, "gap_shift_m": 0.0,
        "repeats": None, "same_campaign": True, "expected_log_odds": 14.9 / rank, "pairs": None,
        "chance_to_settle": 0.93 / rank, "narrowing": 0.21 / rank,
        "half_ci90": {"k2[2]": {"before": 2.0, "after": 1.5}}, **changes,
    }  # fmt: skip


def proposed(*designs: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """Content of next.json."""
    made = {
        "verdict": "ambiguous", "open": True, "angle": False, "decisive": 5.5, "seed": 0,
        "rivals": [
            {"effects": ["spring_cubic"], "log_odds": 9.0, "probability": 0.88},
            {"effects": [], "log_odds": 7.0, "probability": 0.12},
        ],
        "designs": list(designs) or [design(1), design(2, repeats="case2_1", y0_m=-5.9e-3)],
        **changes,
    }  # fmt: skip
    return made | {"sentence": sentence(made)}


def plain(text: str) -> str:
    return text.replace("\N{NO-BREAK SPACE}", " ")


def test_designs_in_words() -> None:
    def words(**changes: Any) -> str:
        return plain(design_words(design(1, **changes)))

    assert words() == "a release from −8.84 mm against case 2, 2.6 s at 500 Hz"
    moved = words(gap_shift_m=-5e-4, kind="gap")
    assert moved == "a release from −8.84 mm against case 2 moved 0.500 mm nearer, 2.6 s at 500 Hz"
    removed = words(kind="stop removed", case=None, stop=False)
    assert removed == "a release from −8.84 mm with the stop removed, 2.6 s at 500 Hz"
    assert words(repeats="case1_a") == "case1_a once more, 2.6 s at 500 Hz"
    angle = plain(design_words(design(1, case=None, y0_m=0.5), angle=True))
    assert angle == "a release from 0.500 rad, 2.6 s at 500 Hz"


def test_the_sentence_says_what_the_verdict_needs() -> None:
    likely = plain(proposed()["sentence"])
    assert likely.startswith("To settle it, record a release from −8.84 mm against case 2")
    assert "expected ln odds 15, 7.5 for the best repeat of a recording; chance 93 %" in likely
    unlikely = proposed(design(1, chance_to_settle=0.2))["sentence"]
    assert unlikely.startswith("No single recording is likely to settle it")
    left = proposed(design(1, chance_to_settle=None), verdict="unknown")["sentence"]
    assert left.startswith("To tell the models that are left apart")
    adequate = proposed(design(1), design(2, repeats="a"), open=False, verdict="adequate")
    assert "narrows k2 most" in adequate["sentence"] and "21 %" in adequate["sentence"]
    assert "(the best repeat: 10 %)" in adequate["sentence"]


def test_a_campaign_of_its_own_is_not_the_proposal() -> None:
    content = proposed(design(1, kind="stop removed", stop=False, same_campaign=False), design(2))
    assert "stop removed" not in content["sentence"]
    lines = table_lines(content)
    assert "stop removed" in lines[1] and " *" in lines[1] and lines[-1].startswith("* a campaign")


def test_the_table_keeps_the_best_repeat() -> None:
    many = [design(k) for k in range(1, 20)] + [design(20, repeats="case1_a")]
    view = next_view(proposed(*many))
    assert view is not None and len(view["rows"]) == MOST
    assert [row[0] for row in view["rows"]][-1] == "20"
    assert next_view(proposed() | {"designs": []}) is None


def test_the_report_shows_sentence_table_and_figure() -> None:
    content = proposed()
    results = diagnosed(next=content)
    view = diagnosis_view(results)
    assert view is not None and view["next"]["has_chance"]
    figure = diagnosis_figures(results)["designs"]
    left, right = figure.axes
    assert left.get_xlabel() == "expected ln odds (nats)" and "k2" in right.get_xlabel()
    page = plain(render(results, {}))
    assert "Which recording next" in page and "chance to settle" in page
    assert page.count("against case 2, 2.6 s at 500 Hz") >= 2
    assert "Which recording next" not in render(diagnosed(), {})


def test_without_rivals_there_is_one_panel() -> None:
    closed = [design(k, expected_log_odds=None, chance_to_settle=None) for k in (1, 2)]
    content = proposed(*closed, open=False, verdict="named")
    assert len(diagnosis_figures(diagnosed(next=content))["designs"].axes) == 1
    assert "ln odds" not in table_lines(content)[0]
