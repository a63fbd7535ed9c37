"""Tables of numbers in the formats of other programs: CSV, Parquet, MAT, NPZ."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError

Columns = dict[str, NDArray[np.float64]]

READABLE = (".csv", ".parquet", ".mat", ".npz")
WRITABLE = (".csv", ".parquet", ".mat")
MAT_NAME = 63  # characters that MATLAB allows


def read(path: Path) -> Columns:
    """Numeric columns by name; raises InputError where the file cannot be read or holds none."""
    readers = {".csv": _read_csv, ".parquet": _read_parquet, ".mat": _read_mat, ".npz": _read_npz}
    suffix = path.suffix.lower()
    if suffix not in readers:
        raise InputError(f"Cannot tell the format of {path}: give a file that ends in {', '.join(READABLE)}.")
    if not path.is_file():
        raise InputError(f"There is no file {path}.")
    try:
        columns = readers[suffix](path)
    except Exception as error:  # each library has its own exceptions for a damaged file
        raise InputError(f"Cannot read {path}: {str(error).splitlines()[0]}.") from error
    if not columns:
        raise InputError(f"{path} holds no numeric column.")
    return columns


def _read_csv(path: Path) -> Columns:
    from pyarrow.csv import read_csv

    return _numeric(read_csv(path))


def _read_parquet(path: Path) -> Columns:
    from pyarrow import parquet

    return _numeric(parquet.read_table(path))


def _numeric(table: Any) -> Columns:
    import pyarrow as pa

    columns = {}
    for name in table.column_names:
        kind = table.schema.field(name).type
        if pa.types.is_integer(kind) or pa.types.is_floating(kind):
            columns[name.strip()] = np.array(table[name].to_numpy(), dtype=np.float64)
    return columns


def _read_mat(path: Path) -> Columns:
    from scipy.io import loadmat

    items = loadmat(path, squeeze_me=True)
    return {
        name: np.asarray(value, dtype=np.float64)
        for name, value in items.items()
        if not name.startswith("__")
        and isinstance(value, np.ndarray)
        and value.ndim == 1
        and value.dtype.kind in "iuf"
    }


def _read_npz(path: Path) -> Columns:
    with np.load(path) as archive:
        return {name: archive[name].astype(np.float64) for name in archive.files if archive[name].ndim == 1}


def write(
    path: Path, columns: dict[str, NDArray[Any]], units: dict[str, str] | None = None, **more: Any
) -> None:
    """Write columns of equal length; raises InputError where the format is unknown or does not take them.

    Parquet has the `units` of columns in the metadata of its fields, MAT in a struct `units`. MAT has `more` variables.
    """
    suffix = format_of(path)
    if suffix == ".mat":
        _write_mat(path, columns, {"units": units or {}, **more})
    elif suffix == ".parquet":
        _write_parquet(path, columns, units or {})
    else:
        _write_csv(path, columns)


def format_of(path: Path) -> str:
    """The ending of a file that can be written; raises InputError for any other."""
    suffix = path.suffix.lower()
    if suffix not in WRITABLE:
        raise InputError(f"Cannot write {path}: give a file that ends in {', '.join(WRITABLE)}.")
    return suffix


def _write_mat(path: Path, columns: dict[str, NDArray[Any]], more: dict[str, Any]) -> None:
    from scipy.io import savemat

    long = [name for name in columns if len(name) > MAT_NAME]
    if long:
        raise InputError(
            f"Cannot write a .mat file: MATLAB has no name as long as '{long[0]}' ({len(long[0])} characters, at most "
            f"{MAT_NAME}); write .parquet or .csv."
        )
    savemat(
        path,
        columns | {name: value for name, value in more.items() if len(value)},
        True,
        long_field_names=True,
        oned_as="column",
    )


def _write_csv(path: Path, columns: dict[str, NDArray[Any]]) -> None:
    # pyarrow would write 4.0 as 4, of which others make a whole number
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def _write_parquet(path: Path, columns: dict[str, NDArray[Any]], units: dict[str, str]) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.table(columns)
    fields = [
        field.with_metadata({"unit": units[field.name]}) if field.name in units else field
        for field in table.schema
    ]
    parquet.write_table(table.cast(pa.schema(fields)), path)
