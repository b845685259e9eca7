"""The evidence page's tables are what the stored results say, and the README links to it."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_tables_are_those_of_the_stored_results() -> None:
    path = ROOT / "tests" / "benchmarks" / "readme.py"
    spec = importlib.util.spec_from_file_location("readme_tables", path)
    assert spec is not None and spec.loader is not None
    tables = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tables)
    text = (ROOT / "tests" / "benchmarks" / "EVIDENCE.md").read_text(encoding="utf-8")
    for name in tables.TABLES:
        assert f"<!-- {name} -->" in text
    assert tables.rendered(text) == text


def test_pages_are_short_and_their_links_lead_somewhere() -> None:
    readme = ROOT / "README.md"
    assert len(readme.read_text(encoding="utf-8").splitlines()) <= 200
    for page in (readme, ROOT / "CONTRIBUTING.md", ROOT / "tests" / "benchmarks" / "EVIDENCE.md"):
        for link in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
            name, _, anchor = link.partition("#")
            target = page.parent / name if name else page
            assert target.is_file(), f"{page.name}: {link}"
            heads = (
                re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.M) if anchor else []
            )
            assert not anchor or anchor in [
                re.sub(r"[^a-z0-9 -]", "", head.lower()).replace(" ", "-") for head in heads
            ], f"{page.name}: {link}"
