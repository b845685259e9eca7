"""The page allows nothing but what the package itself put there."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import pytest
from diagnosed import diagnosed
from synthetic import make_results

from bayesimpact.report.html import render, unfinished
from bayesimpact.report.policy import policy, text_hash, with_policy

PNG = b"\x89PNG\r\n\x1a\n" + bytes(8) + (600).to_bytes(4, "big") + (300).to_bytes(4, "big")


class Page(HTMLParser):
    """What a browser would execute, apply or fetch."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.inline: list[tuple[str, str]] = []
        self.fetched: list[str] = []
        self.attributes: list[str] = []
        self.policies: list[str] = []
        self.before_policy: list[str] = []
        self._open = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        if given.get("http-equiv") == "Content-Security-Policy":
            self.policies.append(given["content"])
        if not self.policies:
            self.before_policy.append(tag)
        self.attributes += [n for n in given if n == "style" or n.startswith("on")]
        self.fetched += [given[n] for n in ("src", "action", "data", "poster") if n in given]
        if tag in ("link", "object", "embed", "iframe", "base", "form"):
            self.fetched.append(f"<{tag}>")
        data_only = given.get("type", "") in ("application/json", "text/plain")
        if tag == "style" or (tag == "script" and not data_only):
            self._open = tag
            self.inline.append((tag, ""))

    def handle_data(self, data: str) -> None:
        if self._open:
            tag, text = self.inline[-1]
            self.inline[-1] = (tag, text + data)

    def handle_endtag(self, tag: str) -> None:
        self._open = "" if tag == self._open else self._open


def directives() -> dict[str, list[str]]:
    return {words[0]: words[1:] for part in policy().split("; ") if (words := part.split())}


PAGES = {
    "fit": lambda: render(make_results(2, 1, n=200, sampled=False), {"fit_case_1": PNG}),
    "posterior": lambda: render(make_results(3, 2, n=200), {"corner": PNG}),
    "diagnosis": lambda: render(
        diagnosed(), {"force_map": PNG, "likelihood_gain": PNG}, {"x": "KeyError"}
    ),
    "unfinished": lambda: unfinished(make_results(1, 1, n=200), {"report": "KeyError: 'g'"}),
}


@pytest.mark.parametrize("kind", PAGES)
def test_every_page_keeps_its_own_policy(kind: str) -> None:
    """A script or style sheet that is not word for word one of template/'s files would not work."""
    page = Page(PAGES[kind]())
    assert page.policies == [policy()] and set(page.before_policy) <= {"html", "head", "meta"}
    allowed = directives()
    for tag, text in page.inline:
        assert f"'{text_hash(text)}'" in allowed[f"{tag}-src"], f"an unknown {tag}: {text[:60]!r}"
    assert any(tag == "style" for tag, _ in page.inline)
    assert page.attributes == [], "style attributes and event handlers do not work"
    assert all(source.startswith("data:") for source in page.fetched), page.fetched


def test_the_policy_is_strict() -> None:
    allowed = directives()
    assert allowed["default-src"] == ["'none'"] and allowed["base-uri"] == ["'none'"]
    assert allowed["form-action"] == ["'none'"]
    text = policy()
    assert "unsafe" not in text and "http" not in text and "*" not in text
    assert re.fullmatch(r"('sha256-[\w+/=]{44}' ?)+|'none'", " ".join(allowed["script-src"]))


def test_a_smuggled_script_is_neither_markup_nor_allowed() -> None:
    name = "</title><script>alert(1)</script><img src=x onerror=alert(1)>"
    page = Page(render(make_results(1, 1, n=200, name=name), {}))
    assert page.inline and all(f"'{text_hash(text)}'" in policy() for _, text in page.inline)
    assert page.fetched == [] and page.attributes == []
    assert text_hash("alert(1)") not in policy()


def test_a_page_without_encoding_is_no_page() -> None:
    with pytest.raises(ValueError, match="charset"):
        with_policy("<html></html>")
