"""`python -m slave PLAN --connect tcp/master:7447`: laboratory B in a test on several machines."""

from __future__ import annotations

import argparse
import sys

from common.lab import process
from common.terminal import cli


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the slave."""
    cli.plan_arguments(parser)
    cli.intervals_argument(parser)
    cli.reality_argument(parser)
    cli.rt_arguments(parser)
    cli.processor_argument(parser)
    cli.accept_argument(parser)
    cli.connect_argument(parser)
    parser.add_argument("--name", metavar="NAME", help="which slave this is, where the plan names several")
    cli.json_argument(parser, "report as JSON lines on standard output")


def run(args: argparse.Namespace) -> int:
    """Run the slave; returns its exit code."""
    from slave import assembly

    return process.conduct("slave", args, assembly, connect=args.connect)


if __name__ == "__main__":
    sys.exit(process.enter("slave", __doc__, add_arguments, run))
