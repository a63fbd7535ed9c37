"""`rths stop`: end a running test in order, or by an emergency stop of both laboratories."""

from __future__ import annotations

import argparse

from common.lab.operation import EMERGENCY, STOP
from rths.perform import operate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `stop`."""
    operate.add_arguments(parser)
    parser.add_argument(
        "--emergency", action="store_true", help="stop the rigs at once, without a ramp; latched until reset"
    )


def run(args: argparse.Namespace) -> int:
    """Ask the laboratories to stop; 1 where one did not."""
    return operate.carry_out(args, EMERGENCY if args.emergency else STOP)
