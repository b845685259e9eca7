"""`posterior.nc`: draws, likelihoods and predictions as ArviZ reads them, and back as plain arrays.

The only module that knows that ArviZ 0.23 (Python 3.11) has `InferenceData` and ArviZ 1.x (Python
3.12 and newer) xarray's `DataTree`. The file follows the layout both read with `from_netcdf`: one
NetCDF group per ArviZ group, dimensions (chain, draw, ...). The same groups of the model before
missing physics was added stand below the group `before`.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.data.files import write_bytes
from bayesimpact.errors import InputError
from bayesimpact.inference.convergence import quiet_arviz

DRAW_GROUPS = ("posterior", "log_likelihood", "posterior_predictive", "sample_stats")
DATA_GROUPS = ("observed_data", "constant_data")
BEFORE = "before"
_SAMPLE_DIMS = ("chain", "draw")
_ENGINE = "h5netcdf"
_INDEXED = re.compile(r"(?P<base>[^\[\]]+)\[(?P<key>.+)\]")


@dataclass(frozen=True, eq=False)
class Variable:
    """One array with the names of its axes.

    Attributes
    ----------
    values : in a group of draws the first two axes are chain and draw
    dims : names of the axes, without chain and draw
    unit : SI; "" for none
    """

    values: NDArray[Any]
    dims: tuple[str, ...] = ()
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Inference:
    """The groups of one model.

    Attributes
    ----------
    groups : group (of `DRAW_GROUPS` or `DATA_GROUPS`) -> variable name -> variable
    coords : labels along a dimension, by its name (case, recording, ...)
    attrs : whatever JSON can hold: seed, versions, hash of the data, model, ...
    """

    groups: Mapping[str, Mapping[str, Variable]]
    coords: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    attrs: Mapping[str, Any] = field(default_factory=dict)


def by_chain(draws: NDArray[Any]) -> NDArray[Any]:
    """Draws of ensembles as ArviZ chains, (ensembles, steps, walkers, ...) -> (chain, draw, ...).

    One chain per ensemble, for walkers are no independent chains. Its walkers' histories follow one
    another, so that the autocorrelation that ArviZ sees is that of a walker.
    """
    moved = np.moveaxis(draws, 2, 1)
    return moved.reshape(draws.shape[0], -1, *draws.shape[3:])


def pack_parameters(
    names: Sequence[str],
    draws: NDArray[np.float64],
    units: Sequence[str],
    axes: Mapping[str, Sequence[str]],
) -> dict[str, Variable]:
    """Columns as variables: `k2[1]`, `k2[2]`, ... become `k2` along the dimension case.

    Parameters
    ----------
    names, units : d parameters
    draws : (chain, draw, d)
    axes : labels by dimension, {"case": ..., "recording": ...}; a parameter is put along the first
        dimension whose labels are exactly its indices. One that fits no dimension keeps its name.
    """
    families: dict[str, dict[str, int]] = {}
    for column, name in enumerate(names):
        match = _INDEXED.fullmatch(name)
        if match:
            families.setdefault(match["base"], {})[match["key"]] = column
    packed: dict[str, Variable] = {}
    for column, name in enumerate(names):
        match = _INDEXED.fullmatch(name)
        family = families[match["base"]] if match else {}
        fitting = [dim for dim, labels in axes.items() if labels and set(labels) == family.keys()]
        if match is None or not fitting or match["base"] in names:
            packed[name] = Variable(draws[..., column], (), units[column])
        elif match["base"] not in packed:
            columns = [family[label] for label in axes[fitting[0]]]
            packed[match["base"]] = Variable(draws[..., columns], (fitting[0],), units[column])
    return packed


def unpack_parameters(
    variables: Mapping[str, Variable], names: Sequence[str], coords: Mapping[str, Sequence[str]]
) -> NDArray[np.float64]:
    """The columns (chain, draw, d) of the given names, as `pack_parameters` was handed them.

    Raises
    ------
    InputError : a parameter is not among the variables
    """
    columns = []
    for name in names:
        match = _INDEXED.fullmatch(name)
        if name in variables:
            columns.append(variables[name].values)
        elif match and match["base"] in variables:
            variable = variables[match["base"]]
            labels = list(coords[variable.dims[0]])
            columns.append(variable.values[..., labels.index(match["key"])])
        else:
            raise InputError("posterior", f"no parameter {name}", f"one of {sorted(variables)}")
    return np.stack(columns, axis=-1)


def write_posterior(path: Path, after: Inference, before: Inference | None = None) -> None:
    """Writes the file in one go: it is either the new one or the old one.

    Parameters
    ----------
    path : of the NetCDF file, in an existing folder
    after : the model that is reported
    before : the base model, when `after` has effects added to it

    Raises
    ------
    InputError : a group of another name, or an array whose axes are not all named
    """
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    sections = {"": after} if before is None else {"": after, BEFORE: before}
    buffer = io.BytesIO()  # on a full disk HDF5 ends the process
    with h5netcdf.File(buffer, "w") as file:
        for section, inference in sections.items():
            for group, dataset in _datasets(inference).items():
                where = "/".join(part for part in (section, group) if part)
                place = file.create_group(where) if where else file
                dataset.dump_to_store(H5NetCDFStore(place))
    write_bytes(Path(path), buffer.getbuffer())


def read_posterior(path: Path, section: str = "") -> Inference:
    """Reads what `write_posterior` wrote, as plain arrays.

    Parameters
    ----------
    path : of the file
    section : "" for the reported model, "before" for the base model

    Raises
    ------
    InputError : no such file or section, or not such a file
    """
    import xarray

    groups: dict[str, dict[str, Variable]] = {}
    coords: dict[str, Sequence[Any]] = {}
    try:
        with xarray.open_dataset(path, group=section or None, engine=_ENGINE) as root:
            attrs = json.loads(root.attrs["provenance"])
            names = json.loads(root.attrs["groups"])
        for group in names:
            where = f"{section}/{group}".lstrip("/")
            with xarray.open_dataset(path, group=where, engine=_ENGINE) as dataset:
                groups[group] = {
                    str(name): Variable(
                        array.values,
                        tuple(str(dim) for dim in array.dims if dim not in _SAMPLE_DIMS),
                        str(array.attrs.get("units", "")),
                    )
                    for name, array in dataset.data_vars.items()
                }
                for dim, labels in dataset.coords.items():
                    if dim not in _SAMPLE_DIMS:
                        coords[str(dim)] = labels.values.tolist()
    except (OSError, KeyError, ValueError) as error:
        raise InputError(
            str(path), f"no readable section {section!r} ({error})", "a posterior.nc"
        ) from error
    return Inference(groups, coords, attrs)


def open_arviz(path: Path, section: str = "") -> Any:
    """The file as the installed ArviZ likes it: `InferenceData` (0.23) or `DataTree` (1.x)."""
    arviz = quiet_arviz()
    if int(arviz.__version__.split(".")[0]) < 1:
        return arviz.InferenceData.from_netcdf(str(path), engine=_ENGINE, base_group="/" + section)
    return arviz.from_netcdf(path, engine=_ENGINE, group=section or None).load()


def _datasets(inference: Inference) -> dict[str, Any]:
    """One xarray Dataset per group, and one with the attributes under ""."""
    import xarray

    datasets: dict[str, Any] = {}
    for group, variables in inference.groups.items():
        if group not in DRAW_GROUPS + DATA_GROUPS:
            raise InputError("group", group, ", ".join(DRAW_GROUPS + DATA_GROUPS))
        leading = _SAMPLE_DIMS if group in DRAW_GROUPS else ()
        arrays: dict[str, Any] = {}
        sizes: dict[str, int] = {}
        for name, variable in variables.items():
            dims = (*leading, *variable.dims)
            if variable.values.ndim != len(dims):
                raise InputError(
                    f"{group}.{name}",
                    f"{variable.values.ndim} axes",
                    f"{len(dims)} axes ({', '.join(dims)})",
                )
            arrays[name] = (dims, variable.values, {"units": variable.unit})
            sizes.update(zip(dims, variable.values.shape, strict=True))
        coords: dict[str, Any] = {
            dim: list(inference.coords[dim]) for dim in sizes if dim in inference.coords
        }
        coords |= {dim: np.arange(sizes[dim]) for dim in leading if dim in sizes}
        datasets[group] = xarray.Dataset(arrays, coords, _library())
    attrs = {
        "provenance": json.dumps(dict(inference.attrs)),
        "groups": json.dumps(list(datasets)),
        **_library(),
    }
    return {"": xarray.Dataset(attrs=attrs), **datasets}


def _library() -> dict[str, str]:
    return {"inference_library": "emcee", "inference_library_version": version("emcee")}
