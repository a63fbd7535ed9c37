"""The kinds of laboratory by name, those of users included, and the kernel that moves a laboratory of any kind on.

A laboratory at work is a record of arrays. The compiled loop chooses the kernel by the record's class, so that
laboratories of different kinds stand in one loop without a table of functions at run time. All kinds of users share one
record, which carries its kernel as an address: no kernel of the loop has to be compiled anew for them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

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
from laboratories.device import Device, DeviceRecord, advance_device
from laboratories.kind import Kind
from laboratories.table.kind import TABLE
from models.compiled import MERGED
from models.registry import Array

KINDS: dict[str, Kind] = {kind.name: kind for kind in (COLUMN, TABLE)}
"""The kinds that ship, by the names that a plan gives them."""


class NoLaboratory(NamedTuple):
    """At the place of a master that has no laboratory."""

    nothing: float


def rest(lab: NoLaboratory, truth: Array, command: float, effort: float) -> None:
    """Nothing moves where there is no laboratory."""


KERNELS: dict[type[Any], Callable[..., None]] = {kind.record: kind.advance for kind in KINDS.values()} | {
    DeviceRecord: advance_device,
    NoLaboratory: rest,
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
    return {role: kind_of(plan, role) for role in plan.kinds}


def topics(plan: Plan) -> dict[str, tuple[Signal, ...]]:
    """What a recording of the plan's test holds; raises InputError as `kind_of`, or as `common.signals.topics`."""
    return signals.topics({role: kind.channels for role, kind in kinds_of(plan).items()})


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
