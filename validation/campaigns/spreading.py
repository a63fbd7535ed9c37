"""The comparison of all laboratories as one table, spread over processes or a Dask cluster."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa

from common.terminal.telling import Tell, untold
from simulation.campaign import assess
from simulation.campaign.goal import Goal
from simulation.campaign.steps import BegunStep
from simulation.workers.batch import Batch
from simulation.workers.parts import Way, complete, parts, write
from simulation.workers.versions import versions
from validation.blind.cases.case import Case
from validation.campaigns.compare import ComparedCase, PlayedCampaign, compare

TABLE = "results.parquet"
NESTED = ("truth", "chosen", "random")  # cells of JSON
SCHEMA = pa.schema(
    [
        pa.field("index", pa.int64()),
        pa.field("kind", pa.string()),
        pa.field("truth", pa.string()),
        pa.field("gentle", pa.bool_()),
        pa.field("chosen", pa.string()),
        pa.field("random", pa.string()),
        pa.field("plan", pa.string()),
        pa.field("seed", pa.int64()),
        pa.field("versions", pa.string()),
    ]
)


def compared(
    folder: Path, goal: Goal, cases: Sequence[Case], drawn: Mapping[str, Any], way: Way, tell: Tell = untold
) -> list[ComparedCase]:
    """Compare the campaigns in every laboratory into a table in the folder; laboratories that are there are kept.

    `drawn` says how the cases were drawn.

    Raises:
        InputError, LostError: as `simulation.workers.parts.complete`.
    """
    about = {"goal": goal.digest, "version": versions(), "cases": len(cases), **drawn}
    path = folder / TABLE
    with parts(path, about, SCHEMA, len(cases), force=True) as found:
        begun = BegunStep(goal.digest, versions(), assess.nominal(goal))
        table = complete(found, partial(batch, goal, begun), list(enumerate(cases)), way, tell)
        write(path, table, force=True)
    return [read(row) for row in table.to_pylist()]


def batch(goal: Goal, begun: BegunStep, numbered: tuple[int, Case]) -> Batch:
    """The row of one laboratory."""
    number, case = numbered
    found = asdict(compare(goal, begun, case))
    row = found | {name: json.dumps(found[name]) for name in NESTED}
    row |= {"plan": goal.plan.digest(), "seed": case.seed, "versions": versions()}
    return Batch(number, {name: [row[name]] for name in SCHEMA.names})


def read(row: Mapping[str, Any]) -> ComparedCase:
    """The laboratory of a row."""
    chosen, random = json.loads(row["chosen"]), json.loads(row["random"])
    return ComparedCase(
        row["index"],
        row["kind"],
        tuple(json.loads(row["truth"])),
        row["gentle"],
        campaign(chosen),
        tuple(map(campaign, random)),
    )


def campaign(given: Mapping[str, Any]) -> PlayedCampaign:
    """A campaign that JSON holds."""
    return PlayedCampaign(
        **{**given, "candidates": tuple(given["candidates"]), "certainty": tuple(given["certainty"])}
    )
