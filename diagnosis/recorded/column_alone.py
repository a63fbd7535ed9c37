"""A column of which no command was recorded: its deformation drives it."""

from __future__ import annotations

import math

import numpy as np

from common.recording.imported import NOTHING_STATED, ImportedChannel
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.nuisances import channels, nuisances
from diagnosis.recorded.parts import Measured, cut, of_sites, outputs
from diagnosis.recorded.record import Record
from diagnosis.recorded.smoothed import missed_at_turns, smoothed, without_small_turns
from diagnosis.signals.noise.rounding import quantum
from loop import replay
from models.registry import Array
from models.system import System


class ColumnAlone(Measured):
    """The column replayed from its measured deformation, where no actuator command was recorded."""

    name = "column"
    exact = False
    static = False
    channel = NOTHING_STATED
    interval = 0.0  # s, that only a channel with a filter or a delay asks for

    def __init__(self, record: Record, lab: RecordedLaboratory) -> None:
        self.lab, self.role = lab, lab.role
        displacement, force = lab.kind.channels.position, lab.kind.channels.force
        self.signals: tuple[str, ...] = (lab.signal(force),)
        reading = record.signals[lab.signal(displacement)]
        self.measured, self.present = outputs(record, self.signals)
        self.interval = record.plan.test.interval
        stated = dict(zip(lab.kind.channels.names, channels(record.stated, lab), strict=True))
        motion, self.channel = apart(stated[displacement], stated[force])
        self.static = record.static
        if self.static:  # rows have no frequencies
            step = max(quantum(reading), stated[displacement].resolution)
            error = math.hypot(
                record.planned_noise.get(lab.signal(displacement), 0.0), step / math.sqrt(12.0)
            )
            self.inputs = without_small_turns(reading, error)
            self.blurred = np.array([lab.plan.column.stiffness * error])
        else:
            self.inputs = smoothed(reading)
            if lab.plan.column.model != "linear":  # what has a memory keeps how far it went
                self.blurred = np.array([lab.plan.column.stiffness * missed_at_turns(self.inputs)])
            self.measured = motion.through(self.measured[:, 0], self.interval)[:, None]
        machine = next(item for item in lab.kind.machines(lab.plan) if item.site == "column")
        self.nuisances = nuisances(lab, machine.parameters)
        sites = (lab.site("column"), lab.site(f"sensor.{force}"))
        self.candidates = of_sites(record, sites, lab.plan)

    def predict(self, system: System) -> Array:
        """Force readings, behind the filters of both channels as `measured` is."""
        force = replay.column(system, self.inputs)
        if self.static or not np.isfinite(force).all():
            return force[:, None]
        return self.channel.through(force, self.interval)[:, None]

    @property
    def passes(self) -> Array:
        """Frequency (1,) up to which the force's channel passes noise, Hz."""
        return np.array([math.inf if self.static else self.channel.passes])

    def first(self, ticks: int) -> ColumnAlone:
        """The column over the first ticks."""
        result: ColumnAlone = cut(self, ticks, self.inputs[:ticks])
        return result


def apart(motion: ImportedChannel, force: ImportedChannel) -> tuple[ImportedChannel, ImportedChannel]:
    """What the force has to pass beside what the motion passed, and the prediction: nothing where both are the same.

    The force that a filtered motion makes has passed the motion's filter. So the force that was measured passes that
    one as well, and the prediction that of the force, which a nonlinear law changes in details only.
    """
    if motion.chain == force.chain:
        return NOTHING_STATED, NOTHING_STATED
    return motion.chain, force.chain
