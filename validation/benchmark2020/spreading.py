"""All tests of the benchmark as one table, spread over processes or a Dask cluster."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa

from common.plan.laboratory_tables import CompensatorTable
from common.terminal.telling import Tell, untold
from simulation.workers.batch import Batch
from simulation.workers.parts import Way, complete, parts, write
from simulation.workers.versions import versions
from validation.benchmark2020.criteria import Criteria
from validation.benchmark2020.problem import CASES, MOTIONS, with_compensator
from validation.benchmark2020.runs import CellResult, Stage, play, stage

TABLE = "results.parquet"
PAIRS = [
    (case, motion) for motion in MOTIONS for case in CASES
]  # of which a stage is made each, in this order
TYPES = {str: pa.string(), int: pa.int64(), bool: pa.bool_(), float: pa.float64()}
KEPT = {"setting": str, "case": int, "motion": str, "plant": int, "stable": bool, "j4": float}
MEASURED = ("two_sided", "noise_floor", "force", "stroke")
CRITERIA = [f"found_{name}" for name in Criteria._fields]
COLUMNS: dict[str, type] = {
    **KEPT,
    **dict.fromkeys((*MEASURED, *CRITERIA), float),
    **dict.fromkeys(("plan", "versions"), str),
    "seed": int,
}
SCHEMA = pa.schema([pa.field(name, TYPES[kind]) for name, kind in COLUMNS.items()])


class Plant(NamedTuple):
    """The tests of all settings on one plant of a stage."""

    number: int  # of the batch: that of the stage times the number of plants, plus that of the plant
    plants: int  # drawn plants of a stage
    seed: int
    settings: Mapping[str, CompensatorTable]


def played(
    folder: Path,
    settings: Mapping[str, CompensatorTable],
    plants: int,
    seed: int,
    way: Way,
    tell: Tell = untold,
) -> list[CellResult]:
    """Test every setting on every plant of every stage into a table in the folder; those that are there are kept.

    Raises:
        InputError, LostError: as `simulation.workers.parts.complete`.
    """
    about = {
        "settings": {name: [one.kind, dict(one.parameters)] for name, one in settings.items()},
        "plants": plants,
        "seed": seed,
        "version": versions(),
    }
    path, count = folder / TABLE, len(PAIRS) * (1 + plants)
    with parts(path, about, SCHEMA, count, force=True) as found:
        tasks = [Plant(number, plants, seed, settings) for number in range(count)]
        table = complete(found, batch, tasks, way, tell)
        write(path, table, force=True)
    return results(table)


@lru_cache(maxsize=2)
def prepared(place: int, plants: int, seed: int) -> Stage:
    """The stage of the pair at this place; batches come stage by stage."""
    return stage(*PAIRS[place], plants, seed)


def batch(one: Plant) -> Batch:
    """Play all settings on a plant."""
    place, plant = divmod(one.number, 1 + one.plants)
    on = prepared(place, one.plants, one.seed)
    rows = []
    for name, chosen in one.settings.items():
        plan = with_compensator(on.plants[plant], chosen)
        about = {"plan": plan.digest(), "versions": versions(), "seed": plan.test.seed}
        rows.append(plain(play(on, name, plan, plant)[0]) | about)
    return Batch(one.number, {name: [row[name] for row in rows] for name in COLUMNS})


def plain(result: CellResult) -> dict[str, Any]:
    """The cells of a result; criteria are NaN where there are none."""
    found = result.found or (math.nan,) * len(CRITERIA)
    return {name: getattr(result, name) for name in (*KEPT, *MEASURED)} | dict(
        zip(CRITERIA, found, strict=True)
    )


def results(table: pa.Table) -> list[CellResult]:
    """The results that the rows of a table hold."""
    return [result(row) for row in table.to_pylist()]


def result(row: Mapping[str, Any]) -> CellResult:
    """The result of one row."""
    found = [row[name] for name in CRITERIA]
    criteria = None if all(map(math.isnan, found)) else Criteria(*found)
    return CellResult(found=criteria, **{name: row[name] for name in (*KEPT, *MEASURED)})
