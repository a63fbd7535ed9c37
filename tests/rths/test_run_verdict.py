"""The cause that a run names at its end is that of the laboratory that failed first."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from common.errors import IncompleteError, InputError, InterlockError, LostError, RigError
from common.host.clock import VirtualClock
from common.lab.laboratory import Setting
from common.link.memory_link import MemoryHub
from common.plan.laboratory_tables import RigTable
from common.plan.plan import Plan
from common.reality import reality
from recorder.loop import RecorderLoop
from rths.perform.ending import verdict
from simulation import virtual


class Over:
    """Processes that have ended: exit code and reported error of each."""

    def __init__(self, *ends: tuple[str, int, str], asked: str = "", killed: str = "") -> None:
        self._codes = {name: code for name, code, _ in ends}
        self.errors = {name: error for name, _, error in ends if error}
        self.asked, self.killed = set(asked.split()), set(killed.split())

    def ended(self) -> dict[str, int]:
        return self._codes

    def complaint(self, name: str) -> str:
        return f"a line before\nrths: of the {name}" if name == "nobody" else f"rths: of the {name}"


WISH = "stopped by the user (SIGINT)."
NONE: tuple[tuple[str, int, str], ...] = (("master", 0, ""), ("slave", 0, ""), ("recorder", 0, ""))


@pytest.mark.parametrize(
    ("over", "wish", "kind", "sentence"),
    [
        (
            Over(("master", 3, "remote_trip"), ("slave", 4, "lost"), ("recorder", 0, "")),
            "",
            LostError,
            "of the slave",
        ),
        (
            Over(("master", 4, "lost"), ("slave", 3, "remote_trip"), ("recorder", 4, "")),
            "",
            LostError,
            "of the master",
        ),
        (Over(("master", 4, "lost"), ("slave", 3, "limit")), "", InterlockError, "of the slave"),
        (
            Over(("master", -9, ""), ("slave", 4, "lost"), ("recorder", 4, "recording_lost")),
            "",
            LostError,
            "The master was killed (signal 9)",
        ),
        (
            Over(
                ("master", 3, ""),
                ("slave", 3, "stop"),
                ("recorder", 4, "recording_lost"),
                asked="recorder slave",
            ),
            WISH,
            InterlockError,
            WISH,
        ),
        (Over(("master", 4, "lost"), ("slave", -9, "")), "", LostError, "The slave was killed (signal 9)"),
        (Over(("master", 0, ""), ("recorder", 1, "rows_lost")), "", IncompleteError, "of the recorder"),
        (
            Over(("master", 0, ""), ("recorder", 4, "rows_lost"), asked="recorder"),
            "",
            IncompleteError,
            "recorder",
        ),
        (Over(("master", 4, "lost"), ("recorder", 1, "rows_lost")), "", LostError, "of the master"),
        (Over(("master", 4, "lost"), ("slave", 1, "")), "", LostError, "of the slave"),
        (
            Over(("master", 3, "remote_trip"), ("slave", 3, "stop")),
            "",
            InterlockError,
            "of the slave",
        ),
        (
            Over(("master", 3, ""), ("slave", 2, ""), ("recorder", 4, ""), asked="master recorder"),
            "",
            InputError,
            "of the slave",
        ),
        (Over(("master", 4, "lost"), ("slave", -9, ""), killed="slave"), "", LostError, "of the master"),
        (
            Over(("master", 0, ""), ("slave", -9, ""), killed="slave"),
            "",
            LostError,
            "slave did not come to rest",
        ),
        (
            Over(("master", -9, "stop"), ("slave", 3, "remote_trip"), asked="master", killed="master"),
            WISH,
            LostError,
            "master did not come to rest",
        ),
        (Over(("master", 3, ""), ("slave", 3, ""), asked="master"), WISH, InterlockError, WISH),
        (
            Over(
                ("master", -2, ""), ("slave", 3, "stop"), ("recorder", 4, ""), asked="master slave recorder"
            ),
            WISH,
            InterlockError,
            WISH,
        ),
        (
            Over(("master", 3, "limit"), ("slave", 3, ""), asked="master"),
            WISH,
            InterlockError,
            "of the master",
        ),
        (Over(("master", 3, ""), ("slave", 2, ""), asked="master"), WISH, InputError, "of the slave"),
    ],
)
def test_the_cause_is_that_of_the_process_that_failed_first(
    over: Over, wish: str, kind: type[Exception], sentence: str
) -> None:
    error = verdict(over, wish)
    assert type(error) is kind
    assert sentence in str(error)
    over._codes = dict(reversed(over._codes.items()))
    assert str(verdict(over, wish)) == str(error)


def test_no_error_is_reported_if_all_processes_end_with_0() -> None:
    assert verdict(Over(*NONE), "") is None
    assert verdict(Over(*NONE), WISH) is None


class BrokenTable:
    """Laboratory B that fails on its way."""

    def __init__(self, interval: float, seed: int) -> None:
        self.reads = 0

    def arm(self) -> None: ...

    def read(self) -> Any:
        self.reads += 1
        if self.reads > 50:
            raise RigError("the amplifier is off")
        return 0.0, 0.0, 0.0, 0.0

    def write(self, command: Any) -> None: ...

    def disarm(self) -> None: ...


def test_a_run_in_virtual_time_reports_the_first_cause(
    short_plan: Plan, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr("loop.rigs.find", lambda *_: BrokenTable)
    real = reality.as_planned(short_plan)
    real = dataclasses.replace(real, slaves={"slave": RigTable("x:BrokenTable")})
    bench = virtual.assemble(short_plan, real, tmp_path / "a.mcap")
    error = virtual.run(bench, lambda: "")
    assert isinstance(error, RigError)
    assert error is bench.slave.lab.error
    assert "stopped the test" in str(bench.master.lab.error)


class NoSink:
    """A sink that discards everything."""

    failure = ""
    dropped = 0
    most_waiting = 0

    def put(self, items: Any) -> None: ...

    def close(self, summary: Any, machines: Any) -> None: ...


def test_a_recorder_that_is_asked_to_stop_keeps_the_cause_of_the_tests_end(short_plan: Plan) -> None:
    clock = VirtualClock()
    endpoint = MemoryHub(short_plan.roles).join("recorder", clock)
    for known, outcome in ((("lost", "The slave is gone."), "lost"), (("", ""), "stop")):
        loop = RecorderLoop(Setting(short_plan, endpoint, clock), NoSink())
        loop._outcome = known
        loop.stop("stopped by the user.")
        assert loop.done
        assert loop.summary()["outcome"] == outcome
