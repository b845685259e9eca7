"""Reports for tests that do not look at their figures: few pixels, no PDF, no second process."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import matplotlib
import pytest
from matplotlib.figure import Figure

from bayesimpact.report.figures import save, shares
from bayesimpact.report.figures.style import STYLE


def saved(name: str, figure: Figure, folder: Path) -> bytes:
    """A figure's PNG file, drawn without laying it out."""
    figure.set_layout_engine("none")
    stream = io.BytesIO()
    with matplotlib.rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(stream, format="png", dpi=12)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{save.file_name(name)}.png").write_bytes(stream.getvalue())
    return stream.getvalue()


def draw_coarsely(patch: pytest.MonkeyPatch) -> None:
    """All reports are drawn like that until the patch ends."""
    patch.setattr(save, "_saved", saved)
    patch.setattr(shares, "started", lambda folder: None)
