"""The panel's executor: orders over the link to stand-ins of laboratories, and the commands that they start."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.read import with_test
from report.panel.desk import OrderOutcome, Present
from rths.panel.executor import Options, PanelExecutor
from rths.perform import operate
from tests.processes import HANG_S
from tests.rths.panel.stand_in import StandIn, elsewhere

RUN = """
import json, signal, sys, time
def say(**data):
    sys.stderr.write(json.dumps(data) + "\\n"); sys.stderr.flush()
def interrupted(*_):
    say(kind="mode", lab="master", mode="idle"); sys.stderr.write("rths: Stopped by SIGINT.\\n"); sys.exit(3)
signal.signal(signal.SIGINT, interrupted)
for mode in ("configured", "armed"):
    for lab in ("master", "slave"):
        say(process=lab, kind="mode", lab=lab, mode=mode)
say(kind="alive", processes=["master", "slave", "recorder"])
ENDING
time.sleep(300)
"""
READY = 'say(process="master", kind="event", lab="master", level="info", code="await_start", text="armed")'
REFUSED = """say(process="slave", kind="event", lab="slave", level="error", code="not_armed", text="The door is open.")
sys.stderr.write("rths: The door is open.\\n"); sys.exit(3)"""


def until(true: Callable[[], Any]) -> Any:
    """The value of a condition as soon as it is true."""
    deadline = time.monotonic() + HANG_S
    while not (found := true()):
        assert time.monotonic() < deadline
        time.sleep(0.005)
    return found


class Desk:
    """An executor whose commands are small programs."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.executor = PanelExecutor(Options(lambda: self.plan, "plan.toml", ["plan.toml"], [], []))

    def give(self, word: str, digest: str = "", reason: str = "") -> OrderOutcome:
        return self.executor.carry_out(word, digest, reason).result(HANG_S)


def modes(desk: Desk) -> dict[str, str]:
    """The modes that the laboratories of the panel's own test have reported."""
    shown = desk.executor.snapshot.shown
    return {lab: mode for lab, (mode, _) in shown.reports.modes.items()} if shown else {}


@pytest.fixture
def desk(short_plan: Plan, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Desk]:
    monkeypatch.setenv("RTHS_RUNNING", str(tmp_path))
    found = Desk(with_test(short_plan, seed=77))
    yield found
    found.executor.close()


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[str], list[list[str]]]:
    """Puts a program in place of `rths`; gives the arguments of each call."""

    def put(text: str) -> list[list[str]]:
        path, calls = tmp_path / "program.py", list[list[str]]()
        path.write_text(text)
        started = subprocess.Popen

        def start(words: list[str], **options: Any) -> Any:
            calls.append(words[3:])
            return started([sys.executable, str(path)], **options)

        monkeypatch.setattr("rths.panel.child.subprocess.Popen", start)
        return calls

    return put


def test_an_order_reaches_every_laboratory_once_and_all_answers_are_reported(desk: Desk) -> None:
    with StandIn(desk.plan).there() as labs:
        until(lambda: desk.executor.present.test)
        assert desk.executor.present.digest == desk.plan.digest()
        assert desk.give("stop") == OrderOutcome("done", "master: running. slave: running.")
        assert desk.give("start").text == "master: running."
        assert [[word for _, word in labs.presses[role]] for role in ("master", "slave")] == [
            ["stop", "start"],
            ["stop"],
        ]
    until(lambda: desk.executor.present == Present())


def test_lost_frames_are_repeated_and_no_order_waits_for_the_answers_to_another(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(operate, "PATIENCE_S", HANG_S)
    labs = StandIn(desk.plan)
    labs.lossy = 3
    with labs.there():
        until(lambda: desk.executor.snapshot.shown and desk.executor.snapshot.shown.linked)
        given = [desk.executor.carry_out("stop", "", "") for _ in range(60)]
        assert {one.result(HANG_S).state for one in given} == {"done"}
        for role in ("master", "slave"):
            assert len(labs.presses[role]) == len({press for press, _ in labs.presses[role]}) == 60
        labs.lossy, labs.deaf = 0, {"slave"}
        slow = desk.executor.carry_out("stop", "", "")
        assert desk.give("start").state == "done"  # the master alone answers it
        assert not slow.done()
        monkeypatch.setattr(operate, "PATIENCE_S", 0.3)
        unheard = desk.give("stop")
        assert unheard.state == "not heard"
        assert "slave within" in unheard.text
    assert slow.result(HANG_S).text == "The test ended before an answer came from the slave. master: running."


def test_every_order_gets_an_outcome_when_the_test_ends(desk: Desk) -> None:
    labs = StandIn(desk.plan)
    labs.deaf = {"master", "slave"}
    with labs.there():
        until(lambda: desk.executor.snapshot.shown and desk.executor.snapshot.shown.linked)
        given = desk.executor.carry_out("stop", "", "")
    assert given.result(HANG_S).state == "not heard"


def test_a_stopped_master_is_shown_as_not_linked_until_it_answers_again(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def linked() -> bool:
        shown = desk.executor.snapshot.shown
        return shown is not None and shown.linked

    monkeypatch.setattr(operate, "PATIENCE_S", HANG_S)
    with elsewhere(desk.plan, tmp_path) as labs:
        until(linked)
        assert desk.give("stop").state == "done"
        labs.send_signal(signal.SIGSTOP)
        until(lambda: not linked())
        shown = desk.executor.snapshot.shown
        assert shown is not None
        assert 0 < shown.unlinked_at <= time.monotonic_ns()
        monkeypatch.setattr(operate, "PATIENCE_S", 0.3)
        assert desk.give("stop").text.startswith("No answer came from the master and the slave within")
        monkeypatch.setattr(operate, "PATIENCE_S", HANG_S)
        labs.send_signal(signal.SIGCONT)
        until(linked)
        assert desk.executor.snapshot.shown == shown._replace(linked=True, unlinked_at=0)
        assert desk.give("stop").state == "done"
    until(lambda: desk.executor.snapshot.shown is None)


def test_arming_starts_a_run_command_and_reports_when_all_laboratories_are_armed(
    desk: Desk, program: Callable[[str], list[list[str]]]
) -> None:
    calls = program(RUN.replace("ENDING", READY))
    assert (
        desk.give("arm", desk.plan.digest()).text == "All laboratories are armed; nothing moves before Start."
    )
    assert calls == [["run", "plan.toml", "--await-start", "--reports"]]
    until(lambda: modes(desk) == {"master": "armed", "slave": "armed"})
    assert desk.executor.snapshot.shown is not None
    assert desk.executor.snapshot.shown.own
    assert desk.give("arm", desk.plan.digest()).text == "A test runs already."
    assert "would disturb" in desk.give("check").text
    assert (
        desk.give("stop").state == "done"
    )  # its laboratories are not linked, so that the command is interrupted
    until(lambda: desk.executor.snapshot.shown is None)
    assert (desk.executor.snapshot.last, desk.executor.snapshot.ending) == ((), "Stopped by SIGINT.")
    with StandIn(desk.plan).there():  # another test
        until(lambda: desk.executor.snapshot.ending == "")


def test_a_command_that_ends_before_all_are_armed_gives_its_reason(
    desk: Desk, program: Callable[[str], list[list[str]]]
) -> None:
    program(RUN.replace("ENDING", REFUSED))
    assert desk.give("arm", desk.plan.digest()) == OrderOutcome("refused", "The door is open.")
    assert desk.executor.snapshot.last == (("slave", "The door is open."),)


def test_a_plan_that_has_changed_or_is_missing_is_not_armed(
    desk: Desk, program: Callable[[str], list[list[str]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = program(RUN)
    shown = desk.plan.digest()
    desk.plan = with_test(desk.plan, seed=78)
    assert desk.give("arm", shown).text == "The plan has changed since it was checked: check it again."

    def gone() -> Plan:
        raise InputError("There is no plan.")

    monkeypatch.setattr(desk.executor, "_options", desk.executor._options._replace(load=gone))
    assert desk.give("arm", shown) == OrderOutcome("refused", "There is no plan.")
    assert calls == []


def test_a_test_with_another_plan_than_the_checked_one_is_ended_before_anything_moves(
    desk: Desk, program: Callable[[str], list[list[str]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    program(RUN.replace("ENDING", ""))
    arming = desk.executor.carry_out("arm", desk.plan.digest(), "")
    own = until(lambda: desk.executor.snapshot.shown)
    other = StandIn(with_test(desk.plan, seed=79))
    monkeypatch.setattr("common.host.running.os.getpid", lambda: int(own.test.rpartition("-")[2]))
    with other.there():
        assert "the test is ended before anything moves" in arming.result(HANG_S).text
        until(lambda: desk.executor.snapshot.ending)


@pytest.mark.parametrize(
    ("text", "outcome", "complaint"),
    [
        ('print(\'{"digest": "d"}\')', OrderOutcome("done", "See what was found."), ""),
        (
            'import sys; sys.exit("rths: no such key.")',
            OrderOutcome("refused", "no such key."),
            "no such key.",
        ),
        ("", OrderOutcome("refused", "The check ended without a word."), "The check ended without a word."),
    ],
)
def test_a_check_of_the_plan_runs_the_check_command(
    text: str, outcome: OrderOutcome, complaint: str, desk: Desk, program: Callable[[str], list[list[str]]]
) -> None:
    calls = program(text)
    assert desk.give("check") == outcome
    assert calls == [["check", "plan.toml", "--json"]]
    assert desk.executor.snapshot.plan.complaint == complaint
    assert desk.executor.present.armable == ("d" if not complaint else "")


def test_if_the_panels_executor_fails_every_order_still_gets_an_outcome(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    failed: list[object] = []
    monkeypatch.setattr("threading.excepthook", failed.append)

    def fail() -> None:
        raise RuntimeError

    monkeypatch.setattr(desk.executor, "_seek", fail)
    given = [desk.executor.carry_out("stop", "", "") for _ in range(20)]
    assert {one.result(HANG_S).state for one in given} == {"not heard"}
    assert desk.give("stop").text.startswith("This part of the panel has ended")
    assert len(failed) == 1


def test_an_order_that_is_being_handed_over_when_the_executor_fails_gets_an_outcome(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("threading.excepthook", lambda found: None)
    executor = desk.executor
    put = executor._queue.put

    def put_late(job: Any) -> None:
        """The executor ends between the decision to hand an order over and its arrival."""
        monkeypatch.setattr(executor, "_seek", lambda: 1 / 0)
        executor._thread.join(HANG_S)
        put(job)

    monkeypatch.setattr(executor._queue, "put", put_late)
    assert desk.give("stop").state == "not heard"


@pytest.mark.parametrize("step", ["_begin", "_exchange"])
def test_an_order_in_whose_midst_the_executor_fails_gets_an_outcome(
    step: str, desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("threading.excepthook", lambda found: None)
    monkeypatch.setattr(desk.executor, step, lambda *_: 1 / 0)
    assert desk.give("stop").state == "not heard"


def test_a_panel_that_ends_stops_an_armed_test_and_leaves_a_running_one(
    desk: Desk, program: Callable[[str], list[list[str]]]
) -> None:
    program(RUN.replace("ENDING", READY))
    desk.give("arm", desk.plan.digest())
    assert "was not started, and is asked to end" in desk.executor.close()
    until(lambda: desk.executor._command and desk.executor._command.over)
    assert desk.executor.close() == ""
    running = Desk(desk.plan)
    program(RUN.replace("ENDING", READY + '\nsay(kind="mode", lab="master", mode="running")'))
    running.give("arm", desk.plan.digest())
    command = until(lambda: running.executor._command)
    until(lambda: command.reports.modes["master"][0] == "running")
    assert "goes on as planned" in running.executor.close()
    assert not command.over
    command.interrupt()
    until(lambda: command.over)
