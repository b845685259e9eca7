"""posterior.nc goes to disk and back, and whichever ArviZ is installed reads it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bayesimpact.data.files as files
from bayesimpact.inference.arviz_groups import (
    SAMPLE_DIMS,
    by_chain,
    datasets,
    pack_parameters,
)
from bayesimpact.inference.sampling.convergence import quiet_arviz
from bayesimpact.report.archive_arviz import write_posterior

CASES = ("1", "2", "ü")
RECORDINGS = ("case1_a", "case1_b", "case2_a", "3 x")
NAMES = (
    "c1",
    "k2[ü]",  # in another order than the cases
    "k2[1]",
    "k2[2]",
    *(f"y0[{name}]" for name in RECORDINGS),
    "sigma[case1_a]",  # not for every recording: stays as it is
    "coulomb_friction.force",
)
UNITS = ("N s/m", *["N/m"] * 3, *["m"] * 4, "m", "N")
AXES = {"case": CASES, "recording": RECORDINGS}


def open_arviz(path: Path, section: str = "") -> Any:
    """`posterior.nc` by the installed ArviZ; `section` "before": without missing physics."""
    arviz = quiet_arviz()
    if int(arviz.__version__.split(".")[0]) < 1:
        return arviz.InferenceData.from_netcdf(
            str(path), engine="h5netcdf", base_group="/" + section
        )
    return arviz.from_netcdf(path, engine="h5netcdf", group=section or None).load()


def draws(seed=0):
    return np.random.default_rng(seed).standard_normal((2, 50, len(NAMES)))


def groups(seed=0):
    rng = np.random.default_rng(seed + 1)
    time = ("time case1_a",)
    variables = {
        "posterior": pack_parameters(NAMES, draws(seed), UNITS, AXES),
        "log_likelihood": {
            "displacement": ((*SAMPLE_DIMS, "recording"), rng.standard_normal((2, 50, 4)), {})
        },
        "posterior_predictive": {
            "case1_a": ((*SAMPLE_DIMS, *time), rng.standard_normal((2, 5, 30)), {"units": "m"})
        },
        "observed_data": {"case1_a": (time, rng.standard_normal(30), {"units": "m"})},
        "sample_stats": {
            "lp": (SAMPLE_DIMS, rng.standard_normal((2, 50)), {}),
            "kept": (SAMPLE_DIMS, rng.random((2, 50)) > 0.5, {}),
        },
        "constant_data": {"mass": ((), np.array(0.503), {"units": "kg"})},
    }
    coords = {**AXES, "time case1_a": np.arange(30) * 1e-3}
    return datasets(variables, coords, {"seed": seed, "nothing": None, "reasons": ["a", "ö"]})


def assert_same(made, path, section=""):
    read = open_arviz(path, section)
    for name, dataset in made.items():
        if name:
            for variable, array in dataset.data_vars.items():
                other = read[name][variable]
                np.testing.assert_array_equal(array.values, other.values)
                assert array.dims == other.dims and array.values.dtype == other.values.dtype
                assert array.attrs == other.attrs
    assert read.attrs["provenance"] == made[""].attrs["provenance"]


def test_there_and_back(tmp_path):
    after, before = groups(), groups(7)
    write_posterior(tmp_path / "posterior.nc", after, before)
    assert_same(after, tmp_path / "posterior.nc")
    assert_same(before, tmp_path / "posterior.nc", "before")
    assert [path.name for path in tmp_path.iterdir()] == ["posterior.nc"]


def test_indexed_parameters_stand_along_their_dimension():
    packed = pack_parameters(NAMES, draws(), UNITS, AXES)
    assert list(packed) == ["c1", "k2", "y0", "sigma[case1_a]", "coulomb_friction.force"]
    dims, values, attrs = packed["k2"]
    assert dims == (*SAMPLE_DIMS, "case") and attrs == {"units": "N/m"}
    np.testing.assert_array_equal(values, draws()[..., [2, 3, 1]])
    assert packed["y0"][0] == (*SAMPLE_DIMS, "recording")
    assert packed["sigma[case1_a]"][0] == SAMPLE_DIMS


def test_a_family_beside_a_shared_parameter_of_that_name_stays_apart():
    names = ("g", "g[1]", "g[2]", "g[ü]")
    packed = pack_parameters(names, draws()[..., :4], ["m"] * 4, AXES)
    assert list(packed) == list(names)
    for column, name in enumerate(names):
        np.testing.assert_array_equal(packed[name][1], draws()[..., column])


@pytest.mark.parametrize("section", ["", "before"])
def test_the_installed_arviz_reads_it(section, tmp_path):
    after, before = groups(), groups(7)
    write_posterior(tmp_path / "posterior.nc", after, before)
    data = open_arviz(tmp_path / "posterior.nc", section)
    truth = {"": after, "before": before}[section]
    arviz = quiet_arviz()
    summary = arviz.summary(data, var_names=["k2", "c1"], round_to="none")
    assert list(summary.index) == ["k2[1]", "k2[2]", "k2[ü]", "c1"]
    means = summary["mean"].to_numpy(dtype=float)
    np.testing.assert_allclose(means[:3], truth["posterior"]["k2"].values.mean(axis=(0, 1)))
    assert data["posterior"]["y0"].coords["recording"].values.tolist() == list(RECORDINGS)
    found = data.children if hasattr(data, "children") else data.groups()
    assert set(found) - {"before"} == set(truth) - {""}


def test_chains_are_ensembles_with_walkers_end_to_end():
    values = np.arange(2 * 3 * 4 * 5).reshape(2, 3, 4, 5)
    chains = by_chain(values)
    assert chains.shape == (2, 12, 5)
    np.testing.assert_array_equal(chains[1, :3], values[1, :, 0])
    np.testing.assert_array_equal(chains[1, 3:6], values[1, :, 1])
    assert by_chain(values[..., 0]).shape == (2, 12)


def test_an_interrupted_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "posterior.nc"
    write_posterior(path, groups())

    def interrupted(source, destination):
        raise KeyboardInterrupt

    monkeypatch.setattr(files.os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_posterior(path, groups(5))
    monkeypatch.undo()
    assert_same(groups(), path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["posterior.nc"]
