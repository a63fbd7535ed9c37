"""`rths resume`: let a held test go on."""

from __future__ import annotations

import argparse

from common.lab.operation import RESUME
from rths.perform import operate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `resume`."""
    operate.add_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Ask the master to let a held test go on; 1 where it refuses."""
    return operate.carry_out(args, RESUME)
