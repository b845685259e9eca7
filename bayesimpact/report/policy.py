"""The Content-Security-Policy of report.html: nothing is fetched, no foreign code runs.

Scripts and style sheets are allowed by the SHA-256 of the package's files `template/**/*.js` and
`*.css`, which the page must hold word for word; so whatever a campaign's names smuggled into the
page would not run. Style attributes and event handlers in the markup do not work either; data
belong in `<script type="application/json">`, which is not executed.
Source: W3C, Content Security Policy Level 3, sections 6.6 and 8.3.
"""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from pathlib import Path

TEMPLATES = Path(__file__).parent / "template"
_FIRST = '<meta charset="utf-8">'


def with_policy(page: str) -> str:
    """The page with the policy as its first instruction.

    Raises
    ------
    ValueError : the page does not declare its encoding first
    """
    if page.count(_FIRST) < 1:
        raise ValueError(f"the page has no {_FIRST}")
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy()}">'
    return page.replace(_FIRST, f"{_FIRST}\n{meta}", 1)


@cache
def policy() -> str:
    """The policy's directives."""
    return "; ".join(
        (
            "default-src 'none'",
            "img-src data:",
            f"style-src {_allowed('css')}",
            f"script-src {_allowed('js')}",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


def _allowed(ending: str) -> str:
    texts = [file.read_text(encoding="utf-8") for file in sorted(TEMPLATES.rglob(f"*.{ending}"))]
    return " ".join(f"'{text_hash(text)}'" for text in texts) or "'none'"


def text_hash(text: str) -> str:
    """The hash by which a policy allows an inline script or style sheet of this content."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"
