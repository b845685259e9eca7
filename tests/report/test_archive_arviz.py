"""posterior.nc goes to disk and back, and whichever ArviZ is installed reads it."""

from __future__ import annotations

import numpy as np
import pytest

import bayesimpact.data.files as files
from bayesimpact.errors import InputError
from bayesimpact.inference.convergence import quiet_arviz
from bayesimpact.report.archive_arviz import (
    Inference,
    Variable,
    by_chain,
    open_arviz,
    pack_parameters,
    read_posterior,
    unpack_parameters,
    write_posterior,
)

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


def draws(seed=0):
    return np.random.default_rng(seed).standard_normal((2, 50, len(NAMES)))


def inference(seed=0):
    rng = np.random.default_rng(seed + 1)
    posterior = pack_parameters(NAMES, draws(seed), UNITS, AXES)
    groups = {
        "posterior": posterior,
        "log_likelihood": {
            "displacement": Variable(rng.standard_normal((2, 50, 4)), ("recording",))
        },
        "posterior_predictive": {
            "case1_a": Variable(rng.standard_normal((2, 5, 30)), ("time case1_a",), "m")
        },
        "observed_data": {"case1_a": Variable(rng.standard_normal(30), ("time case1_a",), "m")},
        "sample_stats": {
            "lp": Variable(rng.standard_normal((2, 50))),
            "kept": Variable(rng.random((2, 50)) > 0.5),
        },
        "constant_data": {"mass": Variable(np.array(0.503), (), "kg")},
    }
    coords = {**AXES, "time case1_a": np.arange(30) * 1e-3}
    attrs = {
        "seed": 3,
        "versions": {"emcee": "3.1.6"},
        "converged": True,
        "data_sha256": "ab" * 32,
        "nothing": None,
        "reasons": ["a", "ö"],
    }
    return Inference(groups, coords, attrs)


def assert_same(first, second):
    assert first.groups.keys() == second.groups.keys()
    for group, variables in first.groups.items():
        assert variables.keys() == second.groups[group].keys()
        for name, variable in variables.items():
            other = second.groups[group][name]
            np.testing.assert_array_equal(variable.values, other.values)
            assert variable.values.dtype == other.values.dtype
            assert (variable.dims, variable.unit) == (other.dims, other.unit)
    assert first.attrs == second.attrs
    assert {dim: list(labels) for dim, labels in first.coords.items()} == second.coords


def test_there_and_back(tmp_path):
    after, before = inference(), inference(7)
    write_posterior(tmp_path / "posterior.nc", after, before)
    assert_same(after, read_posterior(tmp_path / "posterior.nc"))
    assert_same(before, read_posterior(tmp_path / "posterior.nc", "before"))
    assert [path.name for path in tmp_path.iterdir()] == ["posterior.nc"]


def test_parameters_come_back_in_their_order(tmp_path):
    write_posterior(tmp_path / "posterior.nc", inference())
    read = read_posterior(tmp_path / "posterior.nc")
    columns = unpack_parameters(read.groups["posterior"], NAMES, read.coords)
    np.testing.assert_array_equal(columns, draws())


def test_indexed_parameters_stand_along_their_dimension():
    packed = pack_parameters(NAMES, draws(), UNITS, AXES)
    assert list(packed) == ["c1", "k2", "y0", "sigma[case1_a]", "coulomb_friction.force"]
    assert packed["k2"].dims == ("case",)
    assert packed["k2"].unit == "N/m"
    np.testing.assert_array_equal(packed["k2"].values, draws()[..., [2, 3, 1]])
    assert packed["y0"].dims == ("recording",)
    assert packed["sigma[case1_a]"].dims == ()


def test_a_family_beside_a_shared_parameter_of_that_name_stays_apart():
    names = ("g", "g[1]", "g[2]", "g[ü]")
    packed = pack_parameters(names, draws()[..., :4], ["m"] * 4, AXES)
    assert list(packed) == list(names)
    np.testing.assert_array_equal(unpack_parameters(packed, names, {}), draws()[..., :4])


def test_a_missing_parameter_is_named():
    packed = pack_parameters(NAMES, draws(), UNITS, AXES)
    with pytest.raises(InputError, match="no parameter k7"):
        unpack_parameters(packed, ("k7",), AXES)


@pytest.mark.parametrize("section", ["", "before"])
def test_the_installed_arviz_reads_it(section, tmp_path):
    after, before = inference(), inference(7)
    write_posterior(tmp_path / "posterior.nc", after, before)
    data = open_arviz(tmp_path / "posterior.nc", section)
    truth = {"": after, "before": before}[section].groups
    arviz = quiet_arviz()
    summary = arviz.summary(data, var_names=["k2", "c1"], round_to="none")
    assert list(summary.index) == ["k2[1]", "k2[2]", "k2[ü]", "c1"]
    means = summary["mean"].to_numpy(dtype=float)
    np.testing.assert_allclose(means[:3], truth["posterior"]["k2"].values.mean(axis=(0, 1)))
    posterior = data["posterior"]
    assert posterior["k2"].dims == ("chain", "draw", "case")
    assert posterior["k2"].attrs["units"] == "N/m"
    assert posterior["y0"].coords["recording"].values.tolist() == list(RECORDINGS)
    likelihood = data["log_likelihood"]["displacement"]
    np.testing.assert_array_equal(likelihood.values, truth["log_likelihood"]["displacement"].values)
    groups = data.children if hasattr(data, "children") else data.groups()
    assert set(groups) - {"before"} == set(truth)


def test_chains_are_ensembles_with_walkers_end_to_end():
    values = np.arange(2 * 3 * 4 * 5).reshape(2, 3, 4, 5)
    chains = by_chain(values)
    assert chains.shape == (2, 12, 5)
    np.testing.assert_array_equal(chains[1, :3], values[1, :, 0])
    np.testing.assert_array_equal(chains[1, 3:6], values[1, :, 1])
    assert by_chain(values[..., 0]).shape == (2, 12)


def test_an_interrupted_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "posterior.nc"
    write_posterior(path, inference())

    def interrupted(source, destination):
        raise KeyboardInterrupt

    monkeypatch.setattr(files.os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_posterior(path, inference(5))
    monkeypatch.undo()
    assert_same(inference(), read_posterior(path))
    assert [entry.name for entry in tmp_path.iterdir()] == ["posterior.nc"]


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ({"postrior": {}}, "postrior"),
        ({"posterior": {"k2": Variable(np.zeros((2, 5, 3)))}}, "3 axes"),
        ({"observed_data": {"y": Variable(np.zeros(3), ("recording", "time"))}}, "1 axes"),
    ],
)
def test_bad_groups_are_refused(groups, words, tmp_path):
    with pytest.raises(InputError, match=words):
        write_posterior(tmp_path / "posterior.nc", Inference(groups))
    assert not list(tmp_path.iterdir())


def test_a_missing_section_or_file_is_named(tmp_path):
    path = tmp_path / "posterior.nc"
    with pytest.raises(InputError, match=r"posterior\.nc"):
        read_posterior(path)
    write_posterior(path, inference())
    with pytest.raises(InputError, match="before"):
        read_posterior(path, "before")
    path.write_text("no NetCDF")
    with pytest.raises(InputError, match="no readable section"):
        read_posterior(path)
