"""The processes of a test while they run: their reports are shown, and each is stopped when its time has come."""

from __future__ import annotations

import signal
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

from common.host.stopping import Stopping
from common.lab.preflight import PASSED
from common.protocol.exchange import State
from common.roles import MASTER, RECORDER, title
from common.safety.modes import Mode
from report.text.forwarded import ForwardedProgress
from report.text.terminal import RunProgress

if TYPE_CHECKING:
    from rths.perform.ending import Ending
    from rths.perform.live_child import View
    from rths.perform.processes import Processes, ProcessReport

POLL_S = 0.1  # s between two looks at the processes: a user does not notice the delay
AGREED = State.SCHEDULED.value  # state in which the master reports that all processes know the start
UNWRITABLE = "recording_lost"  # code of the only event with which a recorder ends a test
# Codes of events that go into the recording only: the terminal shows them before the start or in the summary.
UNSAID = ("patience", "machine", "bare_loop", "mode", "exchange", PASSED)


def follow(
    processes: Processes,
    ending: Ending,
    progress: RunProgress | ForwardedProgress,
    stopping: Stopping,
    view: View | None = None,
) -> None:
    """Show the reports of the processes, and stop those whose time has come, until all have ended.

    A second Ctrl-C changes nothing; the answer to it says what the processes are doing.
    """
    from rths.perform.ending import killed

    answered = 1
    doing: dict[str, str] = {}
    while not processes.all_ended():
        report = processes.next_report(POLL_S)
        if report is not None:
            tell(report, progress)
            note(report, ending, doing)
        if isinstance(progress, ForwardedProgress):
            progress.alive([name for name in processes.names if name not in processes.ended()])
        if view is not None and (news := view.news()):
            progress.say(news)
        for name in stop(processes, ending, stopping(), stopping.number):
            progress.say(killed(name))
        if stopping.presses > answered:
            answered = stopping.presses
            progress.say(answer(processes, doing))


def note(report: ProcessReport, ending: Ending, doing: dict[str, str]) -> None:
    """Take note of a report that concerns the end of a test; `doing` says which laboratories arm or come to rest."""
    match report.data:
        case {"kind": "state", "state": state} if report.process == MASTER and state == AGREED:
            ending.agreed = True
        case {"kind": "state", "state": State.REGISTERED.value}:
            doing[report.process] = f"arming its rig, at most {ending.arming:g} s"
            ending.arms(report.process, time.monotonic())
        case {"kind": "state", "state": State.ARMED.value}:
            doing.pop(report.process, None)
            ending.armed(report.process, time.monotonic())
        case {"kind": "mode", "mode": mode}:
            doing.pop(report.process, None)
            if mode == Mode.RAMPING.value:
                doing[report.process] = "coming to rest"
                ending.rests(report.process, time.monotonic())
        case {"kind": "resting", "left": float(left), "text": text}:
            doing[report.process] = str(text)
            ending.rests(report.process, time.monotonic(), left)
        case _:
            pass


def answer(processes: Processes, doing: Mapping[str, str]) -> str:
    """The answer to a second Ctrl-C: what the processes are doing, which is not cut short."""
    there = [name for name in processes.names if name not in processes.ended()]
    if resting := [f"{title(name)}: {text}" for name, text in doing.items() if name in there]:
        return (
            "already stopping; no laboratory is killed while it arms or is on its ramp to rest "
            f"({'; '.join(resting)})"
        )
    return (
        f"already stopping; waiting for {' and '.join(map(title, there)) or 'no process'} to leave in order"
    )


def end_all(processes: Processes, ending: Ending) -> None:
    """End the processes in order if this program has failed, so that no rig is left in mid-motion."""
    doing: dict[str, str] = {}
    while not processes.all_ended():
        if (report := processes.next_report(POLL_S)) is not None:
            note(report, ending, doing)
        stop(processes, ending, "this program failed.", signal.SIGINT)


def tell(report: ProcessReport, progress: RunProgress | ForwardedProgress) -> None:
    """Show one report if it is meant for the user, or pass it on to a program."""
    if isinstance(progress, ForwardedProgress):
        progress.forward(report.process, report.data)
        return
    match report.data:
        case {"kind": "progress"} if report.process == MASTER:
            progress.show(report.data)
        case {"kind": "mode", "lab": lab, "mode": mode}:
            progress.mode(lab, mode)
        case {"kind": "event", "code": "real_time", "missing": missing} if missing:
            pass  # pre-flight reported it if there is a rig; an emulation does not need it
        case {"kind": "event", "level": "error", "code": code, "lab": lab, "text": text} if (
            lab == RECORDER and code != UNWRITABLE
        ):
            progress.say(f"{lab}: {text}")  # a consequence of the end, or rows that are missing
        case {"kind": "event", "level": "error", "code": code, "lab": lab}:
            progress.say(f"{lab}: ends the test ({code})")  # the full sentence is this command's last line
        case {"kind": "event", "code": code, "lab": lab, "text": text} if code not in UNSAID:
            progress.say(f"{lab}: {text}")
        case {"kind": "text", "text": text}:
            progress.say(f"{report.process}: {text}")
        case _:
            pass


def stop(processes: Processes, ending: Ending, wish: str, number: signal.Signals) -> list[str]:
    """Ask or kill the processes whose time has come; names of those that were killed.

    They are asked by the signal `number` with which this command was asked, so that a recording names that one.
    """
    gone = []
    now, ended = time.monotonic(), processes.ended()
    ending.look(now, wish, processes.names, ended)
    for name in processes.names:
        if name not in ended and now >= ending.ask_at(name):
            processes.ask(name, number)
        if name not in ended and now >= ending.kill_at(name):
            processes.kill(name)
            gone.append(name)
    return gone
