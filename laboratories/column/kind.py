"""The kind `column`: an actuator and its specimen as a plan describes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from common.plan.plan import Plan
from common.signals import COLUMN_CHANNELS
from laboratories.column import model
from laboratories.column.model import ColumnLab
from laboratories.descent import HoldRamp
from laboratories.kind import Chosen, Coupling, Follows, Hysteresis, Kind, Limited, Machine, Pictured, Sensed
from models import specimens
from models.compiled import bound
from models.registry import Array
from models.system import System

PARAMETERS = {  # parameters of [actuator] that have a tolerance, by its model
    "fopdt": ("actuator.gain", "actuator.delay", "actuator.time_constant"),
    "servo_hydraulic": (
        "actuator.servo.gain",
        "actuator.servo.valve",
        "actuator.servo.valve_damping",
        "actuator.servo.valve_stiffness",
        "actuator.servo.leakage",
        "actuator.servo.piston",
        "actuator.servo.delay",
    ),
}
FREE = 4.0  # tolerances by which a parameter of a specimen's model must be free to move


class ColumnKind(Kind):
    """A hydraulic actuator deforms a specimen, which represents columns of a storey."""

    name = "column"
    says = "actuator and column"
    channels = COLUMN_CHANNELS
    limited = Limited("actuator_step", "actuator_velocity", "actuator_acceleration", "", "column_error")
    sensed = (Sensed(("column_displacement", "column_force"), "column_displacement"),)
    sites = ("actuator", "column")
    pictured = Pictured(
        "actuator",
        "column",
        "deformation",
        (Hysteresis("column", "column_displacement", "column_force", "deformation", "kN"),),
    )
    reaches: ClassVar[Mapping[tuple[str, str], float]] = {
        ("column_displacement", "m"): 2.4e-3,
        ("column_displacement", "m/s"): 0.035,
        ("column_force", "N"): 30e3,
    }
    responses = ("column_displacement", "column_force")
    record = ColumnLab

    def machines(self, plan: Plan) -> tuple[Machine, ...]:
        """The actuator by its model, and the specimen."""
        read = self.channels.names
        return (
            Machine(
                "actuator", PARAMETERS[plan.actuator.model], read, ("actuator_command", "column_displacement")
            ),
            Machine(
                "column",
                ("column.stiffness", "column.mass", "column.damping", *self.of_model(plan)),
                read,
                ("column_displacement", "column_force"),
                shown=("column_force",),
            ),
        )

    def of_model(self, plan: Plan) -> tuple[str, ...]:
        """The parameters of the specimen's model beside its stiffness, of which it admits some tolerances more or less.

        At the bound of a range, as a share of one, a parameter cannot move to both sides, and counts as known.
        """
        column, names = plan.column, []
        for own, value in column.parameters.items():
            width = FREE * self.tolerance(plan, f"column.{own}")
            moved = [column.parameters | {own: value * (1.0 + share)} for share in (-width, width)]
            if all(specimens.admits(column.model, stiffness=column.stiffness, **one) for one in moved):
                names.append(f"column.{own}")
        return tuple(names)

    def planned(self, plan: Plan, name: str) -> Any:
        """The value of a nominal parameter of `machines`, which may be one of the specimen's model."""
        own = name.removeprefix("column.")
        return plan.column.parameters[own] if own in plan.column.parameters else super().planned(plan, name)

    def scaled(self, system: System, name: str, factor: float) -> System:
        """The system with a nominal parameter multiplied."""
        own, known = name.removeprefix("column."), system.plan.column.parameters
        if own not in known:
            return super().scaled(system, name, factor)
        return system.moved("column", parameters=known | {own: factor * known[own]})

    def settle(self, lab: ColumnLab, truth: Array, command: float, interval: float) -> bool:
        """Bring the laboratory to rest with the specimen deformed by the command; always possible."""
        model.begin(lab, command, interval)
        truth[:] = lab.state[[model.DISPLACEMENT, model.FORCE]]
        return True

    def build(self, system: System) -> ColumnLab:
        """Actuator and column of a system, at rest."""
        plan, effects = system.plan, system.effects
        return model.build(plan.test.interval, plan.actuator, plan.column, effects.actuator, effects.column)

    @staticmethod
    def advance(lab: ColumnLab, truth: Array, command: float, effort: float) -> None:
        """Displacement (m) and force (N); the actuator's command alone moves it."""
        truth[0], truth[1] = model.advance(lab, command)

    def mover(self, lab: ColumnLab) -> Callable[..., tuple[float, ...]]:
        """Displacement (m) and force (N) for a caller outside compiled code, which gives the command (m)."""
        return bound(model.enter, lab, 0.0)

    def coupling(self, plan: Plan) -> Coupling:
        """The coupling to the specimen's storey, whose drift its force resists `represents` times."""
        column = plan.column
        felt = column.deformation_ratio * column.represents
        return Coupling(
            follows=Follows.DRIFT,
            place=column.storey,
            ratio=column.deformation_ratio,
            scale=float(column.represents),
            effort=0.0,
            correction=plan.compensator.force,
            stiffness=felt * column.stiffness,
            damping=felt * column.damping,
            mass=felt * column.mass,
            share=column.represents / column.columns_per_storey,
        )

    def compensator(self, plan: Plan) -> Chosen:
        """The compensator of `[compensator]`."""
        return Chosen(plan.compensator.kind, plan.compensator.parameters, "compensator")

    def ramp(self, plan: Plan, last: tuple[float, ...], before: tuple[float, ...]) -> HoldRamp:
        """The ramp on which the actuator comes to a hold and then unloads the specimen."""
        force = self.channels.names.index(self.channels.force)
        return HoldRamp(plan, last, before, force, "actuator", "column")


COLUMN = ColumnKind()
