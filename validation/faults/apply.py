"""A schedule's faults put into a simulated test."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from common.link.transport import TICK
from common.plan import read as plans
from common.plan.patience import strict
from common.plan.plan import Plan
from common.reality.reality import as_planned
from common.terminal import cli
from simulation.world import Drift
from validation.faults import hostile
from validation.faults.lab import SESSION, Simulation, Surrounding
from validation.faults.rigs import Wrong
from validation.faults.schedule import KINDS, PROCESS, RIG, InjectedFault, Schedule
from validation.faults.wire import DROPS, OPEN, QUEUES, Conditions, WireRoute

STATES = {"outage": DROPS, "backlog": QUEUES}


def plan_of(schedule: Schedule) -> Plan:
    """The plan of a scheduled test, which requires a recorder where it is recorded; its timeouts are those of rigs."""
    plan = strict(plans.with_test(plans.load(cli.plan_path(schedule.plan)), duration=schedule.duration))
    tables = plan.tables()
    tables["recording"]["required"] = schedule.recorded
    return plans.from_tables(tables, Path())


def simulation_of(schedule: Schedule, recording: Path | None = None) -> Simulation:
    """The test of a schedule with all its faults prepared; recorded into `recording` if the schedule is recorded."""
    drifts = {
        fault.where: Drift(round(fault.parameters["offset"] * 1e9), round(fault.parameters["ppm"] * 1e3))
        for fault in schedule.faults
        if fault.kind == "clock"
    }
    plan = plan_of(schedule)
    surrounding = Surrounding(
        schedule.seed, drifts=drifts, recording=recording if schedule.recorded else None
    )
    simulation = Simulation(plan, as_planned(plan), surrounding)
    for place, fault in enumerate(schedule.faults):
        lay(simulation, fault, schedule.seed, place)
    return simulation


def lay(simulation: Simulation, fault: InjectedFault, seed: int, place: int) -> None:
    """Prepare a fault; `place` distinguishes the faults of one schedule."""
    where = KINDS[fault.kind].where
    if where == PROCESS:
        _befall_process(simulation, fault)
    elif where == RIG:
        _befall_rig(simulation, fault, place)
    else:
        for direction in directions(simulation, fault.where):
            if KINDS[fault.kind].lasts is None:
                simulation.world.at(ns(fault.at), _intrude, simulation, direction, fault, seed)
            else:
                _impair(simulation, direction, fault, place)


def ns(seconds: float) -> int:
    """Seconds in ns."""
    return round(seconds * 1e9)


def directions(simulation: Simulation, where: str) -> list[WireRoute]:
    """The routes that `A>B` or `A<>B` names."""
    first, second = re.split(r"<>|>", where)
    there = simulation.wire.between(first, second)
    return there + simulation.wire.between(second, first) if "<>" in where else there


def _befall_process(simulation: Simulation, fault: InjectedFault) -> None:
    process, at = simulation.world.processes[fault.where], ns(fault.at)
    match fault.kind:
        case "stall":
            simulation.world.at(at, process.stall, ns(fault.duration))
        case "kill":
            simulation.world.at(at, process.kill)
        case "stop":
            simulation.world.at(at, process.stop, "stopped by the user (SIGINT).")
        case _:
            pass  # a clock differs from the beginning


def _befall_rig(simulation: Simulation, fault: InjectedFault, key: int) -> None:
    probe, values = simulation.probes[fault.where], fault.parameters
    wrong = Wrong(fault.kind, int(values.get("place", 0)), values.get("by", 0.0))
    simulation.world.at(ns(fault.at), probe.set_wrong, key, wrong)
    simulation.world.at(ns(fault.at + fault.duration), probe.set_right, key)


def _impair(simulation: Simulation, direction: WireRoute, fault: InjectedFault, key: int) -> None:
    values: dict[str, Any] = dict(fault.parameters)
    conditions = Conditions(**values, state=STATES.get(fault.kind, OPEN))
    simulation.world.at(ns(fault.at), direction.lay, key, conditions)
    simulation.world.at(ns(fault.at + fault.duration), direction.lift, key)


def _intrude(simulation: Simulation, direction: WireRoute, fault: InjectedFault, seed: int) -> None:
    """Put frames on a route that no loop sends at this time."""
    plan, count = simulation.plan, int(fault.parameters.get("count", 0))
    match fault.kind:
        case "replay":
            direction.again(count)
        case "garbage":
            direction.put(hostile.garbage(count, np.random.default_rng([seed, direction.seed])))
        case "forged" if direction.route.channel == TICK:
            direction.put(hostile.forged(direction, plan, SESSION, count))
        case "foreign" if direction.route.channel == TICK:
            direction.put(hostile.foreign(direction, plan, count))
        case "insider":
            letter = hostile.insider(direction, plan, SESSION, int(fault.parameters["what"]))
            if letter is not None:
                simulation.strangers.add(direction.hearer.role)
                direction.put([letter])
        case _:
            pass
