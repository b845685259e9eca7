"""Parquet: through pandas and pyarrow; columns of numbers as channels."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from bayesimpact.data.readers.channel import (
    Channel,
    check_bytes,
    check_values,
    library,
    name_and_unit,
    split,
)


def read(path: Path, content: bytes) -> list[Channel]:
    """Every column of numbers, the index included where it has a name."""
    pandas = library("pandas", "pandas", path)
    parquet = library("pyarrow.parquet", "pyarrow", path)
    about = parquet.ParquetFile(BytesIO(content)).metadata
    check_values(about.num_rows * about.num_columns, path)
    groups = (about.row_group(i).total_byte_size for i in range(about.num_row_groups))
    check_bytes(sum(groups), path)
    frame = pandas.read_parquet(BytesIO(content), engine="pyarrow")
    if frame.index.name is not None:
        frame = frame.reset_index()
    found: list[Channel] = []
    for column in frame.columns:
        series = frame[column]
        if series.dtype.kind in "fiu":
            name, unit = name_and_unit(str(column))
            values = series.to_numpy(dtype="float64", na_value=float("nan"))
            found += split(name, values, unit=unit)
    return found
