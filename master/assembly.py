"""Everything the master's loop is made of, built and warmed up before anything moves."""

from __future__ import annotations

import secrets
from typing import Any

from common import schema
from common.clock import unix_ns
from common.laboratory import Setting
from common.mailbox import LinkModel
from common.plugins import construct, find
from common.reality import Reality
from common.rig import ColumnMeasurement, GuardedRig
from master.loop import MasterLoop
from master.rig import ColumnLab
from master.step import MasterStep
from models import substructure
from models.labs import column_lab, noise
from models.registry import Array


def build_rig(reality: Reality) -> GuardedRig:
    """Laboratory A as the plan and the reality have it; raises InputError where it cannot be constructed."""
    plan, rig = reality.plan, reality.master
    arguments: dict[str, Any] = {
        "interval": plan.test.interval,
        "seed": noise.lab_seed(reality.seed, noise.LAB_A),
    }
    if not rig.class_:
        arguments |= {name: schema.plain(getattr(plan, name)) for name in ("actuator", "column", "sensors")}
        return GuardedRig(ColumnLab(**arguments), "laboratory A", ColumnMeasurement)
    kind = find(rig.class_, reality.base, "[master.rig]")
    name = "laboratory A" if "master" in reality.hidden else f"laboratory A ({kind.__name__})"
    return GuardedRig(construct(kind, arguments | rig.options, "[master.rig]"), name, ColumnMeasurement)


def check(reality: Reality) -> None:
    """Raise InputError where the laboratory could not be built; nothing of it is constructed or moved."""
    plan = reality.plan
    MasterStep(plan, true_ground(reality))
    column_lab.build(plan.test.interval, plan.actuator, plan.column)
    if reality.master.class_:
        find(reality.master.class_, reality.base, "[master.rig]")


def true_ground(reality: Reality) -> Array:
    """Ground motion that really comes, as the master's kernel takes it."""
    return substructure.ground_rows(reality.plan, substructure.motion(reality.plan))


def build_loop(
    setting: Setting,
    reality: Reality,
    link: LinkModel,
    *,
    session: int | None = None,
    epoch_ns: int | None = None,
) -> MasterLoop:
    """The master's loop, its kernels compiled; session and epoch are drawn and read where none are given."""
    ground = true_ground(reality)
    warm_up(reality, ground)
    return MasterLoop(
        setting,
        build_rig(reality),
        MasterStep(reality.plan, ground),
        link,
        session=session if session is not None else secrets.randbelow(2**62) + 1,
        epoch_ns=epoch_ns if epoch_ns is not None else unix_ns(),
    )


def warm_up(reality: Reality, ground: Array) -> None:
    """Compile the kernels on arrays that are thrown away."""
    plan = reality.plan
    MasterStep(plan, ground)(0, 0.0, 0.0, 0.0)
    column_lab.advance(*column_lab.build(plan.test.interval, plan.actuator, plan.column), 0.0)
