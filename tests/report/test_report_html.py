"""The page: verdict first, every number with its digits, nothing fetched from elsewhere."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser

import numpy as np
import pytest
from diagnosed import DIAGNOSIS
from synthetic import NOISE, make_results, row, with_chain

from bayesimpact.report.checks import assessed
from bayesimpact.report.html import render
from bayesimpact.report.results import EffectSummary, MeasuringChainSummary, Results

# The smallest PNG: one pixel.
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5E"
    "rkJggg=="
)
NAMES = ("fit_case_1", "fit_case_2", "corner", "backbone", "damping", "search", "traces")
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """Text, links, ids and headings of a page; fails on tags that do not close."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.feed(source)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "data", "action", "srcset", "poster"):
                self.links.append(value or "")
            if name == "id":
                self.ids.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not {"style", "script"} & set(self.open):
            self.words.append(data)

    @property
    def text(self) -> str:
        """All text, spaces as single ones."""
        joined = " ".join(self.words).replace("\N{NO-BREAK SPACE}", " ")
        return re.sub(r"\s+", " ", joined.replace("\N{NARROW NO-BREAK SPACE}", " "))


def page(results: Results, names: tuple[str, ...] = NAMES) -> tuple[str, Page]:
    source = render(results, dict.fromkeys(names, PNG))
    return source, Page(source)


@cache
def usual() -> tuple[Results, str, Page]:
    results = make_results(3, 2)
    table = tuple(
        replace(r, references={"Table 2": 5350.0, "beam theory": 5276.3})
        if r.name == "k2[1]"
        else r
        for r in results.rows
    )
    results = replace(results, rows=table)
    return results, *page(results)


def test_self_contained() -> None:
    _, source, parsed = usual()
    assert parsed.links
    for link in parsed.links:
        assert link.startswith(("data:image/png;base64,", "#")), link
    rest, scripts = re.subn(r"<script[ >].*?</script>", "", source, flags=re.DOTALL)
    assert scripts == 3  # data of the explorer, and its two scripts: see test_explorer
    assert not re.search(r"https?:|//[a-z]|@import|url\(|<script|<link|<iframe", rest)
    anchors = {link[1:] for link in parsed.links if link.startswith("#")}
    assert anchors <= set(parsed.ids) and len(set(parsed.ids)) == len(parsed.ids)


def test_verdict_comes_first() -> None:
    results, _, parsed = usual()
    text = parsed.text
    headline = re.sub(r"\s+", " ", results.headline.replace("\N{NO-BREAK SPACE}", " "))
    parts = (headline, "Parameters Medians", "Checks check finding", "Recordings, fit")
    places = [text.index(part) for part in parts]
    assert places == sorted(places) and places[0] < 300


def test_pictures_are_embedded_with_words() -> None:
    _, source, _ = usual()
    data = base64.b64encode(PNG).decode()
    assert source.count(data) == len(NAMES)
    assert source.count("<figcaption>") == len(NAMES)
    assert all(alt for alt in re.findall(r'<img alt="([^"]*)"', source))


def test_numbers_have_the_digits_of_their_uncertainty() -> None:
    _, source, parsed = usual()
    text = parsed.text
    # k1 = 808.556 +- 0.003 * 1.645; g = 1.1 mm +- 0.056 um; k2 = 5350.156 +- 0.46
    assert "808.556 808.551 to 808.561 N/m" in text
    assert "1.10000 1.09994 to 1.10006 mm" in text
    assert "5350.2 5349.7 to 5350.6 N/m" in text
    assert "<i>k</i><sub>2</sub>[1]" in source


def test_references_beside() -> None:
    _, _, parsed = usual()
    assert "5350.0 +0.6 sd 5276.3 +1.40 %" in parsed.text


def test_ratios_to_the_mass() -> None:
    _, _, parsed = usual()
    assert "only ratios to the mass can be identified" in parsed.text
    value = 808.556 / 0.503
    assert f"{value:.2f}" in parsed.text and "1/s²" in parsed.text


def test_intervals_say_what_they_contain() -> None:
    results, _, parsed = usual()
    assert "states no uncertainty of mass, clock or probe gain" in parsed.text
    # 0.1 % of 808.556 over the half-width 0.00493
    assert "for k1 that is 160 times the half-width" in parsed.text
    stated = with_chain(results, MeasuringChainSummary("", 1e-3, 0.0, 2e-3))
    text = page(stated)[1].text
    assert "mass 0.10 %, gain 0.20 %" in text and "clock 0" not in text
    half = 1.645 * 808.556e-3
    assert f"{808.556 - half:.1f} to {808.556 + half:.1f}" in text


def test_names_are_escaped() -> None:
    results, source, parsed = usual()
    assert results.name == "rig <1> & others"
    assert "rig &lt;1&gt; &amp; others" in source and "<1>" not in source
    assert results.name in parsed.text


def test_fit_alone_has_no_posterior() -> None:
    results = make_results(1, 1, sampled=False)
    _, parsed = page(results, ("fit_case_1", "search"))
    assert "Intervals from the curvature at the mode; no draws yet" in parsed.text
    assert not {"posterior", "sampler", "backbone"} & set(parsed.ids)
    assert "emcee from" not in parsed.text


def test_no_stop_has_no_words_on_it() -> None:
    results = make_results(2, stop=False, excess=30.0)
    source, parsed = page(results, ("fit", "corner"))
    assert "A linear oscillator does not fit these recordings." in parsed.text[:400]
    assert 'class="verdict bad"' in source
    assert "There is no stop." in parsed.text
    assert "gap" not in parsed.text and "case" not in parsed.text.replace("case of", "")


def test_not_converged_is_said_on_top() -> None:
    source, parsed = page(make_results(converged=False))
    assert "has not converged: the intervals are provisional" in parsed.text[:600]
    assert (
        "Check failed: the sampler converged (independent ensembles disagree)" in parsed.text[:800]
    )
    assert 'class="verdict bad"' in source


def test_angles() -> None:
    results = replace(make_results(1, stop=False), quantity="angle", mass=1.0)
    text = page(results, ("fit",))[1].text
    assert "inertia 1 kg m²" in text
    assert "With the inertia set to 1 the values above are these ratios." in text
    assert "ratio median" not in text


def test_fifty_recordings_are_all_in_the_table() -> None:
    results = make_results(50, 5, n=60)
    text = page(results)[1].text
    assert all(f"run_{i} " in text for i in range(50))
    assert "Figures show 12 of 50 recordings" in text


def test_effects_and_model() -> None:
    effect = EffectSummary("coulomb_friction", "dry friction", "F sign(v), sticking")
    results = assessed(replace(make_results(), effects=(effect,)))
    text = page(results)[1].text
    assert "dry friction ( coulomb_friction ): F sign(v), sticking" in text
    assert "with dry friction describes" in text
    assert "these are integrated in steps" in text and "nothing depends on a step" not in text
    assert "so nothing depends on a step size." in page(make_results())[1].text


def test_diagnosis_tells_its_story_first() -> None:
    results = replace(make_results(), diagnosis=DIAGNOSIS)
    source, parsed = page(results, ("force_map", *NAMES))
    text = parsed.text
    assert text.index("Dry friction is missing <here>.") < 300
    assert text.index("Diagnosis: what is missing is named") < text.index("Parameters Medians")
    for words in (
        "the suspension, wherever the mass moves (93 % of what is unexplained)",
        "cases, most first 1, 2 recordings run_0",
        "displacement \N{MINUS SIGN}6.0 to 3.0 mm",
        "Probability > 0.999; it changes the log evidence by +812.3.",
        "force = 160 (150 to 170) µN",
        "mass of the obstacle 0.010 +770.0",
        "reduced χ² 1.170 1.002",
        "residual rms 5.40 µm 5.00 µm",
        "whiteness p < 0.001 0.40",
        "+320 ± 79 (standard error): an improvement.",
        f"{(808.556 - 808.6) / (0.005 / 1.6449):.1f}".replace("-", "\N{MINUS SIGN}"),
        "quadratic drag coefficient 100 µN s²/m²",
    ):
        assert words in text, words
    assert source.count(base64.b64encode(PNG).decode()) == len(NAMES) + 1


def test_improvement_needs_more_than_two_standard_errors() -> None:
    fit = dict(DIAGNOSIS["fit"]) | {"held_out_gain": {"value": 150.0, "se": 79.0}}  # type: ignore[call-overload]
    results = replace(make_results(), diagnosis=dict(DIAGNOSIS) | {"fit": fit})
    assert "no clear improvement" in page(results)[1].text


def test_nothing_held_out_says_nothing_of_it() -> None:
    nothing = {"value": 0.0, "se": 0.0, "of": 0}
    side = {"rms_m": 5e-6, "held_out_log_score": float("nan")}
    fit = {"before": side, "after": side, "held_out_gain": nothing}
    bare = dict(DIAGNOSIS) | {"fit": fit}
    text = page(replace(make_results(), diagnosis=bare))[1].text
    assert "held out" not in text and "held-out" not in text and "residual rms 5.00 µm" in text


def test_coefficients_of_a_learned_force_are_no_parameters() -> None:
    results = make_results()
    added = tuple(row(f"learned_force.a{i}", 1e-3, 1e-4, "N", "learned") for i in range(24))
    text = page(replace(results, rows=(*results.rows, *added)))[1].text
    assert "learned_force.a" not in text
    assert "learned force of 24 coefficients" in text


@pytest.mark.parametrize("verdict", ["adequate", "unknown"])
def test_diagnosis_without_a_name(verdict: str) -> None:
    bare = dict(DIAGNOSIS) | {
        "verdict": verdict,
        "location": None,
        "effects": [],
        "alternatives": [],
    }
    parsed = page(replace(make_results(), diagnosis=bare))[1]
    assert "diagnosis" in parsed.ids and "What else could be" not in parsed.text


def test_residual_figures_are_the_measured_ones() -> None:
    results, _, parsed = usual()
    for r in results.recordings:
        assert f"{r.rms * 1e6:.2f}" in parsed.text
    assert f"{1e6 * np.sqrt(np.mean([r.rms**2 for r in results.recordings])):.2f} µm" in parsed.text
    assert f"{1e6 * NOISE:.2f} µm" in parsed.text
