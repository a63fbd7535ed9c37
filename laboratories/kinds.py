"""The kinds of laboratory by name, those of users included, and the kernel that moves a laboratory of any kind on.

A laboratory at work is a record of arrays. Compiled code chooses the kernel by the record's class, so that it holds the
kernels that it needs and no table of functions at run time. All kinds of users share one record, which carries its
kernel as an address, and `AnyLab` holds a laboratory of whichever kind: a loop that is compiled for it serves every
combination of kinds, and none has to be compiled anew.
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
from laboratories.table.model import TableLab
from models.compiled import MERGED
from models.registry import Array
from models.system import System

KINDS: dict[str, Kind] = {kind.name: kind for kind in (COLUMN, TABLE)}
"""The kinds that ship, by the names that a plan gives them."""


COLUMN_AT, TABLE_AT, DEVICE_AT, NOTHING = range(4)  # places of the records of `AnyLab`


class AnyLab(NamedTuple):
    """A laboratory of whichever kind, or none: one record is at work, the others have no meaning."""

    place: int  # which one it is; NOTHING where there is no laboratory
    column: ColumnLab
    table: TableLab
    device: DeviceRecord


def advance_any(lab: AnyLab, truth: Array, command: float, effort: float) -> None:
    """One interval of the record that is at work."""
    if lab.place == COLUMN_AT:
        advance(lab.column, truth, command, effort)
    elif lab.place == TABLE_AT:
        advance(lab.table, truth, command, effort)
    elif lab.place == DEVICE_AT:
        advance(lab.device, truth, command, effort)


def as_any(lab: Any) -> AnyLab:
    """The record of a laboratory at work as one of whichever kind."""
    if isinstance(lab, AnyLab):
        return lab
    place, name = PLACES[type(lab)]
    return nothing()._replace(place=place, **{name: lab})


@cache
def nothing() -> AnyLab:
    """No laboratory; its records are of the standard plan, and stand there for their types alone."""
    system = System(Plan())
    device = DeviceRecord(cfunc(KERNEL, cache=True)(still), np.zeros(1), np.zeros(0))
    return AnyLab(NOTHING, COLUMN.build(system), TABLE.build(system), device)


PLACES = {
    ColumnLab: (COLUMN_AT, "column"),
    TableLab: (TABLE_AT, "table"),
    DeviceRecord: (DEVICE_AT, "device"),
}


def still(parameters: Array, state: Array, truth: Array, command: float, effort: float) -> None:
    """The step of a device that is not there."""


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
        raise InputError(f"The plan gives the {role} no laboratory: look at its kind.")
    return named(plan.kinds[role], plan.base, f"[{role}] kind")


def kinds_of(plan: Plan) -> dict[str, Kind]:
    """The kind of every role that has a laboratory, the master's first; raises InputError as `kind_of`."""
    return dict(_hosted(tuple(plan.kinds.items()), plan.base))


def topics(plan: Plan) -> dict[str, tuple[Signal, ...]]:
    """What a recording of the plan's test holds; raises InputError as `kind_of`, or as `common.signals.topics`."""
    return dict(_topics(tuple(plan.kinds.items()), plan.base))


@cache
def _hosted(names: tuple[tuple[str, str], ...], base: Path) -> dict[str, Kind]:
    """The kind of every role by the names that a plan gives them; one of the user's is loaded once."""
    return {role: named(name, base, f"[{role}] kind") for role, name in names}


@cache
def _topics(names: tuple[tuple[str, str], ...], base: Path) -> dict[str, tuple[Signal, ...]]:
    """What is recorded of laboratories of these names by role."""
    return signals.topics({role: kind.channels for role, kind in _hosted(names, base).items()})


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
    """Move a laboratory of any kind on by one interval; compiled code only.

    `command` (m) is the transfer system's for the interval's end, `effort` (N) a motor's, 0 where the kind has none;
    what the sensors would read without error then stands in `truth` (channels,).
    """
    raise NotImplementedError("Only compiled kernels move a laboratory of any kind on.")


@overload(advance, jit_options=MERGED, strict=False)  # strict compares annotations too
def _kernel(lab: types.Type, truth: Any, command: Any, effort: Any) -> Callable[..., None] | None:
    """The kernel of a record's class."""
    return KERNELS.get(getattr(lab, "instance_class", None))  # type: ignore[arg-type]
