"""All figures of some results, and their files."""

from __future__ import annotations

import hashlib
import io
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from bayesimpact.data.files import atomic
from bayesimpact.report.figures.backbone import backbone_figures
from bayesimpact.report.figures.collector import held_back
from bayesimpact.report.figures.corner import corner_figure
from bayesimpact.report.figures.diagnosis import DRAWERS as DIAGNOSIS
from bayesimpact.report.figures.diagnosis import Drawer
from bayesimpact.report.figures.recordings import recording_figures
from bayesimpact.report.figures.search import search_figure
from bayesimpact.report.figures.style import STYLE
from bayesimpact.report.figures.traces import trace_figure
from bayesimpact.report.published import PUBLISHED
from bayesimpact.report.results import Results

FIGURES = "figures"
DPI = 150
_COLOURS = 256  # in a picture: a third of the bytes, no difference to be seen
LONGEST_NAME = 40
"""Characters of a file's name: with its ending and a temporary name's below 255 bytes."""


@dataclass(frozen=True)
class SavedFigures:
    """PNG files by the name of the figure; the reason, by what could not be drawn."""

    pictures: Mapping[str, bytes] = field(default_factory=dict)
    failed: Mapping[str, str] = field(default_factory=dict)


def figures_of(draw: Drawer, results: Results) -> dict[str, Figure]:
    """What one function draws; names that hold a $ are shown as they are, not as mathematics."""
    return {n.replace(r"\$", "$"): figure for n, figure in draw(escaped(results)).items()}


def escaped(record: Any) -> Any:
    """The same record with every $ of its texts escaped for matplotlib's mathematics."""
    if isinstance(record, str):
        return record.replace("$", r"\$") if "$" in record else record
    if is_dataclass(record) and not isinstance(record, type):
        old = {f.name: getattr(record, f.name) for f in fields(record)}
        changed = {name: new for name, value in old.items() if (new := escaped(value)) is not value}
        return replace(record, **changed) if changed else record
    if isinstance(record, Mapping):
        pairs = {escaped(key): escaped(value) for key, value in record.items()}
        same = all(pairs.get(key) is value for key, value in record.items())
        return record if same else pairs
    if isinstance(record, (tuple, list)):
        items = [escaped(item) for item in record]
        same = all(new is item for new, item in zip(items, record, strict=True))
        return record if same else type(record)(items)
    return record


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
        # where something remains, tables carry it and draws do not: their titles are their own
        estimates=None if results.remains else {r.name: (r.median, *r.ci90) for r in results.rows},
        shown=None if results.remains else {r.name: results.digits(r) for r in results.rows},
    )
    return {"corner": figure}


def _search(results: Results) -> dict[str, Figure]:
    return {} if results.search is None else {"search": search_figure(results.search)}


def _traces(results: Results) -> dict[str, Figure]:
    if results.sampler is None:
        return {}
    # where something remains, tables carry it and draws do not
    rows = () if results.remains else results.rows
    told = {row.name: (row.median, results.digits(row)) for row in rows}
    return {"traces": trace_figure(results.sampler, told)}


def save_figures(figures: Mapping[str, Figure], folder: Path) -> dict[str, bytes]:
    """Write NAME.png (150 dpi) and NAME.pdf for every figure into a folder, made if absent.

    Returns
    -------
    The PNG files' content by name, for the page.
    """
    return {name: _saved(name, figure, folder) for name, figure in figures.items()}


def save_all(results: Results, folder: Path) -> SavedFigures:
    """Draw all figures that the results allow and save them into `folder`'s folder of figures.

    Raises
    ------
    OSError : the folder cannot be written
    """
    found = [save_drawn(draw, results, folder / FIGURES) for draw in drawers(results)]
    return SavedFigures(
        {name: data for drawn in found for name, data in drawn.pictures.items()},
        {name: reason for drawn in found for name, reason in drawn.failed.items()},
    )


@held_back()
def save_drawn(draw: Drawer, results: Results, folder: Path) -> SavedFigures:
    """Draw and save what one function draws; a figure that fails leaves its reason, not a gap.

    Raises
    ------
    OSError : the folder cannot be written
    """
    try:
        figures = figures_of(draw, results)
    except OSError:
        raise
    except Exception as error:
        return SavedFigures(failed={draw.__name__.strip("_").replace("_", " "): reason(error)})
    pictures, failed = {}, {}
    for name, figure in figures.items():
        try:
            pictures[name] = _saved(name, figure, folder)
        except OSError:
            raise
        except Exception as error:
            failed[name.replace("_", " ")] = reason(error)
    return SavedFigures(pictures, failed)


def reason(error: Exception) -> str:
    """An error as one line."""
    words = " ".join(str(error).split())
    return f"{type(error).__name__}: {words[:200]}" if words else type(error).__name__


def _saved(name: str, figure: Figure, folder: Path) -> bytes:
    folder.mkdir(parents=True, exist_ok=True)
    safe = file_name(name)
    with matplotlib.rc_context(STYLE), warnings.catch_warnings():
        # a name in letters that the font lacks shows boxes there; that is all
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        picture = png(figure)
        with atomic(folder / f"{safe}.png") as temporary:
            temporary.write_bytes(picture)
        with atomic(folder / f"{safe}.pdf") as temporary:
            figure.savefig(temporary, metadata={"CreationDate": None})
    return picture


def png(figure: Figure) -> bytes:
    """A figure, laid out for good, as a PNG file."""
    lay_out(figure)
    figure.set_dpi(DPI)
    canvas: Any = FigureCanvasAgg(figure)  # carries no types
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    stream = io.BytesIO()
    picture.quantize(_COLOURS, method=Image.Quantize.FASTOCTREE).save(stream, format="png")
    return stream.getvalue()


def lay_out(figure: Figure) -> None:
    """Place what is on a figure, once: with a layout engine, every file of it is drawn twice."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)  # "none" would leave a placeholder, which is an engine


def file_name(name: str) -> str:
    """A file name for a figure that carries a case's name: letters, digits, - and _ only.

    Where that changes the name or cuts it, a digest keeps different names apart.
    """
    safe = "".join(c if c.isalnum() or c in "-_" else "_" for c in name)[:LONGEST_NAME]
    if safe == name:
        return name
    return f"{safe}-{hashlib.sha256(name.encode('utf-8', 'replace')).hexdigest()[:6]}"
