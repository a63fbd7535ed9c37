"""`python -m master PLAN --listen tcp/0.0.0.0:7447`: laboratory A in a test on two machines."""

from __future__ import annotations

import argparse
import sys

from common import cli
from common.clock import MonotonicClock
from common.drive import Stopper, drive
from common.endpoint import FrameEndpoint
from common.laboratory import Setting
from common.links import link_model


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the master."""
    cli.plan_arguments(parser)
    cli.reality_argument(parser)
    parser.add_argument(
        "--listen",
        default=cli.DEFAULT_ENDPOINT,
        metavar="ENDPOINT",
        help="where slave and recorder connect to",
    )
    cli.json_argument(parser, "report as JSON lines on standard output")


def run(args: argparse.Namespace) -> int:
    """Run the master; its exit code."""
    from common.zenoh_link import ZenohLink
    from master.assembly import build_loop

    stopping = Stopper()
    plan = cli.load_plan(args)
    reality = cli.load_reality(args.reality, plan)
    link = ZenohLink("master", plan.test.name, listen=args.listen)
    try:
        setting = Setting(plan, FrameEndpoint(link, plan.digest()), MonotonicClock(), cli.reporter(args.json))
        loop = build_loop(setting, reality, link_model(reality))
        loop.lab.heard_ns = setting.clock.now()
        drive(loop, stopping)
    finally:
        link.close()
    if loop.lab.error is not None:
        raise loop.lab.error
    return 0 if loop.ticks == plan.ticks else 3


def main() -> int:
    """Entry of `python -m master`."""
    parser = argparse.ArgumentParser(prog="python -m master", description=__doc__)
    add_arguments(parser)
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))


if __name__ == "__main__":
    sys.exit(main())
