"""The kind `table`: a shaking table and the active mass damper on it, as a plan describes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

import numpy as np

from common.plan.laboratory_tables import ForceCorrection
from common.plan.plan import Plan
from common.signals import TABLE_CHANNELS
from laboratories.kind import (
    Chosen,
    Coasting,
    Coupling,
    Follows,
    Hysteresis,
    Kind,
    Limited,
    Machine,
    Moving,
    Pictured,
    Sensed,
)
from laboratories.table import between, linear, model
from laboratories.table.descent import TableRamp
from laboratories.table.record import TableLab
from models.compiled import bound
from models.registry import Array
from models.system import System

UNCORRECTED = ForceCorrection()


class TableKind(Kind):
    """A shaking table follows a floor and carries an active mass damper, whose force acts on that floor."""

    name = "table"
    says = "shaking table and active mass damper"
    channels = TABLE_CHANNELS
    limited = Limited("table_step", "table_velocity", "", "damper_step", "table_error")
    sensed = (
        Sensed(("table_displacement", "table_acceleration"), "table_displacement"),
        Sensed(("damper_stroke", "damper_force"), "damper_force", by_effort=True),
    )
    sites = ("table", "damper")
    pictured = Pictured(
        "table", "table", "displacement", (Hysteresis("damper", "damper_stroke", "damper_force", "stroke"),)
    )
    reaches: ClassVar[Mapping[tuple[str, str], float]] = {
        ("table_displacement", "m"): 20e-3,
        ("table_acceleration", "m/s²"): 1.0,
        ("damper_stroke", "m"): 49e-3,
        ("damper_force", "N"): 76.0,
    }
    responses = ("table_acceleration", "damper_force")
    free = "damper_stroke"
    record = TableLab

    def machines(self, plan: Plan) -> tuple[Machine, ...]:
        """The table, which its command moves, and the damper on it."""
        return (
            Machine(
                "table",
                ("table.frequency", "table.damping_ratio", "table.delay"),
                ("table_displacement", "table_acceleration"),
                ("table_command", "table_displacement"),
                drive="table_command",
            ),
            Machine(
                "damper",
                ("damper.mass", "damper.stiffness", "damper.damping", "damper.motor_time_constant"),
                ("damper_stroke", "damper_force"),
                ("damper_stroke", "damper_force"),
                shown=("damper_stroke", "damper_force"),
            ),
        )

    def resume(self, lab: TableLab, truth: Array, motion: float, rate: float) -> None:
        """Set the damper's stroke (m) and its rate (m/s)."""
        lab.state[linear.STROKE], lab.state[linear.STROKE_RATE] = motion, rate
        truth[self.channels.names.index(self.free)] = motion

    def between_ticks(self, system: System, drive: Array, places: Sequence[float | None]) -> Array:
        """Of the damper's force, which the motor bends after each step of its command, and of the acceleration."""
        result = np.zeros((len(drive), len(self.channels.names)))
        force, felt = (
            self.channels.names.index(name) for name in (self.channels.force, "table_acceleration")
        )
        result[:, force] = -between.motor_bend(system, drive[:, 1], places[force])
        result[:, felt] = between.acceleration_bend(system, drive[:, 0], places[felt])
        return result

    def drifts(self, plan: Plan) -> bool:
        """Whether the damper has no spring."""
        return plan.damper.stiffness == 0.0

    def decay(self, plan: Plan) -> float:
        """The rate (1/s) of the damper's dashpot."""
        return plan.damper.damping / plan.damper.mass

    def build(self, system: System) -> TableLab:
        """Shaking table and damper of a system, at rest."""
        plan, effects = system.plan, system.effects
        return model.build(plan.test.interval, plan.table, plan.damper, effects.table, effects.damper)

    @staticmethod
    def advance(lab: TableLab, truth: Array, command: float, effort: float) -> None:
        """Displacement, acceleration, stroke, force; `effort` is the motor's command (N)."""
        truth[0], truth[1], truth[2], truth[3] = model.advance(lab, command, effort)

    def mover(self, lab: TableLab) -> Callable[..., tuple[float, ...]]:
        """Displacement, acceleration, stroke and force for a caller outside compiled code: it gives both commands."""
        return bound(model.enter, lab, 0.0, 0.0)

    def coupling(self, plan: Plan) -> Coupling:
        """The coupling to the damper's floor; without `amd` in [control] neither force nor motor acts."""
        scale = plan.damper.force_scale if plan.control.amd else 0.0
        return Coupling(
            follows=Follows.FLOOR,
            place=plan.damper.floor,
            ratio=1.0,
            scale=scale,
            effort=plan.control.gain / plan.damper.force_scale if scale else 0.0,
            correction=UNCORRECTED,
            stiffness=0.0,
            damping=0.0,
            mass=0.0,
            share=0.0,
        )

    def compensator(self, plan: Plan) -> Chosen:
        """The compensator of `[table.compensator]`."""
        chosen = plan.table.compensator
        return Chosen(chosen.kind, chosen.parameters, plan.follows_in)

    def coasting(self, plan: Plan, moving: Moving) -> Coasting:
        """The swing of the damper's mass on its spring after the table has stopped, without damping.

        In the worst case the speeds of the mass on the table, of the table, and the impulse of the motor's force while
        it goes to zero with the rate of the earthquake's time, add up.
        """
        damper, stroke = plan.damper, self.channels.names.index(self.free)
        speed = abs(moving.rates[stroke]) + abs(moving.velocity)
        speed += 0.5 * abs(moving.effort) * moving.duration / damper.mass
        energy = 0.5 * (damper.stiffness * moving.measured[stroke] ** 2 + damper.mass * speed**2)
        if damper.stiffness:
            peak = math.sqrt(2.0 * energy / damper.stiffness)
        else:  # its dashpot alone ends the motion
            way = speed * damper.mass / damper.damping if damper.damping else math.inf
            peak = abs(moving.measured[stroke]) + way
        return Coasting(self.free, peak, self.coupling(plan).scale * energy)

    def ramp(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> TableRamp:
        """The ramp on which the table comes to a hold and the motor's force goes to zero."""
        return TableRamp(plan, last, before)


TABLE = TableKind()
