"""The table of a sweep: one row for each test, in the order of the sweep, and what is needed to compute it again."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa

from common.reality.found import digest
from common.terminal.telling import Tell, untold
from simulation.sweep import luggage, measures, rows
from simulation.sweep.definition import Sweep
from simulation.sweep.luggage import Luggage
from simulation.sweep.play import SIZE, SweepStage, Task, batch, test
from simulation.workers.parts import Way, complete, parts, write
from simulation.workers.versions import versions

UNITS = {"pga": "m/s²", "sa": "m/s²"}


def schema(sweep: Sweep, given: Luggage) -> pa.Schema:
    """The columns of the table with their units, found from a first test of two intervals; checks all combinations.

    Raises:
        InputError: a combination of the sweep cannot be computed.
    """
    stage = SweepStage(given)
    for number in range(0, sweep.rows, sweep.points * sweep.head.draws):
        rows.plan_of(stage.sweep, rows.row(sweep, number))
    for place in range(len(sweep.motions)):
        stage.motion(place)
    head = replace(stage.sweep.head, draws=1)
    brief = replace(stage.sweep, head=head, plan=sweep.plan.with_ticks(2))
    stage.sweep = replace(brief, plan=replace(brief.plan, base=stage.sweep.plan.base))
    first = test(stage, rows.row(stage.sweep, 0))
    types = {name: column_type(name, value, sweep) for name, value in first.items()}
    units = UNITS | measures.units(sweep.plan)
    fields = [pa.field(name, kind, metadata={"unit": units.get(name, "")}) for name, kind in types.items()]
    return pa.schema(fields)


def column_type(name: str, value: object, sweep: Sweep) -> pa.DataType:
    """The type of a column from its first value; the values of a parameter may be whole numbers and others."""
    values = sweep.parameters.get(name, (value,))
    if all(isinstance(one, bool) for one in values):
        return pa.bool_()
    if all(isinstance(one, int) and not isinstance(one, bool) for one in values):
        return pa.int64()
    numbers = all(isinstance(one, int | float) and not isinstance(one, bool) for one in values)
    return pa.float64() if numbers else pa.string()


def about(sweep: Sweep, given: Luggage) -> dict[str, Any]:
    """What the rows of a sweep depend on, by names."""
    return {
        "plan": sweep.plan.digest(),
        "seed": sweep.head.seed,
        "draws": sweep.head.draws,
        "noise": sweep.head.noise,
        "reality": dict(given.reality),
        "motions": [{**one.ground_motion, "scales": one.scales} for one in sweep.motions],
        "compensators": [{"name": one.name, **one.keys} for one in sweep.compensators],
        "parameters": dict(sweep.parameters),
        "drawn": {name: vars(one) for name, one in sweep.drawn.items()},
        "intensity": vars(sweep.intensity),
        "files": given.digest,
        "version": versions(),
    }


def table(path: Path, sweep: Sweep, way: Way, *, force: bool = False, tell: Tell = untold) -> pa.Table:
    """Compute a sweep into a Parquet file; rows of an earlier call are not computed again.

    Raises:
        InputError: the sweep cannot be computed, or the table cannot be written.
        LostError: the scheduler of the Dask cluster is lost.
    """
    given = luggage.packed(sweep)
    columns = schema(sweep, given)
    count = math.ceil(sweep.rows / SIZE)
    said = json.loads(json.dumps(about(sweep, given), default=str))
    with parts(path, said, columns, count, force=force) as found:
        known = digest(said)
        tasks = [Task(given, known, number) for number in range(count)]
        made = complete(found, batch, tasks, way, tell)
        made = made.replace_schema_metadata({"rths": json.dumps(said, sort_keys=True)})
        write(path, made, force=force)
    return made
