from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from common.errors import LostError
from common.host.clock import VirtualClock
from common.lab.laboratory import SLOW_RIG, Laboratory, Setting
from common.link.memory_link import MemoryHub
from common.plan.plan import Plan
from common.protocol.messages import Trip
from common.rig import GuardedRig, TableCommand, TableMeasurement
from common.safety.modes import Turn
from common.signals import TOPICS

MS = 1_000_000


class Slow:
    """A rig whose calls advance the virtual clock."""

    def __init__(self, clock: VirtualClock, read_ms: float, write_ms: float) -> None:
        self.clock, self.read_ms, self.write_ms = clock, read_ms, write_ms

    def arm(self) -> None: ...

    def read(self) -> Any:
        self.clock.time += round(self.read_ms * MS)
        return 0.0, 0.0, 0.0, 0.0

    def write(self, command: Any) -> None:
        self.clock.time += round(self.write_ms * MS)

    def disarm(self) -> None: ...


def laboratory(plan: Plan, read_ms: float, write_ms: float, ticks: int, role: str = "slave") -> Laboratory:
    """A running laboratory after some ticks of a rig."""
    clock = VirtualClock()
    lab = Laboratory(role, Setting(plan, MemoryHub(plan.roles).join(role, clock), clock), TOPICS)
    lab.enter(1)
    for turn in (Turn.CONFIGURE, Turn.ARM, Turn.RUN):
        lab.safety.take(turn)
    rig = GuardedRig(Slow(clock, read_ms, write_ms), "laboratory B (Slow)", TableMeasurement)
    lab.watch(rig)
    for _ in range(ticks):
        rig.read()
        rig.write(TableCommand(0.0, 0.0))
    return lab


@pytest.mark.parametrize(
    ("read_ms", "write_ms", "sentence"),
    [
        (5.0, 0.1, "read() took 5.0 ms of the interval's 2 ms"),
        (0.1, 5.0, "write() took 5.0 ms of the interval's 2 ms"),
        (1.5, 1.6, "read() and write() took 3.1 ms of the interval's 2 ms"),
    ],
)
def test_a_slow_rig_is_named_when_its_own_loop_or_the_other_laboratory_trips(
    short_plan: Plan, read_ms: float, write_ms: float, sentence: str
) -> None:
    missed = Trip(1, "master", "lost", "No valid feedback from laboratory B for 10 ms.")
    notices: list[Callable[[Laboratory], object]] = [
        lambda lab: lab.overrun(12 * MS, 5),
        lambda lab: lab.silent("master", 5),
        lambda lab: lab.tripped("master", missed, 5),
    ]
    for notice in notices:
        lab = laboratory(short_plan, read_ms, write_ms, 6)
        notice(lab)
        assert str(lab.error).startswith(f"laboratory B (Slow): {sentence}, so ")
        assert lab.error is not None
        assert lab.error.exit_code == 3


def test_a_rig_that_answers_in_time_is_not_named_as_the_cause(short_plan: Plan) -> None:
    lab = laboratory(short_plan, 0.9, 0.9, 6)
    lab.overrun(12 * MS, 5)
    assert "The slave was held up for 12.0 ms" in str(lab.error)
    lab = laboratory(short_plan, 0.9, 0.9, 6)
    lab.silent("master", 5)
    assert isinstance(lab.error, LostError)


def test_a_lost_laboratorys_slow_rig_is_named_once_it_is_reported(short_plan: Plan) -> None:
    lab = laboratory(short_plan, 0.0, 0.0, 1, role="master")
    lab.silent("slave", 5)
    assert isinstance(lab.error, LostError)
    lab.tripped("slave", Trip(1, "slave", "tripped", "The master stopped the test."), 6)
    assert isinstance(lab.error, LostError)
    lab.tripped("slave", Trip(1, "slave", SLOW_RIG, "laboratory B (Slow): read() took 5.0 ms."), 6)
    assert str(lab.error) == "The slave stopped the test: laboratory B (Slow): read() took 5.0 ms."
    assert lab.error is not None
    assert lab.error.exit_code == 3
