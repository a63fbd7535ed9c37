"""Kinds of laboratory: what the simulated loop must know of a laboratory, one entry each, listed here.

A kind is a record of arrays with a kernel that moves it on by one interval. The compiled loop chooses the kernel by the
record's class, so that laboratories of different kinds stand in one loop without a table of functions at run time. A
further kind is one record, one kernel and one entry.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from numba.core import types
from numba.extending import overload

from common.plan.plan import Plan
from common.signals import MEASURED
from laboratories.column import model as column_lab
from laboratories.column.model import ColumnLab
from laboratories.table import model as table_lab
from laboratories.table.model import TableLab
from models.compiled import MERGED
from models.registry import Array
from models.system import System


class Kind(NamedTuple):
    """One kind of laboratory; signals by the names of the one table."""

    name: str
    record: type[Any]  # NamedTuple of the laboratory at work, which `advance` moves on
    build: Callable[[System], Any]  # that record at rest, of a system
    advance: Callable[..., None]  # (record, truth, command, effort): one interval, see `advance`
    drives: tuple[str, ...]  # commands that move it: the transfer system's, and a motor's where it has one
    measured: tuple[str, ...]  # channels, in the order of the kernel's
    follows: str  # of these, what a compensator compares with the target
    force: str  # of these, the force that goes back to the building
    scale: Callable[[Plan], float]  # the building feels that force times this


def build_column(system: System) -> ColumnLab:
    """Actuator and column of a system, at rest."""
    plan, effects = system.plan, system.effects
    return column_lab.build(plan.test.interval, plan.actuator, plan.column, effects.actuator, effects.column)


def build_table(system: System) -> TableLab:
    """Shaking table and damper of a system, at rest."""
    plan, effects = system.plan, system.effects
    return table_lab.build(plan.test.interval, plan.table, plan.damper, effects.table, effects.damper)


def advance_column(lab: ColumnLab, truth: Array, command: float, effort: float) -> None:
    """An actuator and its column: displacement (m) and force (N); the actuator's command alone moves it."""
    truth[0], truth[1] = column_lab.advance(lab, command)


def advance_table(lab: TableLab, truth: Array, command: float, effort: float) -> None:
    """A table and its damper: displacement, acceleration, stroke, force; `effort` is the motor's command (N)."""
    truth[0], truth[1], truth[2], truth[3] = table_lab.advance(lab, command, effort)


def column_scale(plan: Plan) -> float:
    """Columns of the storey that the specimen stands for."""
    return float(plan.column.represents)


def table_scale(plan: Plan) -> float:
    """Scale of the damper's force; zero where the building does without the damper."""
    return plan.damper.force_scale if plan.control.amd else 0.0


COLUMN = Kind(
    "column",
    ColumnLab,
    build_column,
    advance_column,
    ("actuator_command",),
    MEASURED["master"],
    "column_displacement",
    "column_force",
    column_scale,
)
TABLE = Kind(
    "table",
    TableLab,
    build_table,
    advance_table,
    ("table_command", "damper_command"),
    MEASURED["slave"],
    "table_displacement",
    "damper_force",
    table_scale,
)
KINDS = {kind.name: kind for kind in (COLUMN, TABLE)}


def advance(lab: Any, truth: Array, command: float, effort: float) -> None:
    """Move a laboratory of any kind on by one interval; compiled code only.

    `command` (m) is the transfer system's for the interval's end, `effort` (N) a motor's, 0 where the kind has none;
    what the sensors would read without error then stands in `truth` (channels,).
    """
    raise NotImplementedError("Only compiled kernels move a laboratory of any kind on.")


@overload(advance, jit_options=MERGED, strict=False)  # strict compares annotations too
def _kernel(lab: types.Type, truth: Any, command: Any, effort: Any) -> Callable[..., None] | None:
    """The kernel of a record's class."""
    found = [kind.advance for kind in KINDS.values() if kind.record is getattr(lab, "instance_class", None)]
    return found[0] if found else None
