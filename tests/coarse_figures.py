"""Reports for tests that do not look at their figures: one pixel, no PDF.

Half of such a test's time was the layout of text, whatever the number of pixels.
"""

from __future__ import annotations

import base64
import io
import warnings
from pathlib import Path

import matplotlib
import pytest
from matplotlib.figure import Figure
from PIL import Image

from bayesimpact.report.figures import save
from bayesimpact.report.figures.style import STYLE

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5E"
    "rkJggg=="
)


def saved(name: str, figure: Figure, folder: Path) -> bytes:
    """A figure's PNG file of few pixels, drawn without laying it out."""
    figure.set_layout_engine("none")
    stream = io.BytesIO()
    with matplotlib.rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(stream, format="png", dpi=12)
    return written(name, stream.getvalue(), folder)


def blank(name: str, figure: Figure, folder: Path) -> bytes:
    """An empty picture as large as the figure."""
    width, height = (round(save.DPI * float(x)) for x in figure.get_size_inches())
    stream = io.BytesIO()
    Image.new("1", (width, height)).save(stream, format="png")
    return written(name, stream.getvalue(), folder)


def undrawn(name: str, _: Figure, folder: Path) -> bytes:
    """One pixel in place of a figure."""
    return written(name, PIXEL, folder)


def written(name: str, content: bytes, folder: Path) -> bytes:
    """The content, written as the figure's PNG file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{save.file_name(name)}.png").write_bytes(content)
    return content


def draw_coarsely(patch: pytest.MonkeyPatch, *, pixels: bool = False) -> None:
    """All reports are made like that until the patch ends; `pixels`: their figures are drawn."""
    patch.setattr(save, "_saved", saved if pixels else undrawn)
