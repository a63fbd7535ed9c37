"""A laboratory as a process of its own: link, loop, exit code."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from common import cli, realtime
from common.address import loopback
from common.clock import MonotonicClock
from common.drive import Loop, Stopper, drive
from common.endpoint import FrameEndpoint
from common.errors import InterlockError
from common.laboratory import Report, Setting
from common.plan import Plan
from common.preflight import Check, Gate
from common.reality import Reality
from common.roles import SLAVE
from common.surroundings import Surroundings

if TYPE_CHECKING:
    from common.zenoh_link import ZenohLink


class Assembly(Protocol):
    """How a laboratory is put together: the module `assembly` of the master or the slave."""

    def warm_up(self, reality: Reality) -> None:
        """Compile the kernels."""

    def preflight(self, plan: Plan) -> list[Check]:
        """What can be judged before the link opens."""

    def build_loop(self, setting: Setting, reality: Reality, *, gate: Gate | None = None) -> Loop:
        """The laboratory's loop, with the gate that its rig must pass."""


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
    stopping = Stopper()
    report = cli.reporter(args.json)
    gate = Gate(cli.accepted_risks(args))
    plan = cli.load_plan(args)
    reality = cli.load_reality(args.reality, plan)
    if role == SLAVE:
        role = plan.slave_role(args.name or "")
        reality = reality.of(role)
    assembly.warm_up(reality)  # at ordinary priority: it computes for a second
    gate.judge(assembly.preflight(plan))
    granted = realtime.prepare(args.rt, args.processor)
    link = join(plan, role, stopping, report, listen=listen, connect=connect)
    try:
        endpoint = FrameEndpoint(link, plan.digest())
        setting = Setting(plan, endpoint, MonotonicClock(), report)
        loop = assembly.build_loop(setting, reality, gate=gate)
        loop.lab.heard_ns = setting.clock.now()
        timed = role == "master"
        drive(loop, stopping, Surroundings(loop.lab, granted, endpoint.rejected, timed=timed, gate=gate))
    finally:
        link.close()
        stopping.ignore()
    if loop.lab.error is not None:
        raise loop.lab.error
    if not loop.completed:
        raise InterlockError(loop.lab.exchange.cause or "The test was stopped before its end.")
    return 0


def join(
    plan: Plan,
    role: str,
    stopping: Callable[[], str],
    report: Report,
    *,
    listen: str = "",
    connect: str = "",
) -> ZenohLink:
    """A role's link in the test that a plan describes, with certificates where the plan names their folder.

    Raises:
        InputError: the endpoint or a certificate cannot be used.
        LostError: no master was reached.
    """
    from common.zenoh_link import ZenohLink

    def warn(code: str, text: str) -> None:
        report("event", {"t": 0.0, "lab": role, "level": "warning", "code": code, "text": text})

    identity = None
    if plan.link.security.folder:
        from common import security

        identity = security.identity(plan, role)
    elif not loopback(listen):
        warn(
            "open_link",
            f"The link on {listen} is open: whoever reaches it can move the rigs; see docs/how-to/security.md.",
        )
    return ZenohLink(
        role,
        plan.test.name,
        slaves=plan.roles,
        listen=listen,
        connect=connect,
        patience=plan.link.connect_timeout,
        stopping=stopping,
        identity=identity,
        noticed=lambda text: warn("stranger", text),
    )


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
