"""The fragility curves of a sweep's table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from common.errors import InputError
from common.plan.schema import nearest
from common.plan.units import in_si
from models.registry import Array
from simulation.sweep.fragility import Fragility, Stripe, fit, stripes


class FragilityCurve(NamedTuple):
    """The curve of one group of tests, with the tests behind it."""

    name: str  # of the group, empty where all tests are one
    fit: Fragility
    stripes: list[Stripe]


class Curves(NamedTuple):
    """What was asked, and the curves."""

    table: str
    quantity: str
    limit: float
    unit: str  # of the limit
    intensity: str
    intensity_unit: str
    by: str
    curves: list[FragilityCurve]


def gather(path: Path, quantity: str, limit: str, intensity: str, by: str) -> Curves:
    """The curves of the tests in a table: how many of them have a `quantity` above its `limit` at each intensity.

    Raises:
        InputError: the table cannot be read, lacks a column, or the limit is no number above 0.
    """
    columns = [quantity, intensity, *([by] if by else [])]
    table = read(path, columns)
    unit = unit_of(table, quantity)
    most = limit_of(limit, unit)
    strength, values = (numbers(path, table, name) for name in (intensity, quantity))
    if not np.all(strength > 0.0):
        raise InputError(f"'{intensity}' of {path} is not above 0 in every test: name another column.")
    passed = values > most
    groups = [str(value) for value in table.column(by).to_pylist()] if by else [""] * strength.size
    labels = np.array(groups)
    found = []
    for name in dict.fromkeys(groups):
        of_it = labels == name
        found.append(
            FragilityCurve(name, fit(strength[of_it], passed[of_it]), stripes(strength[of_it], passed[of_it]))
        )
    return Curves(path.name, quantity, most, unit, intensity, unit_of(table, intensity), by, found)


def read(path: Path, columns: list[str]) -> pa.Table:
    """Columns of a table; raises InputError where it cannot be read, is empty, or lacks one."""
    if not path.is_file():
        raise InputError(f"There is no file {path}: give the table that rths sweep wrote.")
    try:
        schema = parquet.read_schema(path)
        for name in columns:
            if name not in schema.names:
                raise InputError(f"{path} has no column '{name}': {nearest(name, schema.names)}")
        table = parquet.read_table(path, columns=list(dict.fromkeys(columns)))
    except OSError as error:
        raise InputError(
            f"Cannot read {path}: {error.strerror or 'it is damaged'}; check the path."
        ) from None
    except pa.ArrowInvalid:
        raise InputError(f"{path} is no Parquet file: give the table that rths sweep wrote.") from None
    if table.num_rows == 0:
        raise InputError(f"{path} has no tests: give the table that rths sweep wrote.")
    return table


def numbers(path: Path, table: pa.Table, name: str) -> Array:
    """A column of numbers (tests,); raises InputError where it is another."""
    column = table.column(name)
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise InputError(f"'{name}' of {path} is no column of numbers: name another one.")
    return np.asarray(column.to_numpy(), dtype=np.float64)


def unit_of(table: pa.Table, name: str) -> str:
    """The unit of a column, empty for none."""
    metadata = table.schema.field(name).metadata or {}
    return str(metadata.get(b"unit", b"").decode())


def limit_of(text: str, unit: str) -> float:
    """The limit as given, in SI units; raises InputError where it is no number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = in_si(text, unit, "--limit")
    if not 0.0 < value < math.inf:
        raise InputError(f"--limit is {text}, but must be above 0.")
    return value


def plain(found: Curves) -> dict[str, Any]:
    """The curves as JSON holds them."""
    return {
        **found._asdict(),
        "curves": [
            {
                "name": one.name,
                "tests": one.fit.tests,
                "passed": one.fit.passed,
                "median": finite(one.fit.median),
                "median_interval": [finite(end) for end in one.fit.median_interval],
                "dispersion": finite(one.fit.dispersion),
                "dispersion_interval": [finite(end) for end in one.fit.dispersion_interval],
                "agreement": finite(one.fit.agreement),
                "why_not": one.fit.why_not,
                "stripes": [stripe._asdict() for stripe in one.stripes],
            }
            for one in found.curves
        ],
    }


def finite(value: float) -> float | None:
    """A number as JSON can hold it."""
    return value if math.isfinite(value) else None
