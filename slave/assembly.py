"""Everything the slave's loop is made of, built and warmed up before anything moves."""

from __future__ import annotations

import secrets
from functools import partial
from typing import Any

from common.lab.laboratory import Setting
from common.lab.preflight import Check, Gate, SensorsAtRest
from common.plan import schema
from common.plan.plan import Plan
from common.plan.plugins import construct, find
from common.plan.reality import Reality
from common.rig import METHODS, AtRest, GuardedRig, TableMeasurement
from common.roles import name_of, title
from laboratories.sensors import noise, readings
from laboratories.table import model as table_lab
from laboratories.table.kind import TABLE
from loop.links import link_model
from loop.realised import true_system
from models.compiled import plain
from slave.loop import NO_COMMAND, SlaveLoop
from slave.rig import TableLab
from slave.step import SlaveStep


def preflight(_plan: Plan) -> list[Check]:
    """The master judges the test as a whole; a slave its own rig, as it arms."""
    return []


def build_rig(reality: Reality, at_rest: AtRest | None = None) -> GuardedRig:
    """A slave's laboratory as the plan and its reality have it, judged `at_rest` as it is armed.

    Raises:
        InputError: it cannot be constructed.
    """
    plan, rig, where = reality.plan, reality.slave, f"[{reality.role}.rig]"
    lab = f"laboratory B of the {title(reality.role)}" if name_of(reality.role) else "laboratory B"
    arguments: dict[str, Any] = {
        "interval": plan.test.interval,
        "seed": noise.lab_seed(reality.seed, noise.LAB_B + reality.place),
    }
    if not rig.class_:
        system = true_system(reality)
        plan = system.plan
        arguments |= {"effects": system.effects}
        arguments |= {name: schema.plain(getattr(plan, name)) for name in ("table", "damper", "sensors")}
        twin = partial(TableLab, **arguments)
        return GuardedRig(twin(), lab, TableMeasurement, at_rest=at_rest, twin=twin)
    kind = find(rig.class_, reality.base, where)
    name = lab if reality.role in reality.hidden else f"{lab} ({kind.__name__})"
    built = construct(kind, arguments | rig.options, where, METHODS)
    hidden = reality.role in reality.hidden
    return GuardedRig(built, name, TableMeasurement, hidden=hidden, at_rest=at_rest)


def check(reality: Reality) -> None:
    """Raise InputError where a slave's laboratory could not be built; nothing of it is constructed or moved."""
    TABLE.build(true_system(reality))
    SlaveStep(reality.plan)
    if reality.slave.class_:
        find(reality.slave.class_, reality.base, f"[{reality.role}.rig]")


def build_loop(
    setting: Setting, reality: Reality, *, instance: int | None = None, gate: Gate | None = None
) -> SlaveLoop:
    """The loop of the slave whose reality is given, its kernels compiled; the setting's plan is the whole test's.

    The number that tells this process from others of its role is drawn where none is given. With a `gate` its rig's
    sensors must pass it.
    """
    warm_up(reality)
    return SlaveLoop(
        setting,
        build_rig(reality, SensorsAtRest(gate, setting) if gate else None),
        link_model(reality),
        role=reality.role,
        instance=instance if instance is not None else secrets.randbelow(2**62) + 1,
    )


def warm_up(reality: Reality) -> None:
    """Compile the kernels on arrays that are thrown away."""
    table_lab.enter(plain(TABLE.build(true_system(reality))), 0.0, 0.0)
    readings.step(readings.build(reality.plan.test.interval, ("any",), {}), 0, 0.0, 0.0, 0.0)
    SlaveStep(reality.plan)(NO_COMMAND, TableMeasurement(0.0, 0.0, 0.0, 0.0))
