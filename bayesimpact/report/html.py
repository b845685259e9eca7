"""report.html: one self-contained page, verdict first."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from bayesimpact.formula.law import is_formula_id
from bayesimpact.model.units import bound, reading, typeset
from bayesimpact.report import explorer, tables, words
from bayesimpact.report.captions import caption
from bayesimpact.report.checks import MISFIT
from bayesimpact.report.diagnosis.formula_text import (
    effect_title,
    raised,
    typeset_formula,
)
from bayesimpact.report.diagnosis.story import corrected, story_rows
from bayesimpact.report.diagnosis.view import diagnosis_view
from bayesimpact.report.figures.save import DPI
from bayesimpact.report.policy import with_policy
from bayesimpact.report.results import Results

TEMPLATES = Path(__file__).parent / "template"
_VERDICT_CLASS = {"adequate": "good", "inadequate": "bad", "slight": "", "overestimated": ""}
_GROUPS = (
    *("story", "fit", "corner", "backbone", "search", "traces"),
    *("force", "formula", "likelihood", "ranking", "limits", "improvement"),
    *("bands", "shifts", "designs"),
)
_PIXELS_PER_INCH = 96
_SENTENCE_END = re.compile(r"(?<=[a-z0-9)])\. (?=[A-Z])")


@dataclass(frozen=True)
class Picture:
    """An embedded PNG: kind of figure, base64 data, size on the page in CSS pixels, words."""

    kind: str
    data: str
    width: int
    height: int
    alt: str
    caption: str

    @property
    def narrow(self) -> bool:
        """True when it need not fill the page."""
        return self.width < 900


def render(
    results: Results, pictures: Mapping[str, bytes], failed: Mapping[str, str] | None = None
) -> str:
    """The page.

    Parameters
    ----------
    results : what to report
    pictures : PNG files by the name of the figure, as `figures.save.save_figures` returns them
    failed : what could not be drawn, with its reason
    """
    context = _context(results, pictures) | {"failures": dict(failed or {})}
    return with_policy(environment().get_template("report.html.j2").render(**context))


def unfinished(results: Results, failed: Mapping[str, str]) -> str:
    """The page where even its words could not be written: the verdict, and why there is no more."""
    css = Markup((TEMPLATES / "style.css").read_text(encoding="utf-8"))
    page = environment().get_template("unfinished.html.j2")
    return with_policy(page.render(r=results, css=css, failures=dict(failed)))


@cache
def environment() -> jinja2.Environment:
    """Where templates come from, and what they may use."""
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["lower_first"] = lambda text: text[:1].lower() + text[1:]
    made.filters["bound"] = lambda text: raised(bound(text))
    made.filters |= {"raised": raised, "typeset_formula": typeset_formula}
    made.filters["effect_title"] = effect_title
    made.tests["formula"] = is_formula_id
    return made


def _context(results: Results, pictures: Mapping[str, bytes]) -> dict[str, Any]:
    interest = results.select("physical", "effect")
    groups = _grouped(results, pictures)
    parameters = tables.parameter_views(results, interest)
    told = diagnosis_view(results)
    first = [] if told is None else corrected(results.diagnosis or {})
    return {
        "r": results,
        "css": Markup((TEMPLATES / "style.css").read_text(encoding="utf-8")),
        "library_css": Markup(explorer.style()),
        "scripts": [Markup(script) for script in explorer.scripts()],
        "explorer_data": Markup(explorer.explorer_data(results)),
        "explorer_words": explorer.explorer_words(results),
        "d": told,
        "story": story_rows(results),
        "corrected": [p for p in told["parameters"] if p["name"] in first] if told else [],
        "angle": results.angular,
        "kind_words": words.kind_words(results),
        "byline": words.byline(results),
        "verdict_class": _verdict_class(results),
        "facts": words.facts(results),
        "contents": _contents(results, groups),
        "parameters": parameters,
        "ratios": [v for v in parameters if v.ratio] if results.mass != 1.0 else [],
        "centre": results.centre,
        "mass_symbol": "J" if results.angular else "m",
        "failed": [c for c in results.failed if c.title != MISFIT],
        "reference_labels": tables.reference_labels(interest),
        "chain_stated": results.chain.stated,
        "parameter_words": words.parameter_words(results),
        "interval_words": words.interval_words(results),
        "ratio_words": words.ratio_words(results),
        "recordings": tables.recording_views(results),
        "recordings_words": words.recordings_words(results),
        "residual_unit": tables.residual_unit(results),
        "response_unit": typeset(reading(results.quantity, results.unit).unit),
        "pictures": groups,
        "search_words": words.search_words(results),
        "sampler": tables.sampler_views(results),
        "sampler_words": words.sampler_words(results),
        "releases": tables.release_views(results),
        "release_columns": tables.release_columns(results),
        "noise_words": words.noise_words(results),
        "priors": tables.prior_views(results),
        "provenance": _provenance(results),
        "source_words": words.source_words(results),
    }


def _verdict_class(results: Results) -> str:
    if results.sampler is not None and not results.sampler.converged:
        return "bad"
    open_ended = ("partly", "ambiguous", "unknown")
    if results.diagnosis is not None and results.diagnosis["verdict"] in open_ended:
        return ""
    return _VERDICT_CLASS[results.verdict]


def _contents(results: Results, groups: Mapping[str, list[Picture]]) -> list[tuple[str, str]]:
    """Anchors and words of the sections that the page has."""
    sections = [
        ("explore", "Explore", True),
        ("diagnosis", "Diagnosis", results.diagnosis is not None),
        ("parameters", "Parameters", True),
        ("posterior", "Posterior", bool(groups["corner"])),
        ("checks", "Checks", True),
        ("recordings", "Recordings and fit", True),
        ("releases", "Initial conditions", True),
        ("backbone", "Backbone", bool(groups["backbone"])),
        ("search", "Search", bool(groups["search"])),
        ("sampler", "Sampler", results.sampler is not None),
        ("model", "Model and priors", True),
        ("provenance", "Provenance", True),
    ]
    return [(anchor, title) for anchor, title, there in sections if there]


def _grouped(results: Results, pictures: Mapping[str, bytes]) -> dict[str, list[Picture]]:
    """Pictures by section; what belongs to no other is the diagnosis'."""
    groups: dict[str, list[Picture]] = {name: [] for name in (*_GROUPS, "diagnosis")}
    for name, data in pictures.items():
        stem = name.split("_")[0]
        group = "backbone" if stem == "damping" else stem if stem in _GROUPS else "diagnosis"
        groups[group].append(_picture(name, data, results))
    return groups


def _picture(name: str, data: bytes, results: Results) -> Picture:
    width, height = png_size(data)
    text = caption(name, results)
    first = _SENTENCE_END.split(text, maxsplit=1)[0].rstrip(".")
    return Picture(
        kind=name.split("_")[0],
        data=base64.b64encode(data).decode("ascii"),
        width=round(width * _PIXELS_PER_INCH / DPI),
        height=round(height * _PIXELS_PER_INCH / DPI),
        alt=f"{name.replace('_', ' ').capitalize()}: {first}.",
        caption=text,
    )


def png_size(data: bytes) -> tuple[int, int]:
    """Width and height of a PNG file, pixels (from its header)."""
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def _provenance(results: Results) -> list[tuple[str, str]]:
    p = results.provenance
    versions = ", ".join(f"{name} {version}" for name, version in p.versions.items())
    rows = [
        ("command", p.command or "from Python"),
        ("seed", str(p.seed)),
        ("made", p.date),
        ("time taken", f"{p.seconds:.0f} s" if p.seconds == p.seconds else ""),
        ("data (SHA-256)", p.data_sha256 or "in memory"),
        ("versions", versions),
    ]
    return [(name, value) for name, value in rows if value]
