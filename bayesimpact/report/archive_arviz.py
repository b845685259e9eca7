"""`posterior.nc`: the groups of `inference.arviz_groups` in the layout that ArviZ reads.

One NetCDF group per ArviZ group. Those of the model before missing physics was added stand below
the group `before`.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bayesimpact.data.files import write_bytes

BEFORE = "before"


def write_posterior(
    path: Path, after: Mapping[str, Any], before: Mapping[str, Any] | None = None
) -> None:
    """Writes the file in one go: it is either the new one or the old one.

    Parameters
    ----------
    path : of the NetCDF file, in an existing folder
    after : Datasets by group of the model that is reported
    before : the same of the base model, when `after` has effects added to it
    """
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    sections = {"": after} if before is None else {"": after, BEFORE: before}
    buffer = io.BytesIO()  # on a full disk HDF5 ends the process
    with h5netcdf.File(buffer, "w") as file:
        for section, groups in sections.items():
            for group, dataset in groups.items():
                where = "/".join(part for part in (section, group) if part)
                place = file.create_group(where) if where else file
                dataset.dump_to_store(H5NetCDFStore(place))
    write_bytes(Path(path), buffer.getbuffer())
