"""Tables of numbers in the formats of other programs: CSV, Parquet, MAT, NPZ."""

from __future__ import annotations

import codecs
import csv
import io
import itertools
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.plan.units import is_unit
from report.text.cells import Notation, numbers, times
from report.text.decimals import fixed_decimals
from report.text.file_kind import is_text, unreadable
from report.text.lines import LABVIEW, lines_of
from report.text.misread import misread
from report.text.text_form import (
    SPACES,
    UNSTATED,
    Rows,
    StatedForm,
    TextForm,
    is_number,
    recognised,
    split,
    unmarked,
    words,
)

Columns = dict[str, NDArray[np.float64]]

TEXTS = (".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm")
READABLE = (*TEXTS, ".parquet", ".mat", ".npz")
WRITABLE = (".csv", ".parquet", ".mat")
SEEN = 2000  # rows of a text, by which its decimals are counted
WIDE = "utf-16"  # the encoding in which some loggers for Windows write
MAT_NAME = 63  # characters that MATLAB allows
WHOLE, LARGEST = 1 << 20, (1 << 31) - 1  # bytes more than a file, and at most, that are read as one block
BRACKETS = re.compile(r"[\[(]([^\[\]()]+)[\])]\s*$")


class Indexed(NamedTuple):
    """How a program takes a column or a row out of a matrix: a form for its name and number, and the first number."""

    column: str
    row: str
    first: int


MATLAB, NUMPY = Indexed("{}(:,{})", "{}({},:)", 1), Indexed("{}[:,{}]", "{}[{},:]", 0)


class DataTable(NamedTuple):
    """The columns of a file."""

    columns: Columns
    units: dict[
        str, str
    ]  # of the columns that have one in a row below the names, or in brackets in their name
    form: TextForm | None = None  # of a text file
    twice: frozenset[str] = frozenset()  # names of more than one column
    texts: Mapping[str, str] = MappingProxyType({})  # by name of a column of texts, one of these
    decimals: Mapping[str, int] = MappingProxyType(
        {}
    )  # of the columns of a text that all numbers have as many of


def read(path: Path) -> Columns:
    """Numeric columns by name; raises InputError where the file cannot be read or holds none."""
    return read_table(path).columns


def read_table(path: Path, form: StatedForm = UNSTATED) -> DataTable:
    """Numeric columns by name, with units where a text file has a row of them below the names, or in these.

    What the `form` of a text file leaves open is recognised.

    Raises:
        InputError: the file cannot be read, holds no numbers, or is no text file although `form` is that of one.
    """
    readers = {".parquet": _read_parquet, ".mat": _read_mat, ".npz": _read_npz}
    suffix = path.suffix.lower()
    check_kind(path, suffix)
    if suffix in readers and form._replace(columns=()) != UNSTATED:
        raise InputError(f"{path} is no text: leave out separator, decimal, thousands and skip_rows.")
    hint = "" if suffix in readers else "; a map can give its separator, decimal sign and rows to skip"
    try:
        found = DataTable(readers[suffix](path), {}) if suffix in readers else _read_text(path, form)
    except InputError:
        raise
    except Exception as error:  # each library has its own exceptions for a damaged file
        raise InputError(f"Cannot read {path}: {str(error).splitlines()[0].rstrip('.')}{hint}.") from error
    if not found.columns:
        raise InputError(f"{path} holds no numeric column{hint}.")
    return found


def check_kind(path: Path, suffix: str) -> None:
    """Raise InputError for a file that cannot be read, of whatever name, and for one whose name does not fit it."""
    if not path.is_file():
        raise InputError(f"There is no file {path}.")
    if kind := unreadable(path):
        raise InputError(f"{path} is {kind}.")
    text = is_text(path)
    if suffix not in READABLE:
        hint = "; a text with a table of numbers may end in .txt" if text else ""
        raise InputError(
            f"The format of {path} is unknown: give a file that ends in {', '.join(READABLE)}{hint}."
        )
    if suffix in TEXTS and not text:
        raise InputError(
            f"{path} is no text, although its name ends in {suffix}: export it as text from the program that wrote it."
        )


def _read_text(path: Path, stated: StatedForm) -> DataTable:
    """A text file in UTF-8, in UTF-16 with its mark, or in Latin-1 as older loggers write it."""
    encoding = _encoding(path)
    form = recognised(path, encoding, stated)
    beginning = _beginning(path, form, encoding)
    below = _units(beginning, form)
    table = _arrow_table(path, form, encoding, units=bool(below))
    names = [unmarked(name).strip() for name in table.column_names]
    columns, texts = _numeric(table.rename_columns(names), form.notation)
    for name in texts.keys() & {*stated.columns}:
        if wrong := misread(texts[name], form.notation, stated=stated.decimal is not None):
            raise InputError(f"{path}: column '{name}' holds {wrong}.")
    units = {name: in_name(name) for name in columns} | below
    twice = frozenset(name for name in columns if names.count(name) > 1)
    return DataTable(
        columns,
        {name: unit for name, unit in units.items() if name in columns and unit},
        form,
        twice,
        {name: next(filter(None, cells), "") for name, cells in texts.items() if name not in columns},
        fixed_decimals(beginning[1:], names, form.notation),
    )


def _arrow_table(path: Path, form: TextForm, encoding: str, *, units: bool) -> Any:
    """The rows of a text file below its names; what a logger wrote behind the last row is left out."""
    import pyarrow as pa
    from pyarrow import csv as arrow

    short: list[Any] = []  # rows with another number of cells

    def read(*, skips: bool, block: int | None = None) -> Any:
        def invalid(row: Any) -> str:
            short.append(row)
            return "skip"

        return arrow.read_csv(
            _source(path, form, encoding),
            arrow.ReadOptions(
                skip_rows=form.skip_rows,
                skip_rows_after_names=1 if units else 0,
                encoding="utf-8" if encoding == WIDE else encoding,
                use_threads=not skips,  # else rows have no numbers
                block_size=block,
            ),
            arrow.ParseOptions(delimiter=form.separator, invalid_row_handler=invalid if skips else None),
            arrow.ConvertOptions(decimal_point=form.decimal),
        )

    try:
        return read(skips=False)
    except pa.ArrowInvalid:
        # A column of which a later part holds texts is one of texts, which the first block alone does not show.
        table = read(skips=True, block=min(path.stat().st_size + WHOLE, LARGEST))
        above = form.skip_rows + 1 + units  # its rows above the first one of the table
        if short and short[0].number != above + table.num_rows + 1:  # not behind the last row with all cells
            raise
        return table


def _source(path: Path, form: TextForm, encoding: str) -> Path | io.BytesIO:
    """What a reader of narrow characters and single separators reads: a file, or its text as it needs it."""
    if encoding != WIDE and form.separator != SPACES and path.suffix.lower() != LABVIEW:
        return path
    lines = (line.rstrip("\r\n") for line in lines_of(path, encoding))
    if form.separator == SPACES:
        lines = (SPACES.join(words(unmarked(line))) for line in lines)
    return io.BytesIO("\n".join(lines).encode("utf-8" if encoding == WIDE else encoding))


def _encoding(path: Path) -> str:
    with path.open("rb") as binary:
        if binary.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
            return WIDE
    try:
        with path.open(encoding="utf-8") as stream:
            while stream.read(1 << 20):
                pass
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def _beginning(path: Path, form: TextForm, encoding: str) -> Rows:
    """The cells of the row of names and of some below it."""
    whole = lines_of(path, f"{encoding}-sig" if encoding == "utf-8" else encoding)
    return split(list(itertools.islice(whole, form.skip_rows, form.skip_rows + SEEN)), form.separator)


def _units(rows: Rows, form: TextForm) -> dict[str, str]:
    """The row below the names where it holds texts and no number, by name: a row of units; empty where it is data."""
    if len(rows) < 2 or not any(cell.strip() for cell in rows[1]):
        return {}
    if any(is_number(cell, form.notation) for cell in rows[1]) or times(rows[1][:1]) is not None:
        return {}
    return {name.strip(): unit.strip().strip("[]()") for name, unit in zip(*rows[:2], strict=False)}


def in_name(name: str) -> str:
    """The unit in brackets at the end of a column's name; empty where there is none."""
    found = BRACKETS.search(name)
    return found[1].strip() if found and is_unit(found[1].strip()) else ""


def _read_parquet(path: Path) -> Columns:
    from pyarrow import parquet

    return _numeric(parquet.read_table(path), Notation())[0]


def _numeric(table: Any, notation: Notation) -> tuple[Columns, dict[str, list[str]]]:
    """The columns with numbers or times, and the cells of all that hold other texts than times."""
    import pyarrow as pa

    columns: Columns = {}
    texts: dict[str, list[str]] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        if not name.strip():  # a column without a name cannot be asked for
            continue
        if pa.types.is_integer(column.type) or pa.types.is_floating(column.type):
            columns[name.strip()] = np.array(column.to_numpy(), dtype=np.float64)
        elif pa.types.is_string(column.type) or pa.types.is_temporal(column.type):
            cells = ["" if cell is None else cell for cell in column.cast(pa.string()).to_pylist()]
            found = times(cells)
            if found is None:
                texts[name.strip()] = cells
                found = numbers(cells, notation)
            if found is not None:
                columns[name.strip()] = found
    return columns, texts


def _read_mat(path: Path) -> Columns:
    from scipy.io import loadmat

    items = loadmat(path, squeeze_me=True)
    return _of_arrays({name: value for name, value in items.items() if not name.startswith("__")}, MATLAB)


def _read_npz(path: Path) -> Columns:
    with np.load(path) as archive:
        return _of_arrays({name: archive[name] for name in archive.files}, NUMPY)


def _of_arrays(items: Mapping[str, Any], indexed: Indexed) -> Columns:
    """Columns of arrays by name; those of a matrix, along its longer side, as its program takes them out.

    What a struct holds has the struct's name, a point, and its own.
    """
    columns: Columns = {}
    for name, value in items.items():
        array = np.asarray(value)
        if array.dtype.names and array.size == 1:
            held = {f"{name}.{field}": array[field].item() for field in array.dtype.names}
            columns |= _of_arrays(held, indexed)
        elif array.dtype.kind in "iuf" and array.ndim == 2 and min(array.shape) > 1:
            tall = array.shape[0] >= array.shape[1]
            form = indexed.column if tall else indexed.row
            numbered = enumerate(array.T if tall else array, indexed.first)
            columns |= {form.format(name, k): row.astype(np.float64) for k, row in numbered}
        elif array.dtype.kind in "iuf" and array.ndim in (1, 2) and array.size > 1:
            columns[name] = array.ravel().astype(np.float64)
    return columns


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
