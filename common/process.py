"""A laboratory as a process of its own: link, loop, exit code."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from common import cli
from common.clock import MonotonicClock
from common.drive import Loop, Stopper, drive
from common.endpoint import FrameEndpoint
from common.laboratory import Setting
from common.links import link_model
from common.mailbox import LinkModel
from common.reality import Reality

STOPPED = 3


def conduct(
    role: str,
    args: argparse.Namespace,
    build: Callable[[Setting, Reality, LinkModel], Loop],
    *,
    listen: str = "",
    connect: str = "",
) -> int:
    """Run one laboratory's loop over zenoh; its exit code, 3 where it was stopped before its last tick.

    Raises:
        RthsError: what ended the test.
    """
    from common.zenoh_link import ZenohLink

    stopping = Stopper()
    plan = cli.load_plan(args)
    reality = cli.load_reality(args.reality, plan)
    patience = plan.link.connect_timeout
    link = ZenohLink(
        role, plan.test.name, listen=listen, connect=connect, patience=patience, stopping=stopping
    )
    try:
        setting = Setting(plan, FrameEndpoint(link, plan.digest()), MonotonicClock(), cli.reporter(args.json))
        loop = build(setting, reality, link_model(reality))
        loop.lab.heard_ns = setting.clock.now()
        drive(loop, stopping)
    finally:
        link.close()
    if loop.lab.error is not None:
        raise loop.lab.error
    return 0 if loop.ticks == plan.ticks else STOPPED


def enter(
    name: str,
    text: str | None,
    add_arguments: Callable[[argparse.ArgumentParser], None],
    run: Callable[[argparse.Namespace], int],
) -> int:
    """Entry of `python -m name`: parse its options and run it."""
    parser = argparse.ArgumentParser(prog=f"python -m {name}", description=text)
    add_arguments(parser)
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))
