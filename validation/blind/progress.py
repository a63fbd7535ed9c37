"""The finished cases of a blind trial, from which an interrupted trial continues."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pyarrow as pa

from common.plan import read as plans
from simulation.workers.batch import Batch
from simulation.workers.parts import Parts
from simulation.workers.versions import versions
from validation.blind.cases.case import Case
from validation.blind.judge import DiagnosisAnswer, answer
from validation.blind.record import RecordedCase
from validation.blind.worker import ENDINGS, Diagnosed

TABLE = "results.parquet"
# of a case that is done: its recording and the answer as JSON, and the files with the findings
SCHEMA = pa.schema(
    [
        pa.field("recorded", pa.string()),
        pa.field("answer", pa.string()),
        *(pa.field(ending, pa.binary()) for ending in ENDINGS),
    ]
)
DRAWN = ("seconds", "recording")  # what another trial of the same cases has otherwise: times, random names


class CasesDone:
    """The cases of a trial that are done, by their place among all cases."""

    def __init__(self, parts: Parts, cases: Sequence[Case]) -> None:
        self._parts = parts
        self._cases = cases
        self._places = {case.index: place for place, case in enumerate(cases)}

    @property
    def missing(self) -> list[Case]:
        """The cases that are not done."""
        return [case for place, case in enumerate(self._cases) if place not in self._parts.there]

    def add(self, recorded: RecordedCase, said: Diagnosed) -> None:
        """Keep a case that was diagnosed."""
        row = {"recorded": json.dumps(asdict(recorded)), "answer": json.dumps(said.answer)}
        columns = row | {ending: said.files.get(ending) for ending in ENDINGS}
        place = self._places[recorded.index]
        self._parts.add(Batch(place, {name: [value] for name, value in columns.items()}))

    def all(self, folder: Path) -> tuple[dict[int, RecordedCase], dict[str, DiagnosisAnswer]]:
        """Recordings by the number of the case, answers by their name; what was found is written into the folder."""
        recorded: dict[int, RecordedCase] = {}
        answers: dict[str, DiagnosisAnswer] = {}
        for row in self._parts.table().to_pylist():
            one = read(row["recorded"])
            recorded[one.index] = one
            answers[one.name] = answer(json.loads(row["answer"]), one.name)
            for ending in ENDINGS:
                if row[ending] is not None:
                    (folder / one.name).with_suffix(ending).write_bytes(row[ending])
        return recorded, answers


def read(text: str) -> RecordedCase:
    """The recording of a case that JSON holds."""
    data = json.loads(text)
    return RecordedCase(**data | {"sizes": tuple(data["sizes"])})


def table(cases: Sequence[Case], outcomes: Sequence[Mapping[str, Any]]) -> pa.Table:
    """The judged cases as a table: one row each, with what computes it again; nested values as JSON."""
    rows = []
    for case, outcome in zip(cases, outcomes, strict=True):
        kept = {name: cell(value) for name, value in outcome.items() if name not in DRAWN}
        plan = plans.from_tables(case.plan, Path())
        rows.append(kept | {"plan": plan.digest(), "seed": case.seed, "versions": versions()})
    return pa.Table.from_pylist(rows)


def cell(value: object) -> object:
    """A value of JSON as a cell."""
    return json.dumps(value, sort_keys=True) if isinstance(value, list | dict) else value
