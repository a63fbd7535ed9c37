"""`rths serve`: laboratories as elements of a user's OpenSees model, in real time or in virtual time."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from common.errors import InterlockError, RthsError
from common.host.stopping import Stopper
from common.lab.preflight import Gate
from common.opensees import port
from common.plan.plan import Plan
from common.reality.reality import Reality
from common.terminal import cli
from report.text.progress import Progress as Working
from rths.perform import run as tests

if TYPE_CHECKING:
    from master.client.building import ClientBuilding

PATIENCE_S = (
    60.0  # s, wait for a client's next displacement in virtual time: a step of a large model takes seconds
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `serve`."""
    cli.plan_arguments(parser)
    cli.opensees_argument(parser, required=True)
    parser.add_argument(
        "--intervals",
        type=int,
        metavar="N",
        help="control intervals in which each displacement of OpenSees is imposed (default: the plan's, or 1)",
    )
    tests.test_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Serve a client; its exit code."""
    if args.intervals is None:
        args.intervals = cli.load_plan(args).structure.intervals
    plan = cli.load_plan(args)
    checked(plan, args.opensees)
    return tests.carry_out(args, plan, partial(in_virtual_time, args.opensees))


def checked(plan: Plan, addresses: Sequence[str]) -> None:
    """Raise InputError if the elements cannot be served at these addresses."""
    from master.client.building import check_count

    check_count(addresses, len(plan.kinds))
    for text in addresses:
        port.check_free(text)
        host, number = port.address_of(text)
        if port.is_open(host):
            sys.stderr.write(
                f"warning: {host}:{number} is open: anybody who can reach it can move the rigs, since OpenSees "
                "has neither keys nor passwords.\n"
            )


def in_virtual_time(
    addresses: Sequence[str], plan: Plan, reality: Reality, output: Path, stopping: Stopper, gate: Gate
) -> RthsError | None:
    """Run the test in this process, as fast as the client asks; the error that ended it, or None."""
    from master.assembly import warm_up_served
    from master.client.building import ClientBuilding
    from master.client.pace import AsFastAsItGoes
    from simulation import virtual

    lines = tests.before_the_start(plan, output, gate)
    warm_up_served(reality)
    building = ClientBuilding(plan, addresses, AsFastAsItGoes(PATIENCE_S, stopping), cli.text_report)
    sys.stderr.writelines(f"{line}\n" for line in lines)
    if not came(building, stopping):
        building.leave()
        return InterlockError(stopping())
    with Working("running") as working:
        report = partial(tests.virtual_report, working)
        bench = virtual.assemble(plan, reality, output, report, gate=gate, building=building)
        error, seconds = tests.played(bench, stopping, working)
    tests.say_speed(bench, seconds)
    return error


def came(building: ClientBuilding, stopping: Stopper) -> bool:
    """Wait until OpenSees moves the laboratories, before time passes; False if the operator stops first."""
    sys.stderr.write(f"waits for {building.awaited}\n")
    while building.awaited:
        building.look_after()
        if stopping():
            return False
    return True
