"""Everything the slave's loop is made of, built and warmed up before anything moves."""

from __future__ import annotations

from typing import Any

from common import schema
from common.laboratory import Setting
from common.mailbox import LinkModel
from common.plugins import construct, find
from common.reality import Reality
from common.rig import GuardedRig, TableMeasurement
from models.closed_loop import build_b
from models.labs import noise, readings, table_lab
from models.realised import true_system
from slave.loop import NO_COMMAND, SlaveLoop
from slave.rig import TableLab
from slave.step import SlaveStep


def build_rig(reality: Reality) -> GuardedRig:
    """Laboratory B as the plan and the reality have it; raises InputError where it cannot be constructed."""
    plan, rig = reality.plan, reality.slave
    arguments: dict[str, Any] = {
        "interval": plan.test.interval,
        "seed": noise.lab_seed(reality.seed, noise.LAB_B),
    }
    if not rig.class_:
        system = true_system(reality)
        plan = system.plan
        arguments |= {"effects": system.effects}
        arguments |= {name: schema.plain(getattr(plan, name)) for name in ("table", "damper", "sensors")}
        return GuardedRig(TableLab(**arguments), "laboratory B", TableMeasurement)
    kind = find(rig.class_, reality.base, "[slave.rig]")
    name = "laboratory B" if "slave" in reality.hidden else f"laboratory B ({kind.__name__})"
    return GuardedRig(construct(kind, arguments | rig.options, "[slave.rig]"), name, TableMeasurement)


def check(reality: Reality) -> None:
    """Raise InputError where the laboratory could not be built; nothing of it is constructed or moved."""
    build_b(true_system(reality))
    SlaveStep(reality.plan)
    if reality.slave.class_:
        find(reality.slave.class_, reality.base, "[slave.rig]")


def build_loop(setting: Setting, reality: Reality, link: LinkModel) -> SlaveLoop:
    """The slave's loop, its kernels compiled."""
    plan = reality.plan
    table_lab.advance(*build_b(true_system(reality)), 0.0, 0.0)
    readings.step(*readings.build(plan.test.interval, ("any",), {}), 0, 0.0, 0.0, 0.0)
    SlaveStep(plan)(NO_COMMAND, TableMeasurement(0.0, 0.0, 0.0, 0.0))
    return SlaveLoop(setting, build_rig(reality), link)
