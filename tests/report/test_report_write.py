"""From recordings to a folder of results: part of the bundled campaign, and a misfit."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from synthetic import make_results
from test_archive_arviz import open_arviz

from bayesimpact.data.bundled import bundled_campaign
from bayesimpact.data.campaign import Campaign, Measurement
from bayesimpact.data.read import load_campaign
from bayesimpact.data.recording import Recording
from bayesimpact.errors import InputError
from bayesimpact.inference.arviz_groups import as_arviz
from bayesimpact.inference.fit import Z90
from bayesimpact.inference.identify import Identification, identify
from bayesimpact.inference.posterior import Posterior, sample
from bayesimpact.inference.sampling.convergence import quiet_arviz
from bayesimpact.report.archive import load_results
from bayesimpact.report.backbones import backbone_summary
from bayesimpact.report.build import ReportContext, results_from_fit, results_from_posterior
from bayesimpact.report.figures.gaussian import gaussian_figures
from bayesimpact.report.words import parameter_words
from bayesimpact.report.write import (
    POSTERIOR_FILE,
    REPORT_FILE,
    rewrite_report,
    write_posterior,
    write_results,
)
from bayesimpact.response.backbone import backbone


@pytest.fixture(scope="module")
def identification() -> Identification:
    """Two cases of the bundled campaign, 1.2 s."""
    whole = load_campaign(bundled_campaign())
    chosen = tuple(r for r in whole.recordings if r.name in ("case1_a", "case3_b"))
    campaign = replace(whole, recordings=chosen, measurement=Measurement(mass_sd=1e-3)).truncated(
        1.2
    )
    return identify(campaign, rng=np.random.default_rng(1), evaluations=400)


@pytest.fixture(scope="module")
def posterior(identification: Identification) -> Posterior:
    return sample(identification.fit, seed=3, target_ess=300.0)


def test_fit_in_numbers(identification: Identification) -> None:
    results = results_from_fit(identification, ReportContext("bayesimpact fit x", seed=5))
    fit = identification.fit
    assert results.kind == "fit" and results.draws is None and results.sampler is None
    assert results.verdict == "adequate"
    for i, row in enumerate(results.rows):
        assert (row.name, row.mode, row.median) == (fit.names[i], fit.mode[i], fit.mode[i])
        assert row.ci90[1] - row.mode == pytest.approx(Z90 * fit.sd[i], rel=1e-9)
    assert results.reduced_chi2 == fit.reduced_chi2
    assert results.rms == pytest.approx(fit.rms)
    weights = [r.samples.size for r in results.recordings]
    mean = np.average([r.reduced_chi2 for r in results.recordings], weights=weights)
    assert mean == pytest.approx(fit.reduced_chi2, rel=1e-9)
    freedom = sum(weights) - (fit.mode.size - 1)
    error = np.hypot(np.sqrt(2 / freedom), 2 * identification.noise.level_error)
    assert results.chi2_z == pytest.approx((fit.reduced_chi2 - 1) / error)
    assert results.provenance.seed == 5 and "numpy" in results.provenance.versions
    assert results.search is not None and results.search.agree


def test_what_remains_is_in_every_table(identification: Identification) -> None:
    """Once the page told c1 as 5 (0 to 14) in one table and as 0.0205 (0.0205 to 0.0205) below."""
    told = {"c1": {"unit": "N s/m", "median": 0.2, "ci90": [0.1, 0.4]}}
    diagnosis = {"remainder": {"rms_m": 1e-6}, "parameters": {"before": {}, "after": told}}
    results = results_from_fit(identification, ReportContext(diagnosis=diagnosis))
    row = results.row("c1")
    assert (row.median, row.ci90, results.centre) == (0.2, (0.1, 0.4), "median")
    assert row.ratio[1:] == pytest.approx((0.1 / 0.503, 0.4 / 0.503))
    assert row.mode == identification.fit.mode[0] and results.row("k1").ci90[0] > 800
    arrays = {"before_chi2": np.ones(2)}
    assert gaussian_figures(replace(results, diagnosis_arrays=arrays)) == {}


def test_without_draws_the_tables_tell_what_the_diagnosis_tells(
    identification: Identification,
) -> None:
    """Once page one told 0.025 (0.002 to 0.068), the median of a law cut at 0, and the table of
    parameters the mode, 0.007.
    """
    told = {"c1": {"unit": "N s/m", "median": 0.2, "ci90": [0.1, 0.4]}}
    diagnosis = {"remainder": None, "parameters": {"before": {}, "after": told}}
    results = results_from_fit(identification, ReportContext(diagnosis=diagnosis))
    row = results.row("c1")
    assert (row.median, row.ci90, results.centre) == (0.2, (0.1, 0.4), "median")
    assert "Medians" in parameter_words(results) and "--quick" in parameter_words(results)
    undiagnosed = results_from_fit(identification)
    assert undiagnosed.row("c1").median == row.mode and undiagnosed.centre == "mode"
    assert "The mode" in parameter_words(undiagnosed)


def test_mass_widens_stiffness_and_not_lengths(identification: Identification) -> None:
    results = results_from_fit(identification)
    k1, gap = results.row("k1"), results.row("g")
    half = np.hypot(k1.ci90[1] - k1.median, Z90 * 1e-3 * k1.median)
    assert k1.total90[1] - k1.median == pytest.approx(half) and half > 1.3
    assert gap.total90 == pytest.approx(gap.ci90)
    assert k1.ratio[0] == k1.median / 0.503 and np.isnan(gap.ratio[0])


def test_references_of_the_bundled_campaign(identification: Identification) -> None:
    row = results_from_fit(identification).row("k2[1]")
    assert row.references["Table 2"] == 5350.156
    assert row.references["beam theory"] == pytest.approx(5276.3, rel=1e-4)


def test_posterior_in_numbers(posterior: Posterior, identification: Identification) -> None:
    results = results_from_posterior(posterior, identification, backbone=False)
    assert results.kind == "posterior" and results.sampler is not None
    column = posterior.column("k2[3]")
    row = results.row("k2[3]")
    assert (row.ci90[0], row.median, row.ci90[1]) == tuple(np.percentile(column, [5, 50, 95]))
    assert results.draws is not None and results.draws.names[-1] == "k2[3]"
    assert set(results.draws.values[:, -1]) <= set(column)
    assert results.sampler.names == posterior.names
    assert np.array_equal(
        results.sampler.traces[1, :, 0, 1],
        posterior.chains.draws[1, :, 0, 1][: len(results.sampler.trace_steps)],
    )


@pytest.mark.usefixtures("coarse_figures")
def test_folder_of_a_posterior(
    posterior: Posterior, identification: Identification, tmp_path: Path
) -> None:
    base = replace(posterior, seed=4)
    results = write_posterior(posterior, identification, tmp_path, before=base).results
    names = {f.name for f in tmp_path.iterdir()}
    assert names == {"results.nc", "fit.json", POSTERIOR_FILE, REPORT_FILE, "figures"}
    assert load_results(tmp_path).headline == results.headline
    assert told(open_arviz(tmp_path / POSTERIOR_FILE, "before"))["seed"] == 3
    assert results.before is not None and results.before_backbone is not None


@pytest.mark.usefixtures("coarse_figures")
def test_report_again_from_files_alone(tmp_path: Path) -> None:
    write_results(make_results(1, 1, n=200, sampled=False), tmp_path)
    page = (tmp_path / REPORT_FILE).read_text()
    (tmp_path / REPORT_FILE).unlink()
    assert rewrite_report(tmp_path).page == tmp_path / REPORT_FILE
    assert (tmp_path / REPORT_FILE).read_text() == page


def told(data: Any) -> dict[str, Any]:
    """What the attributes of an ArviZ object say of the model."""
    return dict(json.loads(data.attrs["provenance"]))


def test_posterior_for_arviz(posterior: Posterior, identification: Identification) -> None:
    data = posterior.to_arviz()
    drawn = data["posterior"]
    assert list(drawn["k2"].coords["case"].values) == ["1", "3"]
    assert drawn["k2"].attrs["units"] == "N/m"
    assert list(drawn["y0"].coords["recording"].values) == ["case1_a", "case3_b"]
    assert drawn.sizes["chain"] == 2
    likelihood = data["log_likelihood"]["displacement"]
    parts = [str(name).split()[0] for name in likelihood.coords["half_cycle"].values]
    assert list(dict.fromkeys(parts)) == ["case1_a", "case3_b"]
    assert likelihood.sizes["draw"] == drawn.sizes["draw"]
    begins = data["constant_data"]["half_cycle_start"].values
    assert begins[0] == 0.0 and begins.size == len(parts) and begins.max() < 1.2
    assert told(data)["seed"] == 3 and told(data)["converged"]
    # One draw's log likelihood, from its parameters
    density = posterior.fit.density
    theta = posterior.chains.draws[1, 0, 0]
    assert float(drawn["k1"][1, 0]) == theta[posterior.names.index("k1")]
    expected = density.likelihood.per_recording(theta[None])[0]
    whole = [likelihood.values[1, 0][np.array(parts) == n].sum() for n in dict.fromkeys(parts)]
    assert np.allclose(whole, expected, rtol=1e-6)
    predicted = data["posterior_predictive"]["case1_a"].values[0]
    recorded = identification.fit.density.oscillator.campaign.recordings[0].samples
    # Simulated recordings differ from the real one by the noise of both.
    assert np.std(predicted - recorded) == pytest.approx(5e-6 * np.sqrt(2), rel=0.05)
    observed = data["observed_data"]["case1_a"]
    assert np.array_equal(observed.values, recorded)
    assert float(data["constant_data"]["mass"]) == posterior.fit.density.oscillator.campaign.mass
    assert data["prior"]["k2"].dims == drawn["k2"].dims
    assert float(data["prior"]["k1"].std()) > 100 * float(drawn["k1"].std())


def test_half_cycles_may_be_left_out_and_recordings_may_not(posterior: Posterior) -> None:
    arviz, groups = quiet_arviz(), posterior.arviz_groups({})
    found = arviz.loo(as_arviz(groups), pointwise=True)
    assert float(np.max(found.pareto_k)) < 0.7  # what importance weights can bear
    # of a model that is right, the effective number is that of the parameters
    effective = found.p if hasattr(found, "p") else found.p_loo  # ArviZ 1.x, 0.23
    assert 0.6 * len(posterior.names) < effective < 1.4 * len(posterior.names)
    likelihood = groups["log_likelihood"]
    name = likelihood["half_cycle"].str.split("part", " ").isel(part=0)
    apart = groups | {"log_likelihood": likelihood.groupby(name.rename("recording")).sum()}
    assert float(np.max(arviz.loo(as_arviz(apart), pointwise=True).pareto_k)) > 0.7


def test_lab_units_for_arviz(posterior: Posterior) -> None:
    si, lab = posterior.to_arviz(), posterior.to_arviz(lab_units=True)
    for group in ("posterior", "prior"):
        assert lab[group]["g"].attrs["units"] == "mm" and si[group]["g"].attrs["units"] == "m"
        assert np.allclose(lab[group]["g"], 1e3 * si[group]["g"], rtol=1e-12)
    for group in ("observed_data", "posterior_predictive"):
        assert lab[group]["case1_a"].attrs["units"] == "mm"
        assert np.allclose(lab[group]["case1_a"], 1e3 * si[group]["case1_a"], rtol=1e-5)
    assert np.array_equal(
        lab["log_likelihood"]["displacement"], si["log_likelihood"]["displacement"]
    )
    assert quiet_arviz().summary(lab, var_names=["g"], round_to=3)["mean"].iloc[0] != 0.0


def test_a_fit_for_arviz(identification: Identification) -> None:
    data, fit = identification.to_arviz(), identification.fit
    assert "sample_stats" not in data and told(data)["approximation"].startswith("Laplace")
    k1 = data["posterior"]["k1"].values
    at = fit.names.index("k1")
    assert k1.mean() == pytest.approx(fit.mode[at], abs=0.2 * fit.sd[at])
    assert k1.std() == pytest.approx(fit.sd[at], rel=0.1)
    sigma = data["posterior"]["sigma"].values
    assert (sigma > 0).all() and np.array_equal(k1, identification.to_arviz()["posterior"]["k1"])
    seeded, drawn = identification.to_arviz(seed=1), identification.to_arviz(rng=1)
    assert np.array_equal(seeded["posterior"]["k1"], drawn["posterior"]["k1"])
    assert not np.array_equal(k1, seeded["posterior"]["k1"])


def test_backbones_of_a_model_that_fits(posterior: Posterior) -> None:
    summary = backbone_summary(posterior, np.random.default_rng(4))
    assert summary is not None and summary.labels == ("1", "3", "all")
    # Some 100 points a case in bands of 90 %, correlated: five standard errors are about 0.2.
    assert np.all(summary.inside > 0.7)
    assert summary.p_values[-1] > 0.01
    curve = next(c for c in summary.curves if c.recording == "case3_b" and c.branch == "upper")
    recording = posterior.fit.density.oscillator.campaign.recordings[1]
    rest = float(np.median(posterior.column("offset[case3_b]")))
    own = backbone(recording.samples, recording.interval, rest=rest).upper
    index = np.searchsorted(own.times, curve.times)
    assert np.array_equal(own.frequency[index], curve.frequency)
    assert np.array_equal(own.amplitude[index], curve.amplitude)
    assert np.array_equal(own.damping_ratio[index], curve.damping_ratio, equal_nan=True)
    low, middle, high = curve.frequency_band.T
    assert np.all((low <= middle) & (middle <= high))


def test_backbones_of_a_model_that_does_not() -> None:
    found = identify(softening_pendulum(), rng=np.random.default_rng(1), search=False)
    summary = backbone_summary(sample(found.fit, target_ess=200.0), np.random.default_rng(4))
    assert summary is not None and summary.labels == ("all",)
    assert summary.p_values[-1] < 0.01 and summary.inside[-1] < 0.5


def softening_pendulum() -> Campaign:
    """A pendulum swinging to 60 degrees: no linear oscillator."""
    t = np.arange(2000) * 2.5e-3
    motion = solve_ivp(
        lambda _, s: [s[1], -0.6 * s[1] - 110 * np.sin(s[0])], (0, t[-1]), [1.0, 0.0], "DOP853", t,
        rtol=1e-9, atol=1e-9,
    )  # fmt: skip
    noise = 5e-4 * np.random.default_rng(2).standard_normal(t.size)
    recording = Recording("swing", "", motion.y[0] + noise, 2.5e-3, quantity="angle")
    return Campaign("pendulum", 1.0, (recording,), stop=False)


@pytest.mark.usefixtures("coarse_figures")
def test_report_of_a_linear_oscillator_that_does_not_fit(tmp_path: Path) -> None:
    found = identify(softening_pendulum(), rng=np.random.default_rng(1), search=False)
    results = write_results(results_from_fit(found), tmp_path).results
    assert results.verdict == "inadequate"
    page = (tmp_path / REPORT_FILE).read_text()
    body = page.index('class="verdict bad"')
    start = page.index("A linear oscillator does not fit these recordings.")
    assert body < start < page.index('id="parameters"')
    assert results.search is None and 'id="search"' not in page
    assert not (tmp_path / POSTERIOR_FILE).exists()


def test_report_of_an_empty_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no results"):
        rewrite_report(tmp_path)
    assert list(tmp_path.iterdir()) == []
