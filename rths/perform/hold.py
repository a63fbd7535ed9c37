"""`rths hold`: let the earthquake's time of a running test stand still, the specimens held."""

from __future__ import annotations

import argparse

from common.lab.operation import HOLD
from rths.perform import operate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `hold`."""
    operate.add_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Ask the master to hold the test; 1 where it refuses."""
    return operate.carry_out(args, HOLD)
