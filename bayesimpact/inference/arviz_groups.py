"""Draws, likelihoods, predictions and data as ArviZ's groups: xarray Datasets by name.

The only module that knows that ArviZ 0.23 (Python 3.11) has `InferenceData` and ArviZ 1.x (Python
3.12 and newer) xarray's `DataTree`. The Dataset under "" holds the attributes of the whole.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesimpact.inference.fit import Fit
from bayesimpact.inference.half_cycle_likelihood import half_cycle_blocks, log_likelihood
from bayesimpact.inference.sampling.convergence import quiet_arviz
from bayesimpact.model.units import display, reading

Array = NDArray[np.float64]
Variables = dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]]
"""Name -> names of the axes, values, attributes: as xarray takes them."""

SAMPLE_DIMS = ("chain", "draw")
PART = "half_cycle"
PRIOR_DRAWS = 500
_INDEXED = re.compile(r"(?P<base>[^\[\]]+)\[(?P<key>.+)\]")


@dataclass(frozen=True, eq=False)
class ArvizDraws:
    """What a model's groups are made of, beside its fit.

    Attributes
    ----------
    parameters : (chain, draw, d)
    log_posterior : (chain, draw), or None
    predictive : recording -> simulated readings (1, draw, n); {} for none
    attrs : of the whole: whatever JSON can hold
    """

    parameters: Array
    log_posterior: Array | None = None
    predictive: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    attrs: Mapping[str, Any] = field(default_factory=dict)


def by_chain(draws: NDArray[Any]) -> NDArray[Any]:
    """Draws of ensembles as ArviZ chains, (ensembles, steps, walkers, ...) -> (chain, draw, ...).

    One chain per ensemble, for walkers are no independent chains. Its walkers' histories follow one
    another, so that the autocorrelation that ArviZ sees is that of a walker.
    """
    moved = np.moveaxis(draws, 2, 1)
    return moved.reshape(draws.shape[0], -1, *draws.shape[3:])


def arviz_groups(fit: Fit, draws: ArvizDraws, *, lab_units: bool = False) -> dict[str, Any]:
    """Groups posterior, prior, log_likelihood, observed_data, constant_data and those in `draws`.

    The log-likelihood has one value per half cycle and draw, which may be left out one at a time:
    see `half_cycle_likelihood` for why not samples or recordings; constant_data says where each
    begins. Predictive draws are fewer than the others; each recording has its own time axis.
    `lab_units`: mm, mN, ... and not SI.
    """
    oscillator, likelihood = fit.density.oscillator, fit.density.likelihood
    campaign = oscillator.campaign
    recordings = {r.name: r for r in campaign.recordings}
    coords = {"case": list(campaign.cases), "recording": list(recordings)}
    units = [p.unit for p in oscillator.layout.parameters]
    rng = np.random.default_rng(0)
    prior = fit.density.priors.sample(rng, PRIOR_DRAWS)[None]
    groups = {
        "posterior": pack_parameters(fit.names, draws.parameters, units, coords),
        "prior": pack_parameters(fit.names, prior, units, coords),
    }
    if lab_units:
        groups = _in_lab_units(groups)
    shown = {name: reading(r.quantity, r.unit) for name, r in recordings.items()}
    scale = {name: (one.scale if lab_units else 1.0) for name, one in shown.items()}
    told = {n: {"units": shown[n].unit if lab_units else r.unit} for n, r in recordings.items()}
    axes = {name: f"time_{name}" for name in recordings}
    if draws.log_posterior is not None:
        groups["sample_stats"] = {"lp": (SAMPLE_DIMS, draws.log_posterior, {"units": ""})}
    flat = draws.parameters.reshape(-1, draws.parameters.shape[-1])
    blocks = half_cycle_blocks(likelihood, fit.mode)
    values = log_likelihood(likelihood, flat, blocks).astype(np.float32)
    values = values.reshape(*draws.parameters.shape[:2], -1)
    quantity = campaign.recordings[0].quantity
    groups["log_likelihood"] = {quantity: ((*SAMPLE_DIMS, PART), values, {"units": ""})}
    if draws.predictive:
        groups["posterior_predictive"] = {
            name: ((*SAMPLE_DIMS, axes[name]), x * np.float32(scale[name]), told[name])
            for name, x in draws.predictive.items()
        }
    groups["observed_data"] = {
        name: ((axes[name],), np.asarray(r.samples) * scale[name], told[name])
        for name, r in recordings.items()
    }
    intervals = np.array([r.interval for r in recordings.values()])
    groups["constant_data"] = {
        "mass": ((), np.array(campaign.mass), {"units": "kg m2" if campaign.angular else "kg"}),
        "interval": (("recording",), intervals, {"units": "s"}),
        f"{PART}_start": (
            (PART,),
            np.concatenate([b.first * h for b, h in zip(blocks, intervals, strict=True)]),
            {"units": "s"},
        ),
    }
    coords[PART] = [
        f"{n} {k}"
        for n, b in zip(recordings, blocks, strict=True)
        for k in range(1, b.first.size + 1)
    ]
    times = {axes[name]: r.times.tolist() for name, r in recordings.items()}
    model = {
        "campaign": campaign.name,
        "mass": campaign.mass,
        "effects": [effect.id for effect in oscillator.effects],
        "noise": likelihood.noise.kind,
    }
    return datasets(groups, coords | times, model | dict(draws.attrs))


def laplace_draws(
    fit: Fit, rng: np.random.Generator, *, chains: int = 4, draws: int = 250
) -> ArvizDraws:
    """Independent draws of the Laplace approximation, kept inside the parameters' bounds."""
    parameters = fit.density.oscillator.layout.parameters
    drawn = fit.draws(rng, chains * draws).reshape(chains, draws, -1)
    bounds = np.array([(p.lower, p.upper) for p in parameters]).T
    return ArvizDraws(np.clip(drawn, *bounds), attrs={"approximation": "Laplace, at the mode"})


def pack_parameters(
    names: Sequence[str],
    draws: Array,
    units: Sequence[str],
    axes: Mapping[str, Sequence[str]],
) -> Variables:
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
    packed: Variables = {}
    for column, name in enumerate(names):
        match = _INDEXED.fullmatch(name)
        family = families[match["base"]] if match else {}
        fitting = [dim for dim, labels in axes.items() if labels and set(labels) == family.keys()]
        unit = {"units": units[column]}
        if match is None or not fitting or match["base"] in names:
            packed[name] = (SAMPLE_DIMS, draws[..., column], unit)
        elif match["base"] not in packed:
            columns = [family[label] for label in axes[fitting[0]]]
            packed[match["base"]] = ((*SAMPLE_DIMS, fitting[0]), draws[..., columns], unit)
    return packed


def _in_lab_units(groups: Mapping[str, Variables]) -> dict[str, Variables]:
    """The same with each parameter as its posterior's size asks for, alike in all groups."""
    scaled: dict[str, Variables] = {name: {} for name in groups}
    for name, (_, values, attrs) in groups["posterior"].items():
        shown = display(attrs["units"], float(np.max(np.abs(np.median(values, axis=(0, 1))))))
        for group, variables in groups.items():
            dims, found, _ = variables[name]
            scaled[group][name] = (dims, found * shown.scale, {"units": shown.unit})
    return scaled


def datasets(
    groups: Mapping[str, Variables], coords: Mapping[str, Sequence[Any]], attrs: Mapping[str, Any]
) -> dict[str, Any]:
    """One xarray Dataset per group with the coordinates of its axes; the attributes under ""."""
    import xarray

    library = {"inference_library": "emcee", "inference_library_version": version("emcee")}
    made = {"": xarray.Dataset(attrs={"provenance": json.dumps(dict(attrs)), **library})}
    for group, variables in groups.items():
        sizes = {str(dim): n for dim, n in xarray.Dataset(variables).sizes.items()}
        own: dict[str, Any] = {dim: list(coords[dim]) for dim in sizes if dim in coords}
        own |= {dim: np.arange(sizes[dim]) for dim in SAMPLE_DIMS if dim in sizes}
        made[group] = xarray.Dataset(variables, own, library)
    return made


def as_arviz(groups: Mapping[str, Any]) -> Any:
    """Groups as the installed ArviZ likes them: `InferenceData` (0.23) or `DataTree` (1.x)."""
    arviz = quiet_arviz()
    if _has_inference_data(arviz):
        named = {name: dataset for name, dataset in groups.items() if name}
        return arviz.InferenceData(attrs=groups[""].attrs, **named)
    import xarray

    return xarray.DataTree.from_dict({f"/{name}": dataset for name, dataset in groups.items()})


def _has_inference_data(arviz: Any) -> bool:
    return int(arviz.__version__.split(".")[0]) < 1
