"""Tables of numbers in the formats of other programs: CSV, Parquet, MAT, NPZ."""

from __future__ import annotations

import csv
import io
import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from report.text.text_form import SPACES, UNSTATED, StatedForm, TextForm, is_number, recognised, split

Columns = dict[str, NDArray[np.float64]]

READABLE = (".csv", ".txt", ".tsv", ".parquet", ".mat", ".npz")
WRITABLE = (".csv", ".parquet", ".mat")
MAT_NAME = 63  # characters that MATLAB allows


class DataTable(NamedTuple):
    """The columns of a file."""

    columns: Columns
    units: dict[str, str]  # of the columns that have a unit in a row below the names
    form: TextForm | None = None  # of a text file


def read(path: Path) -> Columns:
    """Numeric columns by name; raises InputError where the file cannot be read or holds none."""
    return read_table(path).columns


def read_table(path: Path, form: StatedForm = UNSTATED) -> DataTable:
    """Numeric columns by name, with units where a text file has a row of them below the names.

    What the `form` of a text file leaves open is recognised.

    Raises:
        InputError: the file cannot be read, holds no numbers, or is no text file although `form` is that of one.
    """
    readers = {".parquet": _read_parquet, ".mat": _read_mat, ".npz": _read_npz}
    suffix = path.suffix.lower()
    if suffix not in READABLE:
        raise InputError(f"The format of {path} is unknown: give a file that ends in {', '.join(READABLE)}.")
    if not path.is_file():
        raise InputError(f"There is no file {path}.")
    if suffix in readers and form._replace(columns=()) != UNSTATED:
        raise InputError(f"{path} is no text: leave out separator, decimal and skip_rows.")
    hint = "" if suffix in readers else "; a map can give its separator, decimal sign and rows to skip"
    try:
        found = DataTable(readers[suffix](path), {}) if suffix in readers else _read_text(path, form)
    except Exception as error:  # each library has its own exceptions for a damaged file
        raise InputError(f"Cannot read {path}: {str(error).splitlines()[0].rstrip('.')}{hint}.") from error
    if not found.columns:
        raise InputError(f"{path} holds no numeric column{hint}.")
    return found


def _read_text(path: Path, stated: StatedForm) -> DataTable:
    """A text file in UTF-8, or in Latin-1 as older loggers write it."""
    from pyarrow import csv as arrow

    encoding = _encoding(path)
    form = recognised(path, encoding, stated)
    units = _units(path, form, encoding)
    table = arrow.read_csv(
        _single_spaced(path, encoding) if form.separator == SPACES else path,
        arrow.ReadOptions(
            skip_rows=form.skip_rows, skip_rows_after_names=1 if units else 0, encoding=encoding
        ),
        arrow.ParseOptions(delimiter=form.separator),
        arrow.ConvertOptions(decimal_point=form.decimal),
    )
    columns = _numeric(table)
    return DataTable(columns, {name: unit for name, unit in units.items() if name in columns and unit}, form)


def _single_spaced(path: Path, encoding: str) -> io.BytesIO:
    """The text with one space between columns and none at either end of a line."""
    with path.open(encoding=encoding) as stream:
        return io.BytesIO("\n".join(SPACES.join(line.split()) for line in stream).encode(encoding))


def _encoding(path: Path) -> str:
    try:
        with path.open(encoding="utf-8") as stream:
            while stream.read(1 << 20):
                pass
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _units(path: Path, form: TextForm, encoding: str) -> dict[str, str]:
    """The row below the names where it holds texts and no number, by name: a row of units; empty where it is data."""
    with path.open(encoding=f"{encoding}-sig" if encoding == "utf-8" else encoding, newline="") as stream:
        lines = list(itertools.islice(stream, form.skip_rows, form.skip_rows + 2))
    rows = split(lines, form.separator)
    if len(rows) < 2 or not any(cell.strip() for cell in rows[1]):
        return {}
    if any(is_number(cell, form.decimal) for cell in rows[1]):
        return {}
    return {name.strip(): unit.strip().strip("[]()") for name, unit in zip(*rows, strict=False)}


def _read_parquet(path: Path) -> Columns:
    from pyarrow import parquet

    return _numeric(parquet.read_table(path))


def _numeric(table: Any) -> Columns:
    import pyarrow as pa

    columns: Columns = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        numeric = pa.types.is_integer(column.type) or pa.types.is_floating(column.type)
        if numeric and name.strip():  # a column without a name cannot be asked for
            columns[name.strip()] = np.array(column.to_numpy(), dtype=np.float64)
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
    # Not by pyarrow, which writes 4.0 as 4, so that other programs read an integer.
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
