"""All figures of some results, and their files."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure
from PIL import Image

from bayesimpact.report.archive import atomic
from bayesimpact.report.figures.backbone import backbone_figures
from bayesimpact.report.figures.corner import corner_figure
from bayesimpact.report.figures.diagnosis import DRAWERS as DIAGNOSIS
from bayesimpact.report.figures.diagnosis import Drawer
from bayesimpact.report.figures.recordings import recording_figures
from bayesimpact.report.figures.search import search_figure
from bayesimpact.report.figures.style import STYLE
from bayesimpact.report.figures.traces import trace_figure
from bayesimpact.report.published import PUBLISHED
from bayesimpact.report.results import Results

DPI = 150
_COLOURS = 256  # in a picture: a third of the bytes, no difference to be seen


def all_figures(results: Results) -> dict[str, Figure]:
    """Every figure that the results allow, by the name of its file, in the order of the page."""
    return {name: figure for draw in drawers(results) for name, figure in draw(results).items()}


def drawers(results: Results) -> tuple[Drawer, ...]:
    """Functions from results to figures by name; each may find nothing to draw."""
    told = () if results.diagnosis is None else DIAGNOSIS
    return (*told, recording_figures, _corner, backbone_figures, _search, _traces)


def _corner(results: Results) -> dict[str, Figure]:
    if results.draws is None:
        return {}
    truths = {r.name: r.references[PUBLISHED] for r in results.rows if PUBLISHED in r.references}
    figure = corner_figure(
        results.draws,
        before=results.before,
        truths=truths,
        truth_label=PUBLISHED,
        estimates={r.name: (r.median, *r.ci90) for r in results.rows},
    )
    return {"corner": figure}


def _search(results: Results) -> dict[str, Figure]:
    return {} if results.search is None else {"search": search_figure(results.search)}


def _traces(results: Results) -> dict[str, Figure]:
    return {} if results.sampler is None else {"traces": trace_figure(results.sampler)}


def save_figures(figures: Mapping[str, Figure], folder: Path) -> dict[str, bytes]:
    """Write NAME.png (150 dpi) and NAME.pdf for every figure into a folder, made if absent.

    Returns
    -------
    The PNG files' content by name, for the page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pictures = {}
    with matplotlib.rc_context(STYLE):
        for name, figure in figures.items():
            safe = file_name(name)
            pictures[name] = png(figure)
            figure.set_layout_engine("none")  # laid out once is enough
            with atomic(folder / f"{safe}.png") as temporary:
                temporary.write_bytes(pictures[name])
            with atomic(folder / f"{safe}.pdf") as temporary:
                figure.savefig(temporary, metadata={"CreationDate": None})
    return pictures


def png(figure: Figure) -> bytes:
    """A figure as a PNG file."""
    stream, small = io.BytesIO(), io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    with Image.open(stream) as picture:
        colours = picture.convert("RGB").quantize(_COLOURS, method=Image.Quantize.FASTOCTREE)
    colours.save(small, format="png", optimize=True)
    return min(stream.getvalue(), small.getvalue(), key=len)


def file_name(name: str) -> str:
    """A file name for a figure that carries a case's name: letters, digits, - and _ only."""
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in name)
