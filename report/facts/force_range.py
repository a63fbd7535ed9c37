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
from models.specimens import fit
from models.specimens.fit import SpecimenFit

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


def fitted_within(model: str, deformation: Array, force: Array, used: Rows) -> SpecimenFit:
    """A law, as `models.specimens.fit.fit` finds it, along the whole path, but fitted to the force of some rows only.

    A law remembers where it has been, so that rows cannot be cut out of its path.

    Raises:
        InputError: the record cannot be fitted.
    """
    if used.all():
        return fit.fit(model, deformation, force)
    path, measured = fit.record(model, deformation, force)
    ranges = fit.FREE[model]
    scale = fit.scales(path[used], measured[used])
    units = np.array([scale[item.unit] for item in ranges.values()])
    low, high = fit.bounds(ranges)
    kept = np.union1d(
        fit.thinned(path, fit.MOST_ROWS), np.flatnonzero(used)[fit.thinned(path[used], fit.MOST_ROWS)]
    )
    rms = math.sqrt(float(np.mean(measured[used] ** 2)))

    def missed(x: Array, rows: npt.NDArray[np.intp]) -> Array:
        found = fit.forces(model, fit.parameters(model, x, units), path[rows]) - measured[rows]
        return np.asarray(found[used[rows]] / rms)

    starts = [np.clip(x, low, high) for x in fit.starting_points(model, units, None)]
    starts.sort(key=lambda x: float(np.sum(missed(x, kept) ** 2)))
    best = fit.followed(
        lambda x: missed(x, kept), starts[: max(2, fit.FOLLOWED // len(ranges) ** 2)], low, high
    )
    return SpecimenFit(
        model,
        fit.parameters(model, best.x, units),
        math.sqrt(float(np.mean(missed(best.x, np.arange(path.size)) ** 2))),
        fit.intervals(model, np.asarray(best.x), units, np.asarray(best.jac), 2.0 * float(best.cost)),
    )
