"""Everything the master's loop is made of, built and warmed up before anything moves."""

from __future__ import annotations

import secrets
from functools import partial
from typing import Any

from common.host.clock import unix_ns
from common.lab.laboratory import Setting
from common.lab.preflight import Check, Gate, SensorsAtRest
from common.plan import schema
from common.plan.plan import Plan
from common.plan.plugins import construct, find
from common.plan.reality import Reality
from common.rig import METHODS, AtRest, ColumnMeasurement, GuardedRig
from laboratories.column import model as column_lab
from laboratories.column.kind import COLUMN
from laboratories.sensors import noise, readings
from loop import substructure
from loop.links import link_model
from loop.nominal import preflight as nominal
from loop.realised import true_system
from master.limits import MasterLimits
from master.loop import MasterLoop
from master.rig import ColumnLab
from master.step import MasterStep
from models.compiled import plain
from models.registry import Array
from models.system import System


def preflight(plan: Plan) -> list[Check]:
    """What nominal models say of the test before anything is built; raises InputError where they cannot be."""
    return nominal.checks(plan)


def build_rig(reality: Reality, at_rest: AtRest | None = None) -> GuardedRig:
    """Laboratory A as the plan and the reality have it, judged `at_rest` as it is armed.

    Raises:
        InputError: it cannot be constructed.
    """
    plan, rig = reality.plan, reality.master
    arguments: dict[str, Any] = {
        "interval": plan.test.interval,
        "seed": noise.lab_seed(reality.seed, noise.LAB_A),
    }
    if not rig.class_:
        system = true_system(reality)
        plan = system.plan
        arguments |= {"effects": system.effects}
        arguments |= {name: schema.plain(getattr(plan, name)) for name in ("actuator", "column", "sensors")}
        twin = partial(ColumnLab, **arguments)
        return GuardedRig(twin(), "laboratory A", ColumnMeasurement, at_rest=at_rest, twin=twin)
    kind = find(rig.class_, reality.base, "[master.rig]")
    name = "laboratory A" if "master" in reality.hidden else f"laboratory A ({kind.__name__})"
    built = construct(kind, arguments | rig.options, "[master.rig]", METHODS)
    return GuardedRig(built, name, ColumnMeasurement, hidden="master" in reality.hidden, at_rest=at_rest)


def check(reality: Reality) -> None:
    """Raise InputError where the laboratory could not be built; nothing of it is constructed or moved."""
    master_step(reality)
    COLUMN.build(true_system(reality))
    if reality.master.class_:
        find(reality.master.class_, reality.base, "[master.rig]")


def master_step(reality: Reality) -> MasterStep:
    """The master's computation for the building and the ground motion that really are."""
    system = true_system(reality)
    return MasterStep(system.plan, true_ground(system), system.effects.p_delta)


def true_ground(system: System) -> Array:
    """Ground motion that really comes, as the master's kernel takes it."""
    return substructure.ground_rows(system.plan, substructure.motion(system.plan), system.effects.time_shift)


def build_loop(
    setting: Setting,
    reality: Reality,
    *,
    session: int | None = None,
    epoch_ns: int | None = None,
    gate: Gate | None = None,
) -> MasterLoop:
    """The master's loop, its kernels compiled; session and epoch are drawn and read where none are given.

    With a `gate` its rig's sensors must pass it.
    """
    warm_up(reality)
    return MasterLoop(
        setting,
        build_rig(reality, SensorsAtRest(gate, setting) if gate else None),
        master_step(reality),
        {role: link_model(reality.of(role)) for role in setting.plan.roles},
        session=session if session is not None else secrets.randbelow(2**62) + 1,
        epoch_ns=epoch_ns if epoch_ns is not None else unix_ns(),
        gate=gate,
    )


def warm_up(reality: Reality) -> None:
    """Compile the kernels on arrays that are thrown away."""
    outputs = master_step(reality)(0, 0.0, 0.0, [0.0] * len(reality.plan.roles))
    MasterLimits(reality.plan).violation(ColumnMeasurement(0.0, 0.0), outputs)
    column_lab.enter(plain(COLUMN.build(true_system(reality))), 0.0)
    readings.step(readings.build(reality.plan.test.interval, ("any",), {}), 0, 0.0, 0.0, 0.0)
