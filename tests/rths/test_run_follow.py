"""How `rths run` reads the reports of its processes, and when it stops them."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from common.errors import LostError
from common.lab.drive import longest_leave
from common.plan.plan import Plan
from common.protocol.exchange import State
from common.safety.ramp import MotionRamp
from laboratories.longest import resting
from report.text.terminal import RunProgress
from rths.perform.ending import KILL_S, LEAVE_S, MARGIN_S, SILENCE_S, WRITE_S, Ending, verdict
from rths.perform.follow import answer, follow, note, tell
from rths.perform.processes import Leash, Processes, ProcessReport, understood

NAMES = ("master", "slave", "recorder")
EVENT = {"kind": "event", "lab": "slave", "level": "error", "code": "lost", "text": "gone"}


@pytest.mark.parametrize(
    "line",
    [
        "valve open",
        "",
        "3",
        "[1, 2]",
        "null",
        '{"valve": "open"}',
        '{"kind": "event"}',
        '{"kind": 3}',
        '{"kind": ["event"]}',
        '{"kind": "valve", "text": "open"}',
        "[" * 100_000,
        '{"kind": ' * 50_000,
        '{"kind": "event", "lab"',
        "\N{REPLACEMENT CHARACTER}\x00",
    ],
)
def test_a_line_that_is_not_a_report_is_taken_as_text(line: str) -> None:
    assert understood(line + "\n") == [{"kind": "text", "text": line}]


def test_a_report_is_read_after_output_of_a_rig_without_a_line_end() -> None:
    assert understood(json.dumps(EVENT) + "\n") == [EVENT]
    assert understood("...." + json.dumps(EVENT) + "\n") == [{"kind": "text", "text": "...."}, EVENT]


class Times:
    """The times at which an ending asks and kills processes, polled every tenth of a second for a minute."""

    def __init__(self, ending: Ending, ends: dict[str, float], wish: float = 1e9) -> None:
        self.asked: dict[str, float] = {}
        self.killed: dict[str, float] = {}
        for now in (tenth / 10 for tenth in range(600)):
            ended = {name: 4 for name, end in ends.items() if now >= end}
            ended |= dict.fromkeys(self.killed, -9)
            ending.look(now, "stopped." if now >= wish else "", NAMES, ended)
            for name in set(NAMES) - set(ended):
                if now >= ending.ask_at(name):
                    self.asked.setdefault(name, now)
                if now >= ending.kill_at(name):
                    self.killed.setdefault(name, now)


def ending(plan: Plan, *, agreed: bool) -> Ending:
    result = Ending(plan)
    result.agreed = agreed
    return result


def near(value: float) -> Any:
    return pytest.approx(value, abs=0.15)


def test_a_stop_before_the_start_is_sent_to_all_laboratories_at_once_and_then_to_the_recorder(
    short_plan: Plan,
) -> None:
    times = Times(ending(short_plan, agreed=False), {"master": 2.0, "slave": 3.0}, wish=1.0)
    assert times.asked == {
        "master": near(1.0),
        "slave": near(1.0),
        "recorder": near(3.0 + MARGIN_S),
    }
    assert times.killed == {"recorder": near(3.0 + MARGIN_S + KILL_S)}


def test_a_failure_before_the_start_stops_the_others_after_a_moment(short_plan: Plan) -> None:
    times = Times(ending(short_plan, agreed=False), {"recorder": 1.0, "slave": 3.0, "master": 3.0})
    assert times.asked == {"master": near(1.0 + MARGIN_S), "slave": near(1.0 + MARGIN_S)}
    assert not times.killed


def test_a_stop_during_ticks_is_sent_to_the_master_only_and_a_process_that_hangs_is_killed(
    short_plan: Plan,
) -> None:
    times = Times(ending(short_plan, agreed=True), {"master": 2.0, "recorder": 18.0}, wish=1.0)
    notice = short_plan.link.loss_timeout + longest_leave(short_plan) + MARGIN_S + resting(short_plan)
    assert times.asked["master"] == near(1.0)
    assert times.asked["slave"] == near(1.0 + notice)
    assert times.killed == {"slave": near(1.0 + notice + KILL_S)}
    assert notice + KILL_S == pytest.approx(27.5, abs=1.0)


def test_after_a_slave_is_lost_master_and_recorder_end_without_being_asked(short_plan: Plan) -> None:
    times = Times(ending(short_plan, agreed=True), {"slave": 1.0, "master": 2.5, "recorder": 7.6})
    assert not times.asked
    assert not times.killed
    hanging = Times(ending(short_plan, agreed=True), {"slave": 1.0, "master": 2.5})
    assert hanging.asked == {"recorder": near(2.5 + SILENCE_S + short_plan.recording.patience)}
    assert hanging.killed == {"recorder": near(2.5 + WRITE_S)}


def test_a_recorder_that_is_not_required_may_end_during_a_test(short_plan: Plan) -> None:
    for required, asked in ((True, {"master", "slave"}), (False, set())):
        plan = dataclasses.replace(
            short_plan, recording=dataclasses.replace(short_plan.recording, required=required)
        )
        assert Times(ending(plan, agreed=True), {"recorder": 1.0}).asked.keys() == asked


def test_a_laboratory_on_its_ramp_is_killed_when_its_last_reported_time_is_over(short_plan: Plan) -> None:
    slow = ending(short_plan, agreed=True)
    slow.rests("master", 20.0, 15.0)
    times = Times(slow, {}, wish=1.0)
    assert times.killed["master"] == near(35.0 + MARGIN_S + longest_leave(short_plan) + MARGIN_S + KILL_S)
    assert times.killed["slave"] < 30.0


def test_a_stop_just_before_the_start_leaves_the_time_to_come_to_rest(short_plan: Plan) -> None:
    early = ending(short_plan, agreed=False)
    early.look(1.0, "stopped.", NAMES, {})
    early.agreed = True
    early.look(1.1, "stopped.", NAMES, {})
    early.rests("master", 1.2)
    assert early.kill_at("slave") == near(1.0 + LEAVE_S + KILL_S)
    assert early.kill_at("master") == near(
        1.2 + resting(short_plan) + MARGIN_S + longest_leave(short_plan) + MARGIN_S + KILL_S
    )


def said(process: str, state: State) -> ProcessReport:
    """The report of a laboratory that proceeds in the handshake."""
    return ProcessReport(process, {"kind": "state", "lab": process, "state": state.value})


def test_a_stop_while_a_rig_arms_leaves_it_the_time_that_the_others_would_wait(
    processes: Processes, tmp_path: Path, short_plan: Plan, monkeypatch: Any
) -> None:
    monkeypatch.setattr("time.monotonic", lambda: 20.0)
    doing: dict[str, str] = {}
    arming, given = ending(short_plan, agreed=False), short_plan.link.connect_timeout
    note(said("slave", State.REGISTERED), arming, doing)
    program(tmp_path, "slave", DEAF)
    processes.start("slave", [])
    assert f"while it arms or is on its ramp to rest (slave: arming its rig, at most {given:g} s)" in answer(
        processes, doing
    )
    times = Times(arming, {}, wish=21.0)
    assert times.asked["slave"] == near(21.0)
    assert times.killed["slave"] == near(20.0 + given + LEAVE_S + KILL_S)
    assert times.killed["master"] == near(21.0 + LEAVE_S + KILL_S)
    note(said("slave", State.ARMED), arming, doing)
    assert doing == {}
    assert arming.kill_at("slave") == near(21.0 + LEAVE_S + KILL_S)


def test_the_longest_time_to_rest_is_not_below_that_of_the_ramp(short_plan: Plan) -> None:
    usual, limits = short_plan.safety, short_plan.limits
    for safety in (
        usual,
        dataclasses.replace(usual, acceleration=0.2),
        dataclasses.replace(usual, jerk=5.0),
        dataclasses.replace(usual, velocity=0.002),
    ):
        plan = dataclasses.replace(short_plan, safety=safety)
        interval = plan.test.interval
        ramp = MotionRamp(safety, interval, limits.actuator_command, limits.actuator_velocity, unload=True)
        steps = 0
        while not ramp.done:
            ramp.step(1e6 * ramp.command)
            steps += 1
        assert steps * interval < resting(plan), safety


WISH = "stopped by the user (SIGINT)."


def program(folder: Path, name: str, text: str) -> None:
    """Writes a module that stands in for a process of a test."""
    (folder / f"{name}.py").write_text(text)


DEAF = "import signal, time\nsignal.signal(signal.SIGINT, lambda *_: None)\ntime.sleep(60)\n"
# An interrupt that comes right before a sleep begins is seen at its end, so that it sleeps briefly, again and again.
OBEDIENT = (  # also where the tests run in the background of a shell, which lets them ignore interrupts
    "import signal, sys, time\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    "try:\n    print('here', flush=True)\n    for _ in range(600):\n        time.sleep(0.1)\n"
    "except KeyboardInterrupt:\n    sys.exit(3)\n"
)


@pytest.fixture
def processes(tmp_path: Path, monkeypatch: Any) -> Any:
    monkeypatch.setattr("rths.perform.processes.ROOT", tmp_path)
    monkeypatch.chdir(tmp_path)
    running = Processes()
    yield running
    running.close()


def test_what_the_recorder_says_of_a_lost_test_is_no_cause_of_its_end(capsys: Any) -> None:
    event = EVENT | {"lab": "recorder", "text": "The laboratories fell silent; the recording ends there."}
    tell(ProcessReport("recorder", event), RunProgress(1.0))
    tell(
        ProcessReport("recorder", event | {"code": "recording_lost", "text": "No space is left."}),
        RunProgress(1.0),
    )
    assert capsys.readouterr().err.splitlines() == [
        "recorder: The laboratories fell silent; the recording ends there.",
        "recorder: ends the test (recording_lost)",
    ]


class Presses:
    """A request to stop that was made this many times."""

    def __init__(self, reason: str = "", presses: int = 0) -> None:
        self.reason, self.presses, self.number = reason, presses, signal.SIGINT

    def __call__(self) -> str:
        return self.reason


def test_a_flood_of_text_lines_is_read_to_its_end(
    processes: Processes, tmp_path: Path, short_plan: Plan, capsys: Any
) -> None:
    text = "import json, os\nos.write(1, b'\\xff\\xfe\\n' + b'valve open\\n' * 20_000)\n"
    program(tmp_path, "slave", text + f"print('...' + json.dumps({EVENT!r}))\nraise SystemExit(4)\n")
    processes.start("slave", [])
    follow(processes, Ending(short_plan), RunProgress(1.0), Presses())
    assert processes.ended() == {"slave": 4}
    assert processes.errors == {"slave": "lost"}
    err = capsys.readouterr().err
    assert err.count("slave: valve open\n") == 20_000
    assert "slave: ends the test (lost)\n" in err


def test_a_pipe_that_a_grandchild_holds_open_does_not_delay_the_end(
    processes: Processes, tmp_path: Path, short_plan: Plan
) -> None:
    program(
        tmp_path,
        "slave",
        "import subprocess, sys\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(8)'])\n"
        "print(child.pid, flush=True)\n",
    )
    processes.start("slave", [])
    said = processes.next_report(5.0)
    assert said is not None
    follow(processes, Ending(short_plan), RunProgress(1.0), Presses())
    os.kill(int(said.data["text"]), signal.SIGKILL)
    assert processes.ended() == {"slave": 0}


RAMPING = {"kind": "mode", "lab": "master", "mode": "ramping"}
LEFT = {"kind": "resting", "lab": "master", "left": 0.5, "text": "unloading the column: 12.0 kN left"}


def test_a_laboratory_that_hangs_on_its_ramp_is_killed_after_it_and_not_by_further_presses(
    processes: Processes, tmp_path: Path, short_plan: Plan, monkeypatch: Any, capsys: Any
) -> None:
    for name in ("LEAVE_S", "MARGIN_S", "KILL_S"):
        monkeypatch.setattr(f"rths.perform.ending.{name}", 0.1)
    monkeypatch.setattr("rths.perform.ending.longest_leave", lambda _plan: 0.1)
    lines = "".join(f"print({json.dumps(one)!r}, flush=True)\n" for one in (RAMPING, LEFT))
    program(tmp_path, "master", lines + DEAF)
    processes.start("master", [])
    ending = Ending(short_plan)
    begun = time.monotonic()
    for _ in (RAMPING, LEFT):
        heard = processes.next_report(30.0)
        assert heard is not None
        note(heard, ending, {})
    follow(processes, ending, RunProgress(1.0), Presses(WISH, 2))
    err = capsys.readouterr().err
    assert time.monotonic() - begun > 0.5
    assert "already stopping" in err
    assert "did not come to rest" in err
    assert isinstance(verdict(processes, WISH), LostError)
    assert processes.killed == {"master"}


def test_the_answer_to_a_second_stop_states_what_a_laboratory_is_doing(
    processes: Processes, tmp_path: Path, short_plan: Plan
) -> None:
    program(tmp_path, "master", DEAF)
    processes.start("master", [])
    doing: dict[str, str] = {}
    assert "waiting for master" in answer(processes, doing)
    note(ProcessReport("master", RAMPING), Ending(short_plan), doing)
    note(ProcessReport("master", LEFT), Ending(short_plan), doing)
    assert "master: unloading the column: 12.0 kN left" in answer(processes, doing)
    note(ProcessReport("master", RAMPING | {"mode": "idle"}), Ending(short_plan), doing)
    assert "waiting for master" in answer(processes, doing)


def test_a_process_that_hangs_after_anothers_end_is_killed_without_a_request(
    processes: Processes, tmp_path: Path, short_plan: Plan, monkeypatch: Any
) -> None:
    for name in ("LEAVE_S", "MARGIN_S", "KILL_S"):
        monkeypatch.setattr(f"rths.perform.ending.{name}", 0.2)
    program(tmp_path, "master", f"print({json.dumps(EVENT)!r}, flush=True)\nraise SystemExit(4)\n")
    program(tmp_path, "slave", DEAF)
    program(tmp_path, "recorder", DEAF)
    for name in NAMES:
        processes.start(name, [])
    follow(processes, Ending(short_plan), RunProgress(1.0), Presses())
    assert processes.killed == {"slave", "recorder"}
    assert processes.ended()["master"] == 4
    assert isinstance(verdict(processes, ""), LostError)


def test_a_child_is_interrupted_when_the_last_holder_of_its_pipe_has_ended(tmp_path: Path) -> None:
    if sys.platform != "linux":
        pytest.skip("Linux alone has it")
    program(tmp_path, "child", OBEDIENT)
    leash = Leash()
    with leash.end() as ends:
        child = subprocess.Popen(
            [sys.executable, tmp_path / "child.py"], pass_fds=ends, stdout=subprocess.PIPE
        )
        leash.tie(ends, child.pid)
    holder = subprocess.Popen(
        [sys.executable, "-c", "input()"], pass_fds=[leash.writer], stdin=subprocess.PIPE
    )
    assert child.stdout is not None
    assert child.stdout.readline() == b"here\n"
    pipe = Path(f"/proc/self/fd/{leash.writer}").readlink()
    leash.close()
    assert child.poll() is None
    holder.kill()
    holder.communicate()
    with contextlib.suppress(subprocess.TimeoutExpired):
        child.wait(30.0)
    assert child.returncode == 3, f"its pipe is open in {holders_of(pipe)}"
    child.stdout.close()


def holders_of(pipe: Path) -> list[str]:
    """The processes that have a pipe open: process, command, and flags of the file."""
    found = []
    for link in Path("/proc").glob("[0-9]*/fd/*"):
        with contextlib.suppress(OSError):
            if link.readlink() == pipe:
                process = link.parents[1]
                flags = (process / "fdinfo" / link.name).read_text().split()[3]
                command = (process / "cmdline").read_text().replace("\0", " ")
                found.append(f"{process.name} ({command.strip()}), flags {flags}")
    return found
