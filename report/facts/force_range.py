"""The range of a column's force within which `rths identify` uses its rows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from common.errors import InputError, PlanError
from common.plan.schema import as_type
from common.recording.run import Run
from models.registry import Array

FEWEST = 20  # rows, with fewer of which the interval of a stiffness is very uncertain
Rows = npt.NDArray[np.bool_]


def most_force(text: str | None) -> float:
    """The largest force (N) of an option, in newtons or with a unit; infinite where there is none.

    Raises:
        InputError: it is no force above zero.
    """
    if text is None:
        return math.inf
    try:
        value = as_type("float", plain(text), "--max-force", "N")
    except PlanError as error:
        raise InputError(str(error)) from None
    if not 0.0 < value < math.inf:
        raise InputError(f"--max-force is {text}, but must be a force above zero, such as 40e3 or '40 kN'.")
    return float(value)


def plain(text: str) -> float | str:
    """A number, or the text itself where it has a unit."""
    try:
        return float(text)
    except ValueError:
        return text


def within(run: Run, force: Array, most: float) -> Rows:
    """The rows (n,) in which the force is at most as large; raises InputError where they are too few."""
    used = ~(np.abs(force) > most)
    if np.count_nonzero(used) < FEWEST:
        raise InputError(
            f"{run.path}: {np.count_nonzero(used)} of {used.size} rows have a column_force within --max-force "
            f"{most:g} N, but {FEWEST} are needed: give a larger one."
        )
    return used


def said(used: Rows, most: float) -> dict[str, Any]:
    """The entry of a report on the rows that were left out; empty without a largest force."""
    if math.isinf(most):
        return {}
    return {"left_out": {"rows": int(np.count_nonzero(~used)), "of": used.size, "max_force": most}}
