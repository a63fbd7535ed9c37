"""The kinds of laboratory by name, those of users included, and the kernel that advances a laboratory of any kind.

A laboratory's state and constants are a record of arrays. Compiled code chooses the kernel by the record's class, so
that it contains only the kernels that it needs and no table of functions at run time. All users' kinds share one class
of record, which holds its kernel as an address. `AnyLab` holds a laboratory of any kind: a loop compiled for it serves
all combinations of kinds without being compiled again.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import cfunc
from numba.core import types
from numba.extending import overload

from common import signals
from common.errors import InputError
from common.plan.plan import Plan
from common.plan.plugins import construct, find
from common.roles import MASTER
from common.signals import Signal
from laboratories import completeness
from laboratories.column.kind import COLUMN
from laboratories.column.model import ColumnLab
from laboratories.completeness import KERNEL
from laboratories.device import Device, DeviceRecord, advance_device
from laboratories.kind import Kind
from laboratories.table.kind import TABLE
from laboratories.table.record import TableLab
from models.compiled import MERGED
from models.registry import Array
from models.system import System

KINDS: dict[str, Kind] = {kind.name: kind for kind in (COLUMN, TABLE)}
"""The kinds that ship, by the names that a plan gives them."""


COLUMN_AT, TABLE_AT, DEVICE_AT, NOTHING = range(4)  # values of `AnyLab.place`


class AnyLab(NamedTuple):
    """A laboratory of any kind, or none: one of its records is used, the others have no meaning."""

    place: int  # which one it is; NOTHING where there is no laboratory
    column: ColumnLab
    table: TableLab
    device: DeviceRecord


def advance_any(lab: AnyLab, truth: Array, command: float, effort: float) -> None:
    """Advance the record that is used by one interval."""
    if lab.place == COLUMN_AT:
        advance(lab.column, truth, command, effort)
    elif lab.place == TABLE_AT:
        advance(lab.table, truth, command, effort)
    elif lab.place == DEVICE_AT:
        advance(lab.device, truth, command, effort)


def as_any(lab: Any) -> AnyLab:
    """A laboratory's record as `AnyLab`."""
    if isinstance(lab, AnyLab):
        return lab
    place, name = PLACES[type(lab)]
    return nothing()._replace(place=place, **{name: lab})


@cache
def nothing() -> AnyLab:
    """No laboratory; its records, of the default plan, are needed for their types only."""
    system = System(Plan())
    device = DeviceRecord(cfunc(KERNEL, cache=True)(still), np.zeros(1), np.zeros(0))
    return AnyLab(NOTHING, COLUMN.build(system), TABLE.build(system), device)


PLACES = {
    ColumnLab: (COLUMN_AT, "column"),
    TableLab: (TABLE_AT, "table"),
    DeviceRecord: (DEVICE_AT, "device"),
}


def still(parameters: Array, state: Array, truth: Array, command: float, effort: float) -> None:
    """The step of a missing device, which does nothing."""


KERNELS: dict[type[Any], Callable[..., None]] = {kind.record: kind.advance for kind in KINDS.values()} | {
    DeviceRecord: advance_device,
    AnyLab: advance_any,
}


def kind_of(plan: Plan, role: str) -> Kind:
    """The kind of laboratory that a role of the plan hosts.

    Raises:
        InputError: it hosts none, or the class that the plan names cannot be loaded or is no kind.
    """
    if role not in plan.kinds:
        raise InputError(f"The plan gives the {role} no laboratory: set its kind to another than 'none'.")
    return named(plan.kinds[role], plan.base, f"[{role}] kind")


def kinds_of(plan: Plan) -> dict[str, Kind]:
    """The kind of every role that has a laboratory, the master's first; raises InputError as `kind_of`."""
    return dict(_hosted(tuple(plan.kinds.items()), plan.base))


def topics(plan: Plan) -> dict[str, tuple[Signal, ...]]:
    """The topics of a recording of the plan's test; raises InputError as `kind_of`, or as `common.signals.topics`."""
    return dict(_topics(tuple(plan.kinds.items()), plan.base, plan.served))


@cache
def _hosted(names: tuple[tuple[str, str], ...], base: Path) -> dict[str, Kind]:
    """The kind of every role by the names that a plan gives them; one of the user's is loaded once."""
    return {role: named(name, base, f"[{role}] kind") for role, name in names}


@cache
def _topics(names: tuple[tuple[str, str], ...], base: Path, served: bool) -> dict[str, tuple[Signal, ...]]:
    """The topics of a recording of laboratories whose kinds have these names, by role."""
    return signals.topics({role: kind.channels for role, kind in _hosted(names, base).items()}, served=served)


def own(plan: Plan) -> Kind | None:
    """The kind that the master hosts, None where it has no laboratory; raises InputError as `kind_of`."""
    return kind_of(plan, MASTER) if MASTER in plan.kinds else None


def named(name: str, base: Path, where: str) -> Kind:
    """The kind of that name, or the class 'file.py:Class', whose path starts from `base`; `where` stands in errors.

    Raises:
        InputError: the class cannot be loaded or is no kind.
    """
    return KINDS[name] if name in KINDS else _loaded(name, base, where)


@cache
def _loaded(reference: str, base: Path, where: str) -> Kind:
    found = find(reference, base, where)
    if not issubclass(found, Device):
        raise InputError(
            f"{found.__name__} named in {where} is no kind of laboratory: derive it from laboratories.device.Device."
        )
    kind: Device = construct(found, {}, where)
    completeness.complete(kind, where)
    return kind


def advance(lab: Any, truth: Array, command: float, effort: float) -> None:
    """Advance a laboratory of any kind by one interval; for compiled code only.

    `command` (m) is the transfer system's for the interval's end, `effort` (N) the motor's, 0 for a kind without one.
    The readings of sensors without error at the interval's end are written into `truth` (channels,).
    """
    raise NotImplementedError("Only compiled code can advance a laboratory of any kind.")


@overload(advance, jit_options=MERGED, strict=False)  # strict compares annotations too
def _kernel(lab: types.Type, truth: Any, command: Any, effort: Any) -> Callable[..., None] | None:
    """The kernel of a record's class."""
    return KERNELS.get(getattr(lab, "instance_class", None))  # type: ignore[arg-type]
