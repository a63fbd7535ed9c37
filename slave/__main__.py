"""`python -m slave PLAN --connect tcp/master:7447`: laboratory B in a test on two machines."""

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
    """Options of the slave."""
    cli.plan_arguments(parser)
    cli.reality_argument(parser)
    parser.add_argument(
        "--connect", default=cli.DEFAULT_ENDPOINT, metavar="ENDPOINT", help="where the master listens"
    )
    cli.json_argument(parser, "report as JSON lines on standard output")


def run(args: argparse.Namespace) -> int:
    """Run the slave; its exit code."""
    from common.zenoh_link import ZenohLink
    from slave.assembly import build_loop

    stopping = Stopper()
    plan = cli.load_plan(args)
    reality = cli.load_reality(args.reality, plan)
    patience = plan.link.connect_timeout
    link = ZenohLink("slave", plan.test.name, connect=args.connect, patience=patience, stopping=stopping)
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
    """Entry of `python -m slave`."""
    parser = argparse.ArgumentParser(prog="python -m slave", description=__doc__)
    add_arguments(parser)
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))


if __name__ == "__main__":
    sys.exit(main())
