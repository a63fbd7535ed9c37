"""A column of which no command was recorded: its deformation drives it."""

from __future__ import annotations

from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.nuisances import nuisances
from diagnosis.recorded.parts import Measured, cut, of_sites, outputs
from diagnosis.recorded.record import Record
from diagnosis.recorded.smoothed import smoothed
from loop import replay
from models.registry import Array
from models.system import System


class ColumnAlone(Measured):
    """The column replayed from its measured deformation, where no actuator command was recorded."""

    name = "column"
    exact = False

    def __init__(self, record: Record, lab: RecordedLaboratory) -> None:
        self.lab, self.role = lab, lab.role
        displacement, force = lab.kind.channels.position, lab.kind.channels.force
        self.signals: tuple[str, ...] = (lab.signal(force),)
        reading = record.signals[lab.signal(displacement)]
        self.inputs = reading if record.static else smoothed(reading)  # rows have no frequencies
        self.measured, self.present = outputs(record, self.signals)
        machine = next(item for item in lab.kind.machines(lab.plan) if item.site == "column")
        self.nuisances = nuisances(lab, machine.parameters)
        sites = (lab.site("column"), lab.site(f"sensor.{force}"))
        self.candidates = of_sites(record, sites, lab.plan)

    def predict(self, system: System) -> Array:
        """Force readings."""
        return replay.column(system, self.inputs)[:, None]

    def first(self, ticks: int) -> ColumnAlone:
        """The column over the first ticks."""
        result: ColumnAlone = cut(self, ticks, self.inputs[:ticks])
        return result
