"""`rths reset`: let laboratories leave their latched safe state once its cause is gone."""

from __future__ import annotations

import argparse

from common.lab.operation import RESET
from rths.perform import operate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `reset`."""
    operate.add_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Ask the laboratories to reset; 1 where one did not."""
    return operate.carry_out(args, RESET)
