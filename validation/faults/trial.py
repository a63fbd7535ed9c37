"""One schedule played and judged."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import NamedTuple

from validation.faults.apply import simulation_of
from validation.faults.invariants import InvariantViolation, judge
from validation.faults.lab import Simulation
from validation.faults.schedule import Schedule


class TrialResult(NamedTuple):
    """The result of a schedule; `ends` is the state of the protocol in which each laboratory ended."""

    schedule: Schedule
    violations: list[InvariantViolation]
    virtual_time: float  # s
    digest: str  # of every command at every rig
    ends: dict[str, str]
    course: list[str]  # the laboratories' events, a line each


def play(schedule: Schedule) -> TrialResult:
    """Simulate a schedule and judge it; a recording is read and deleted."""
    with tempfile.TemporaryDirectory(prefix="rths-faults-") as folder:
        simulation = simulation_of(schedule, Path(folder) / "test.mcap")
        simulation.run()
        return TrialResult(
            schedule,
            judge(simulation),
            simulation.world.time * 1e-9,
            simulation.digest(),
            {role: end_of(simulation, role) for role in simulation.loops},
            course(simulation),
        )


def end_of(simulation: Simulation, role: str) -> str:
    """The state in which a laboratory ended."""
    if simulation.world.processes[role].killed:
        return "killed"
    return simulation.loops[role].lab.exchange.state.value


def course(simulation: Simulation) -> list[str]:
    """Every laboratory's events in the order of world time."""
    told = sorted(
        (item.time, role, item.data["text"]) for role, items in simulation.events.items() for item in items
    )
    ends = [f"{role} ended: {end_of(simulation, role)}" for role in simulation.loops]
    return [f"{time * 1e-9:9.4f} s  {role}: {text}" for time, role, text in told] + ends
