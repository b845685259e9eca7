"""A report on A4: full pages, headings with what they head, nothing cut off, pictures as drawn."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import Tab, browser, chromium
from coarse_figures import blank, draw_coarsely
from diagnosed import diagnosed
from printed import PAGE, boxes, fills
from synthetic import make_results

from bayesimpact.report.archive import save_results
from bayesimpact.report.figures import save
from bayesimpact.report.results import Results
from bayesimpact.report.write import rewrite_report

pytestmark = [pytest.mark.long, pytest.mark.skipif(chromium() is None, reason="no Chromium here")]

HEADS = ("H1", "H2", "H3")
REPORTS = {
    "posterior": make_results(9, 3),
    "diagnosis": diagnosed(9, 3, sampled=False),
    "one recording": diagnosed(1, 1),
    "many": diagnosed(24, 6),
}


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    found = chromium()
    assert found is not None
    with browser(found) as tab:
        yield tab


@pytest.mark.parametrize("results", REPORTS.values(), ids=REPORTS)
def test_pages_are_full_and_whole(
    tab: Tab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, results: Results
) -> None:
    draw_coarsely(monkeypatch)
    monkeypatch.setattr(save, "_saved", blank)
    save_results(results, tmp_path)
    printed = boxes(tab, rewrite_report(tmp_path).page)
    assert min(fills(printed)[:-1], default=1.0) > 0.5, fills(printed)
    for page in {b.page for b in printed}:
        last = max((b for b in printed if b.page == page), key=lambda b: b.bottom)
        assert last.tag not in HEADS, last
    heads = [b for b in printed if b.tag == "H2"]
    placed = sorted(heads, key=lambda b: (b.page, b.top))
    assert placed == heads, "a heading went with its figure into the section that follows"
    assert max(b.right for b in printed) <= PAGE[0] + 1
    assert {round(b.stretch, 2) for b in printed} == {1.0}


def test_no_page_begins_with_the_figures_at_a_glance(
    tab: Tab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line of them stood alone on top of the second page."""
    draw_coarsely(monkeypatch)
    monkeypatch.setattr(save, "_saved", blank)
    said_once = "It rubs and it rubs again. "
    save_results(diagnosed(9, 3, sampled=False, summary=said_once), tmp_path)
    page, ends = rewrite_report(tmp_path).page, set()
    text = page.read_text(encoding="utf-8")
    assert text.count(said_once) == 1
    for said in range(126, 154, 3):  # the summary grows by a line, and the page's end moves on
        page.write_text(text.replace(said_once, said_once * said), encoding="utf-8")
        printed = boxes(tab, page)
        (mass,) = (b for b in printed if b.text == "mass")
        first = min((b for b in printed if b.page == mass.page), key=lambda b: b.top)
        assert first.text != "mass", said
        ends.add(mass.page)
    assert ends == {0, 1}, "the line never came to the end of a page"
