"""The files of DIR: `results.nc` for the report, `fit.json` for people and scripts.

NetCDF is put together in memory, for its library ends the process where a disk is full. Nothing is
pickled. (`posterior.nc` is ArviZ's: see `archive_arviz`.)
"""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from bayesimpact.data.files import write_bytes, write_text
from bayesimpact.data.strict_json import strict
from bayesimpact.errors import InputError
from bayesimpact.report.codec import decode, encode
from bayesimpact.report.results import Results, Row

RESULTS_FILE = "results.nc"
FIT_FILE = "fit.json"
FORMAT = "bayesimpact/results/1"
FIT_SCHEMA = "bayesimpact/fit/1"


def save_results(results: Results, folder: Path) -> None:
    """Write `results.nc` and `fit.json` into an existing folder."""
    import h5netcdf
    import h5py  # type: ignore[import-untyped]

    text, arrays = encode(results)
    text = text.encode("utf-8", "replace").decode("utf-8")
    buffer = io.BytesIO()
    with h5netcdf.File(buffer, "w") as file:
        file.attrs["format"] = FORMAT
        file.create_variable("record", (), dtype=h5py.string_dtype("utf-8"))[...] = text
        for name, array in arrays.items():
            dimensions = tuple(f"{name}.{k}" for k in range(array.ndim))
            for dimension, size in zip(dimensions, array.shape, strict=True):
                file.dimensions[dimension] = size
            file.create_variable(name, dimensions, data=array)
    write_bytes(folder / RESULTS_FILE, buffer.getbuffer())
    write_text(folder / FIT_FILE, fit_json(results))


def load_results(folder: Path | str) -> Results:
    """Read what `save_results` wrote.

    Raises
    ------
    InputError : the folder holds no results, or they cannot be read
    """
    import h5py

    path = Path(folder) / RESULTS_FILE
    if not path.is_file():
        accepted = f"a folder that bayesimpact wrote results into ({RESULTS_FILE})"
        raise InputError(str(folder), "no results", accepted)
    try:
        # h5netcdf looks up the dimensions of every variable, which takes longer than all else
        with h5py.File(path, "r") as file:
            found = str(file.attrs.get("format", "no format"))
            if found != FORMAT:
                raise InputError(str(path), f"format {found}", FORMAT)
            text = file["record"][...]
            arrays = {k: np.asarray(v[...]) for k, v in file.items() if not v.is_scale}
        return decode(Results, _text(text), arrays)
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(str(path), f"a file that cannot be read ({error})", FORMAT) from None


def _text(value: Any) -> str:
    value = np.asarray(value, dtype=object).item()
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)


def fit_json(results: Results) -> str:
    """Mode, intervals, covariance, search and checks as JSON; SI units, null where undefined."""
    search = results.search
    content = {
        "schema": FIT_SCHEMA,
        "campaign": results.name,
        "mass": results.mass,
        "verdict": results.verdict,
        "summary": results.headline,
        "source": "curvature at the mode, and what stays unexplained"
        if results.remains
        else ("draws" if results.kind == "posterior" else "curvature at the mode"),
        "parameters": {row.name: _row(row) for row in results.rows},
        "names": [row.name for row in results.rows],
        "covariance": results.covariance,
        "log_posterior": results.log_posterior,
        "reduced_chi2": results.reduced_chi2,
        "reduced_chi2_z": results.chi2_z,
        "rms": results.rms,
        "noise": {"sigma": results.noise.level, "kind": results.noise.kind},
        "recordings": {
            r.name: {
                "case": r.case,
                "rms": r.rms,
                "reduced_chi2": r.reduced_chi2,
                "whiteness_p": r.whiteness_p,
            }
            for r in results.recordings
        },
        "search": None
        if search is None
        else {
            "agrees_with_guess": search.agree,
            "distance_in_sd": search.distance,
            "stopped": search.stopped,
            "evaluations": search.evaluations,
            "best": search.best,
            "median": search.median,
            "spread": search.spread,
            "temperature": search.temperature,
        },
        "checks": [
            {"title": c.title, "status": c.status, "finding": c.finding} for c in results.checks
        ],
        "seed": results.provenance.seed,
        "command": results.provenance.command,
        "date": results.provenance.date,
        "versions": results.provenance.versions,
        "data_sha256": results.provenance.data_sha256,
    }
    return json.dumps(strict(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _row(row: Row) -> dict[str, Any]:
    return {
        "unit": row.unit,
        "role": row.role,
        "mode": row.mode,
        "sd": row.sd,
        "median": row.median,
        "ci90": row.ci90,
        "ci90_with_mass_clock_gain": row.total90,
        "over_mass": row.ratio if row.ratio_unit else None,
        "over_mass_unit": row.ratio_unit or None,
        "references": row.references,
        "prior": row.prior,
    }
