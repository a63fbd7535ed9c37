"""`python -m master PLAN --listen tcp/0.0.0.0:7447`: laboratory A in a test on several machines."""

from __future__ import annotations

import argparse
import sys

from common.lab import process
from common.terminal import cli


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the master."""
    cli.plan_arguments(parser)
    cli.intervals_argument(parser)
    cli.opensees_argument(parser)
    cli.reality_argument(parser)
    cli.rt_arguments(parser)
    cli.processor_argument(parser)
    cli.accept_argument(parser)
    cli.await_start_argument(parser)
    parser.add_argument(
        "--listen",
        default=cli.DEFAULT_ENDPOINT,
        metavar="ENDPOINT",
        help=f"where slave and recorder connect to (default: {cli.DEFAULT_ENDPOINT})",
    )
    cli.json_argument(parser, "report as JSON lines on standard output")


def run(args: argparse.Namespace) -> int:
    """Run the master; returns its exit code."""
    from master import assembly

    made = assembly.Served(args.opensees) if args.opensees else assembly
    return process.conduct("master", args, made, listen=args.listen)


if __name__ == "__main__":
    sys.exit(process.enter("master", __doc__, add_arguments, run))
