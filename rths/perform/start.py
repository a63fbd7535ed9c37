"""`rths start`: begin the test whose armed laboratories wait for it."""

from __future__ import annotations

import argparse

from common.lab.operation import START
from rths.perform import operate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `start`."""
    operate.add_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Ask the laboratories to start; 1 where one did not."""
    return operate.carry_out(args, START)
