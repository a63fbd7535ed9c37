"""`python -m simulation.warm`: compile every kernel once, so that no test has to wait for the compiler."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from common.plan.kinds import COLUMN
from common.plan.laboratory_tables import ShakingTable
from common.plan.plan import Plan
from common.plan.read import parse, with_test
from common.signals import default_topics
from laboratories import completeness, device, kinds
from laboratories.identification import actuator, damper, table
from laboratories.identification import device as identified
from laboratories.limits import TickLimits
from laboratories.sensors import readings
from loop import assembly, replay, site, substructure
from loop.closed_loop import simulate
from loop.nominal import limited
from loop.nominal.response import response
from models import cache, compensators, energy_balance, force_correction, preisach
from models.compiled import bound
from models.registry import Array
from models.specimens import fit
from models.system import System
from recorder.encoding import RowEncoder, RowTable
from simulation import compilation
from simulation.sweep.intensity import spectral_acceleration

LAW = preisach.Grid((1.0,), (1.0,), (1.0,))  # of one element, for a kernel's types
SHORT = 0.01  # s: five ticks of the default interval; a kernel is compiled by its first call
TWO_TABLES = "[slave.a]\n[slave.b]\n"


def compile_all() -> None:
    """Compile the kernels of the loops, the simulation and the recorder, then create the file that marks it as done."""
    plan = with_test(Plan(), duration=SHORT)
    ground = np.zeros((2, plan.ticks + 1))
    closed_loops(plan, ground)
    alone = replace(plan, control=replace(plan.control, amd=False))
    response(alone, ground)
    still, drive = np.zeros(plan.ticks), np.zeros((plan.ticks, 2))
    for kind in kinds.KINDS.values():
        replay.laboratory(kind, System(plan), drive)
    replay.column(System(plan), still)
    replay.building(System(plan), ground, still, still, still)
    ticks(plan, ground)
    of_users(drive)
    recorded(plan.storeys)
    examined(drive)
    (cache.folder() / cache.READY).touch()


def closed_loops(plan: Plan, ground: Array) -> None:
    """The rollouts with kernels of their own, of one table at a slave, two tables and other kinds, and the motion's."""
    tables = with_test(parse(TWO_TABLES, Path()), duration=SHORT)
    columns = replace(plan, slave=replace(plan.slave, kind=COLUMN))
    for one in (plan, tables, columns):
        simulate(one, ground)
    spectral_acceleration(ground[0], plan.test.interval, 0.5, 0.05)


def ticks(plan: Plan, ground: Array) -> None:
    """The kernels that the loops call at every tick."""
    building = assembly.build(plan, ground)
    bound(substructure.enter, building, 0, 0.0, 0.0)
    bound(substructure.enter_building, building, 0, 0.0)
    balance = energy_balance.build(plan.test.interval, 0.5, 1.0, 1.0, np.ones(1), np.ones(2))
    bound(energy_balance.enter, balance, 0.0, 0.0, 0.0, 0.0)
    for kind in kinds.KINDS.values():
        kind.mover(kind.build(System(plan)))
    readings.step(readings.build(plan.test.interval, ("any",), {}), 0, 0.0, 0.0, 0.0)
    none = compensators.build("none", {}, plan.test.interval)
    bound(compensators.enter, none, *compensators.STILL, plan.test.interval)
    force_correction.step(1.0, 0.0, np.zeros(2), 0.0)
    TickLimits(None, plan, [], commands=0).violation(0.0)


def recorded(storeys: int) -> None:
    """The kernels with which the recorder encodes and checks rows."""
    topics = default_topics()
    RowEncoder(topics, dict.fromkeys(topics, 1), storeys)
    table = RowTable(topics, storeys)
    table.sound(table.names[:1], [bytes(table.sizes[table.names[0]])], 1)


def of_users(drive: Array) -> None:
    """The kernels that call a device of a user; `drive` (ticks, 2) as `replay.laboratory` takes it."""
    lab, truth = kinds.nothing().device, np.zeros(1)
    bound(device.enter_device, lab, truth, 0.0, 0.0)
    completeness.driven(lab.step, lab.parameters, lab.state, truth, 0.0, 1)
    site.play(site.none(len(drive))._replace(lab=lab), drive, 1.0, 0, len(drive))


def examined(drive: Array) -> None:
    """The kernels with which recordings are examined, and laws and laboratories fitted to them."""
    of_recording, alone, truth = drive[:, 0], drive[:, 0].copy(), np.zeros(1)
    for column in (of_recording, alone):
        limited.peak(column)
        limited.largest_steps(column)
        limited.largest_lasting(column, column, 0)
        preisach.features(preisach.pack(LAW, 1.0, 1.0), column, alone)
    fit.forces("linear", {"stiffness": 1.0}, alone)
    actuator.response(alone, SHORT, 0.0, SHORT)
    table.response(alone, SHORT, ShakingTable())
    damper.response(np.ones(len(damper.NAMES)), alone, alone, SHORT)
    identified.response(kinds.nothing().device, alone, alone, truth.size)


if __name__ == "__main__":
    if not cache.warm():
        with compilation.noticed():
            compile_all()
    sys.stderr.write(f"kernels compiled into {cache.folder()}\n")
