"""Runs a laboratory as a process of its own: link, loop, exit code."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import TYPE_CHECKING, Protocol

from common.errors import InterlockError, RthsError
from common.host import realtime, running
from common.host.clock import MonotonicClock
from common.host.stopping import Stopper
from common.host.waited import Waited
from common.lab import lacking
from common.lab.drive import DrivenLoop, drive
from common.lab.laboratory import Setting
from common.lab.preflight import Gate, PreflightCheck
from common.lab.surroundings import Surroundings
from common.link.address import checked, loopback
from common.link.endpoint import FrameEndpoint
from common.plan.plan import Plan
from common.reality.reality import Reality
from common.reporting import Report
from common.roles import MASTER, OPERATOR, RECORDER, SLAVE, title
from common.safety.modes import Mode
from common.terminal import cli
from common.terminal.plain_report import PlainReport

if TYPE_CHECKING:
    from common.link.zenoh_link import ZenohLink


class Assembly(Protocol):
    """The module `assembly` of the master or the slave, which builds the laboratory's loop."""

    def warm_up(self, reality: Reality) -> None:
        """Compile the kernels."""

    def preflight(self, plan: Plan) -> list[PreflightCheck]:
        """The checks that can be made before the link opens."""

    def build_loop(self, setting: Setting, reality: Reality, *, gate: Gate | None = None) -> DrivenLoop:
        """The laboratory's loop; `gate` holds the risks that are accepted."""


def conduct(
    role: str,
    args: argparse.Namespace,
    assembly: Assembly,
    *,
    listen: str = "",
    connect: str = "",
) -> int:
    """Run one laboratory's loop over zenoh; 0 where all ticks are done.

    Raises:
        RthsError: what ended the test before its last tick.
    """
    for given in (listen, connect):
        checked(given)
    stopping = Stopper()
    gate = Gate(cli.accepted_risks(args), await_start=getattr(args, "await_start", False))
    plan = cli.load_plan(args)
    report = cli.reporter(args.json, plan.test.duration)
    reality = cli.load_reality(args.reality, plan)
    if role == SLAVE:
        role = plan.slave_role(args.name or "")
        reality = reality.of(role)
    assembly.warm_up(reality)  # at ordinary priority, since it computes for a second
    gate.judge(assembly.preflight(plan))
    granted = realtime.prepare(args.rt, args.processor)
    for text in lacking.lacks(plan, granted):
        warning = {
            "t": 0.0,
            "lab": role,
            "level": "warning",
            "code": "lacking",
            "text": f"pre-flight: {text}",
        }
        report("event", warning)
    link = join(plan, role, stopping, report, listen=listen, connect=connect)
    try:
        endpoint = FrameEndpoint(link, plan.digest())
        setting = Setting(plan, endpoint, MonotonicClock(), report)
        loop = assembly.build_loop(setting, reality, gate=gate)
        loop.lab.heard_ns = setting.clock.now()
        timed = role == "master"
        stopping.answer = partial(answer, loop)
        with announcement(plan, role, listen or connect):
            drive(loop, stopping, Surroundings(loop.lab, granted, endpoint.rejected, timed=timed, gate=gate))
    finally:
        link.close()
        stopping.ignore()
    if loop.lab.error is not None:
        raise last_word(loop.lab.error, report)
    if not loop.completed:
        raise InterlockError(loop.lab.exchange.cause or "The test was stopped before its end.")
    return 0


def last_word(error: RthsError, report: Report) -> RthsError:
    """The error that ends a process, marked if the report has printed it already."""
    error.said = isinstance(report, PlainReport) and str(error) in report.errors
    return error


class MasterSearch:
    """The request to stop while a process looks for its master.

    It also reports at intervals how long that has taken.
    """

    def __init__(self, role: str, plan: Plan, report: Report, stopping: Callable[[], str]) -> None:
        self._role = role
        self._patience = plan.link.connect_timeout
        self._report = report
        self._stopping = stopping
        self._clock = MonotonicClock()
        self._waited = Waited(self._clock.now())

    def __call__(self) -> str:
        """The reason to stop, empty while there is none."""
        if text := self._waited.news(f"the {MASTER}", self._patience, self._clock.now()):
            self._report("waiting", {"lab": self._role, "text": text})
        return self._stopping()


def answer(loop: DrivenLoop) -> str:
    """The answer of a laboratory to a second request to stop, which changes nothing: what the laboratory is doing."""
    lab = loop.lab
    if lab.safety.mode is not Mode.RAMPING:
        return f"{lab.name}: is {lab.safety.mode.value.replace('_', ' ')}, and leaves as soon as it may."
    return f"{lab.name}: {loop.resting.text}; a ramp to rest is never cut short."


def announcement(plan: Plan, role: str, endpoint: str) -> AbstractContextManager[None]:
    """Registers a laboratory that was started by itself as running; `rths run` registers those that it starts."""
    return nullcontext() if running.announced_already() else running.announced(plan, endpoint, role)


def join(
    plan: Plan,
    role: str,
    stopping: Callable[[], str],
    report: Report,
    *,
    listen: str = "",
    connect: str = "",
) -> ZenohLink:
    """Open a role's link to a test, with certificates where the plan names their folder.

    Raises:
        InputError: the endpoint or a certificate cannot be used.
        LostError: no master was reached.
    """
    from common.link.zenoh_link import ZenohLink

    def warn(code: str, text: str) -> None:
        report("event", {"t": 0.0, "lab": role, "level": "warning", "code": code, "text": text})

    identity = None
    if plan.link.security.folder:
        from common.link import security

        identity = security.identity(plan, role)
    elif not loopback(listen):
        warn(
            "open_link",
            f"The link on {listen} is open: anybody who reaches it can move the rigs; see docs/how-to/security.md.",
        )
    others = [title(one) for one in (*plan.roles, RECORDER)]
    text = (
        f"waits on {listen} for {' and '.join(others)}" if listen else f"looks for the {MASTER} at {connect}"
    )
    if role != OPERATOR:  # whose command waits for a few seconds only
        report("waiting", {"lab": role, "text": f"{text}, {plan.link.connect_timeout:g} s at most."})
    link = ZenohLink(
        role,
        plan.test.name,
        slaves=plan.roles,
        listen=listen,
        connect=connect,
        patience=plan.link.connect_timeout,
        stopping=MasterSearch(role, plan, report, stopping),
        identity=identity,
    )
    link.watch(lambda text: warn("stranger", text))
    return link


def enter(
    name: str,
    text: str | None,
    add_arguments: Callable[[argparse.ArgumentParser], None],
    run: Callable[[argparse.Namespace], int],
) -> int:
    """Entry of `python -m name`: parse its options and run it."""
    parser = cli.Parser(prog=f"python -m {name}", description=text)
    add_arguments(parser)
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))
