"""`rths bench`: a component test of one part, recorded like any run."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from typing import TYPE_CHECKING, Any

from common.terminal import cli
from common.terminal.telling import untold
from report.text.progress import Progress

if TYPE_CHECKING:
    from simulation.benches import BenchResult

PARTS = ("column", "actuator", "table", "damper", "target")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `bench`."""
    parser.add_argument(
        "part",
        choices=PARTS,
        metavar="PART",
        help=f"{', '.join(PARTS[:-1])}; or target, which lets any laboratory follow steps, sines and a sweep",
    )
    parser.add_argument(
        "plan", metavar="PLAN", help=f"TOML file of the test; {', '.join(cli.SHIPPED)} for those that ship"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="seed of noise and random wave")
    cli.reality_argument(parser)
    parser.add_argument(
        "--compensated", action="store_true", help="put the plan's compensator in front of the part"
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="PIECE",
        help="play only pieces whose name begins with this (step, sine, random, sweep, static); may be repeated",
    )
    parser.add_argument(
        "--name",
        metavar="NAME",
        help="the laboratory, where several have the part: a slave's name, master, or slave for a slave without a name",
    )
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument("--virtual", action="store_true", help="virtual clock, as fast as it goes (default)")
    clock.add_argument("--real-time", action="store_true", help="wall clock")
    cli.output_argument(parser, "FILE", "the recording (default: runs/<test>-bench-<part>-<time>.mcap)")
    cli.force_argument(parser)
    cli.json_argument(parser, "write the summary as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Play the bench test of a part; its exit code."""
    from common.host.stopping import Stopper
    from common.plan import read as plans

    plan = plans.with_test(plans.load(cli.plan_path(args.plan)), seed=args.seed)
    # In real time no thread of a progress bar may run beside the loop.
    with contextlib.nullcontext() if args.real_time else Progress("bench test") as progress:
        from recorder import files
        from simulation import benches

        order = benches.Order(args.part, args.compensated, tuple(args.only), args.real_time, args.name or "")
        reality = cli.load_reality(args.reality, plan)
        tell = progress.tell if progress else untold
        with files.reserved(args.output, plan, f"bench-{args.part}", force=args.force) as path:
            result = benches.play(plan, reality, order, path, Stopper(), tell)
    if args.json:
        sys.stdout.write(json.dumps(summary(result)) + "\n")
    else:
        role = benches.role_of(plan, args.part, args.name or "")
        show(result, f" --plan {args.plan}" if ":" in plan.kinds[role] else "")
    if result.error is not None:
        raise result.error
    return 0


def summary(result: BenchResult) -> dict[str, Any]:
    """The summary of a bench test as plain values."""
    return {
        "file": str(result.path),
        "part": result.part,
        "ticks": result.ticks,
        "late_ticks": result.late,
        "segments": [segment._asdict() for segment in result.segments],
    }


def show(result: BenchResult, more: str) -> None:
    """Write the summary as text, with the command that evaluates the recording; `more` holds further options of it."""
    from report.text.terminal import table

    rows = [["piece", "from", "to"]]
    interval = result.interval
    rows += [
        [segment.name, f"{segment.begin * interval:.3f} s", f"{segment.end * interval:.3f} s"]
        for segment in result.segments
    ]
    table(rows)
    sys.stdout.write(f"{result.ticks} ticks, {result.late} late, recorded in {result.path}\n")
    sys.stdout.write(f"next: rths identify {result.path}{more}\n")
