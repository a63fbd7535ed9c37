"""The parts into which a recording divides: those whose inputs and outputs it holds."""

from __future__ import annotations

import numpy as np

from common.plan.kinds import COLUMN
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.ground import Ground
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.missing_rows import with_known_commands
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.recorded.record import Record

BUILDING = ("ground_acceleration", "displacement")


def parts_of(record: Record) -> list[Part]:
    """The parts whose inputs and outputs were recorded."""
    parts: list[Part] = []
    if record.ground is not None and record.has("ground_acceleration"):
        parts.append(Ground(record, record.ground))
    if record.has(*BUILDING, *used(record)) and not record.plan.foreign:
        parts.append(Building(record))
    for lab in record.labs:
        if driven(record, lab):
            parts.append(with_known_commands(LaboratoryPart(record, lab), record))
        elif lab.kind.name == COLUMN and record.has(*lab.measured):
            parts.append(ColumnAlone(record, lab))
    return [part for part in parts if np.any(part.measured)]


def used(record: Record) -> list[str]:
    """The signals that the building was computed from, the ground motion aside."""
    own, other = record.own, record.other
    names = [own.kind.channels.force, own.kind.channels.position] if own else []
    return names + ([other.kind.channels.used] if other else [])


def driven(record: Record, lab: RecordedLaboratory) -> bool:
    """Whether a command of a laboratory was recorded with a reading of it."""
    return any(map(record.has, lab.commands)) and any(map(record.has, lab.measured))
