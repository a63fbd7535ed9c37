"""A served test in virtual time with the real drive, loops and recorder, and a client that connects by socket."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from common.errors import RthsError
from common.lab.laboratory import Laboratory
from common.plan.plan import Plan
from common.plan.read import parse
from common.reality.reality import as_planned
from common.recording.reader import read
from common.recording.run import Run
from master.assembly import warm_up_served
from master.client.building import ClientBuilding
from master.client.pace import AsFastAsItGoes, Pace
from simulation import virtual
from tests.serve.client import PATIENCE_S, Script, free_port

IDEAL = """
[test]
name = "served"
duration = 2.0
[structure]
model = "client"
[actuator]
delay = 0.0
time_constant = 0.0
[compensator]
kind = "none"
[sensors]
column_displacement = 0.0
column_force = 0.0
[safety]
hold_after = 3
ramp_after = 5
overrun = 5
settle = 0.01
"""
ALONE = '[slave]\nkind = "none"\n'


class Ticking(Pace):
    """As in real time a tick ends whether the client has spoken or not; here after some ms of the wall clock."""

    settles = True
    eager = 0

    def __init__(self, seconds: float = 0.1) -> None:
        self._seconds = seconds

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """What is left of the tick's share."""
        end = time.monotonic() + self._seconds
        return lambda: end - time.monotonic()

    def fair(self, lab: Laboratory, tick: int, since_ns: int) -> bool:
        """The share is whole at the begin of each tick."""
        return True

    def over(self) -> None:
        """The watchdog counts."""


class Served(NamedTuple):
    """How a test ended, its recording, and the client."""

    error: RthsError | None
    run: Run
    client: Script

    def said(self, code: str) -> list[str]:
        """The texts of events of a code."""
        return [event["text"] for event in self.run.events if event["code"] == code]

    def warned(self) -> list[str]:
        """The warnings about clients that were turned away."""
        found = (event for event in self.run.events if event["code"] == "client")
        return [event["text"] for event in found if event["level"] == "warning"]


def plan_of(text: str = ALONE) -> Plan:
    """An ideal laboratory that is served."""
    return parse(IDEAL + text, Path())


def serve(
    script: Callable[..., None],
    folder: Path,
    plan: Plan | None = None,
    pace: Pace | None = None,
    elements: int = 1,
) -> Served:
    """Serve a client, whose `script` is given its ports, one for each of its elements, to the end."""
    chosen, numbers = plan or plan_of(), [free_port() for _ in range(elements)]
    warm_up_served(as_planned(chosen))  # which takes its time where nothing is compiled yet
    addresses = [f"127.0.0.1:{number}" for number in numbers]
    building = ClientBuilding(chosen, addresses, pace or AsFastAsItGoes(PATIENCE_S, str))
    client, end = Script(lambda: script(*numbers)), time.monotonic() + PATIENCE_S
    while building.awaited and time.monotonic() < end:
        building.look_after()
    assert not building.awaited
    bench = virtual.assemble(chosen, as_planned(chosen), folder / "test.mcap", building=building)
    error = virtual.run(bench, str)
    client.join(PATIENCE_S)
    assert not client.is_alive()
    return Served(error, read(folder / "test.mcap"), client)
