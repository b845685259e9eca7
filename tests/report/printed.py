"""A report as it falls into pages, measured in the browser: columns break where pages break."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from browser import Tab

PAGE = (680, 1001)  # CSS pixels of an A4 page between its margins of 15 and 16 mm
_COLUMNS = f"""
document.body.style.overflow = "visible";
const main = document.querySelector("main");
Object.assign(main.style, {{columnWidth: "{PAGE[0]}px", columnGap: "100px", columnFill: "auto",
  width: "{PAGE[0]}px", height: "{PAGE[1]}px"}});
"""
_BOXES = """(() => {
  const left = document.querySelector("main").getBoundingClientRect();
  const found = [];
  for (const e of document.querySelectorAll("h1, h2, h3, p, li, dt, dd, tr, img, figcaption"))
    for (const r of e.getClientRects())
      if (r.width && r.height) found.push([e.tagName, Math.floor((r.left - left.left + 1) / PITCH),
        r.top - left.top, r.bottom - left.top, (r.right - left.left) % PITCH,
        e.naturalWidth ? r.width / r.height * e.naturalHeight / e.naturalWidth : 1,
        e.textContent.slice(0, 60)]);
  return found;
})()""".replace("PITCH", str(PAGE[0] + 100))


@dataclass(frozen=True)
class Box:
    """Something printed: its tag, page, edges from the page's corner in CSS pixels, its text.

    `stretch` is by how much a picture is wider than it was drawn.
    """

    tag: str
    page: int
    top: float
    bottom: float
    right: float
    stretch: float
    text: str


def boxes(tab: Tab, file: Path) -> list[Box]:
    """Everything that a page prints, in the order of the text."""
    tab.open(file, PAGE[0])
    tab.call("Emulation.setEmulatedMedia", media="print")
    try:
        tab.run(_COLUMNS)
        tab.frames()
        return [Box(*values) for values in tab.run(_BOXES)]
    finally:
        tab.call("Emulation.setEmulatedMedia", media="")


def fills(printed: list[Box]) -> list[float]:
    """Part of every page down to the last thing on it."""
    pages = range(1 + max(b.page for b in printed))
    return [max((b.bottom for b in printed if b.page == p), default=0.0) / PAGE[1] for p in pages]
