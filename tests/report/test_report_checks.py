"""The verdict, the checklist and the tests of whiteness."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from synthetic import make_results

from bayesimpact.data.campaign import Smoothing
from bayesimpact.inference.noise.whitening import Noise
from bayesimpact.model.measurement import smooth
from bayesimpact.report.captions import caption
from bayesimpact.report.checks import assess, assessed
from bayesimpact.report.results import EffectSummary
from bayesimpact.report.whiteness import flat_spectrum, whiteness
from bayesimpact.report.words import facts, recordings_words


@pytest.mark.parametrize(
    ("chi2", "z", "verdict"),
    [
        (1.0, 0.1, "adequate"),
        (1.05, 2.9, "adequate"),
        (1.05, 3.1, "slight"),
        (1.43, 40.0, "slight"),
        (1.45, 40.0, "inadequate"),
        (1.45, 2.0, "adequate"),
        (1e4, 1e5, "inadequate"),
        (float("nan"), float("nan"), "inadequate"),
        (0.95, -4.9, "adequate"),
        (0.5, -50.0, "overestimated"),
    ],
)
def test_verdict(chi2: float, z: float, verdict: str) -> None:
    assert assess(chi2, z) == verdict


def test_adequate_in_words() -> None:
    results = make_results()
    assert results.verdict == "adequate" and results.failed == ()
    assert "describes these recordings down to the noise" in results.headline
    assert "5.00\N{NO-BREAK SPACE}µm" in results.headline
    assert results.headline.endswith("The sampler converged.")


def test_noise_taken_from_what_a_model_leaves_is_no_test_of_it() -> None:
    results = make_results()
    assert "estimated without the model" in results.headline
    assert results.checks[0].status == "passed"
    taken = replace(results, noise=replace(results.noise, is_independent=False))
    after = assessed(taken)
    assert after.verdict == "adequate" and "without the model" not in after.headline
    assert after.checks[0].status == "note" and "no test of the misfit" in after.checks[0].meaning
    names = [name for name, _ in facts(taken)]
    assert "noise, from what the model leaves" in names
    assert "what the model leaves" in recordings_words(taken)
    assert "without the model" in caption("fit", results)
    assert "without the model" not in caption("fit", taken)


def test_a_linear_oscillator_that_does_not_fit_is_said_so_first() -> None:
    results = make_results(2, stop=False, excess=30.0)
    assert results.verdict == "inadequate"
    assert results.headline.startswith("A linear oscillator does not fit these recordings.")
    share = 100 * results.rms / np.std(np.concatenate([r.samples for r in results.recordings]))
    assert f"{share:.1f} % of the signal unexplained" in results.headline
    assert "about 30 times what noise" in results.headline
    assert [c.title for c in results.failed] == ["Misfit against the independent noise estimate"]


def test_effects_are_named_in_the_verdict() -> None:
    added = replace(make_results(1, stop=False), effects=(EffectSummary("a", "drag", ""),))
    assert assessed(added).headline.startswith("An oscillator with drag describes")
    effects = tuple(EffectSummary(i, t, "") for i, t in (("a", "dry friction"), ("b", "drag")))
    results = assessed(replace(make_results(excess=3.0), effects=effects))
    assert results.headline.startswith(
        "The impact oscillator with dry friction and drag does not fit"
    )


def test_after_a_diagnosis_nobody_is_sent_to_diagnose() -> None:
    for results in (make_results(2, stop=False, excess=3.0), make_results(3, n=6000, excess=1.1)):
        assert "bayesimpact diagnose" in results.headline
        after = assessed(replace(results, diagnosis={"verdict": "unknown", "summary": ""}))
        assert "bayesimpact diagnose" not in after.headline
        assert ("carry what remains." in after.headline) == (after.verdict == "inadequate")


def test_slight_misfit_warns_about_the_intervals() -> None:
    results = make_results(3, n=6000, excess=1.1)
    assert results.verdict == "slight"
    excess = 100 * (np.sqrt(results.reduced_chi2) - 1)
    assert 9 < excess < 11 and f"to {excess:#.2g}".rstrip(".") + " % above" in results.headline
    assert "more than their intervals" in results.headline


def test_what_went_wrong_in_the_computation_is_said() -> None:
    results = make_results(converged=False)
    assert "has not converged: the intervals are provisional" in results.headline
    assert results.search is not None
    apart = assessed(replace(results, search=replace(results.search, agree=False, distance=8.0)))
    assert "ended in different places" in apart.headline
    stuck = assessed(replace(apart, fit_converged=False))
    assert "did not converge to the mode" in stuck.headline
    assert [c.title for c in stuck.failed] == [
        "The fit converged to the mode",
        "Guess and global search end at the same mode",
        "The sampler converged",
    ]


def test_backbone_outside_its_band_fails() -> None:
    results = make_results()
    assert results.backbone is not None
    low = replace(results.backbone, p_values=np.array([0.4, 0.3, 0.0009]))
    failed = assessed(replace(results, backbone=low)).failed
    assert [c.title for c in failed] == ["Recorded backbones lie where simulated ones do"]
    assert failed[0].finding == (
        "case 1: 91 % inside, p = 0.40; case 2: 91 % inside, p = 0.30; all: 91 % inside, p < 0.001"
    )


def test_posterior_that_is_not_gaussian_is_a_note() -> None:
    results = make_results()
    wide = replace(results.rows[1], posterior_sd=2 * results.rows[1].sd)
    rows = (results.rows[0], wide, *results.rows[2:])
    (check,) = [c for c in assessed(replace(results, rows=rows)).checks if "curvature" in c.title]
    assert check.status == "note" and "1.00 to 2.00; furthest from 1: k1" in check.finding


def series(rho: float, n: int, rng: np.random.Generator) -> np.ndarray:
    x = rng.standard_normal(n)
    for i in range(1, n):
        x[i] += rho * x[i - 1]
    return x


FILTER = Smoothing(kind="savgol", window=11, polyorder=2)


def p_value(x: np.ndarray, smoothing: Smoothing | None, used: np.ndarray | None) -> float:
    """Whiteness of a residual x, as a fit of one recording would hold it."""
    noise = Noise(smoothing=smoothing, level=1.0)
    recording = SimpleNamespace(samples=x, interval=1e-3, used=used)
    seen = x if smoothing is None else smooth(x, smoothing, 1e-3)
    campaign = SimpleNamespace(recordings=[recording])
    density = SimpleNamespace(
        likelihood=SimpleNamespace(noise=noise), oscillator=SimpleNamespace(campaign=campaign)
    )
    part = SimpleNamespace(residual=noise.whiten(seen, 1e-3, used))
    return whiteness(SimpleNamespace(density=density, linearisation=[part]), 0)


def gap(n: int) -> np.ndarray:
    used = np.ones(n, dtype=bool)
    used[n // 3 : n // 3 + 7] = False
    return used


@pytest.mark.parametrize(
    ("smoothing", "gapped"), [(None, False), (None, True), (FILTER, False), (FILTER, True)]
)
def test_whiteness_is_uniform_on_noise_and_sees_colour(smoothing, gapped: bool) -> None:
    rng = np.random.default_rng(3)
    used = gap(1000) if gapped else None
    p = [p_value(rng.standard_normal(1000), smoothing, used) for _ in range(300)]
    assert stats.kstest(p, "uniform").pvalue > 0.001
    used = gap(2000) if gapped else None
    coloured = [p_value(series(0.9, 2000, rng), smoothing, used) for _ in range(20)]
    assert max(coloured) < 0.01


def test_flat_spectrum_is_uniform_on_few_powers() -> None:
    rng = np.random.default_rng(5)
    p = [flat_spectrum(rng.exponential(size=6)) for _ in range(3000)]
    assert stats.kstest(p, "uniform").pvalue > 0.001


def test_nothing_to_test() -> None:
    assert np.isnan(flat_spectrum(np.zeros(10)))
    assert np.isnan(flat_spectrum(np.ones(2)))
