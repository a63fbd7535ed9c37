"""`rths faults`: whole tests simulated with random faults, and the invariants that must hold in all of them."""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import TYPE_CHECKING, Any

from common.errors import InputError
from common.terminal import cli
from report.text.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.faults.schedule import Schedule
    from validation.faults.trial import TrialResult

MANY = 100  # schedules by default: about an hour of virtual time


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `faults`."""
    parser.add_argument(
        "--seed",
        type=int,
        metavar="N",
        help="seed of the first schedule; without --schedules, of a single one (default: 1)",
    )
    parser.add_argument(
        "--schedules",
        type=int,
        metavar="N",
        help=f"number of schedules, with consecutive seeds (default: {MANY})",
    )
    parser.add_argument(
        "--duration", type=float, metavar="S", help="length of each test (default: drawn, 10 to 60 s)"
    )
    parser.add_argument(
        "--schedule", metavar="LINE", help="play this schedule, as printed before, or changed"
    )
    parser.add_argument("--recorded", action="store_true", help="with a recorder, which may fail too")
    parser.add_argument(
        "--jobs", type=int, default=1, metavar="N", help="number of processes; -1 for one per processor"
    )
    cli.json_argument(parser, "write the results as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Draw schedules, simulate them and check the invariants; 1 where one is violated."""
    from simulation.workers.pool import spread
    from validation.faults.trial import play

    chosen = schedules(args)
    started, results = time.monotonic(), []
    with Progress("faults") as progress:
        progress.tell("played", 0, len(chosen))
        for result in spread(play, chosen, args.jobs):
            results.append(result)
            progress.tell("played", len(results), len(chosen))
    results.sort(key=lambda result: result.schedule.seed)
    found = summary(results, time.monotonic() - started, reproduction(args))
    if args.json:
        sys.stdout.write(json.dumps(found) + "\n")
    else:
        show(found, results)
    return 1 if found["violations"] else 0


def schedules(args: argparse.Namespace) -> list[Schedule]:
    """The schedules to play; raises InputError for values out of range."""
    from simulation.workers import pool
    from validation.faults.schedule import draw, parse

    alone = args.seed is not None and args.schedules is None
    count = 1 if alone else MANY if args.schedules is None else args.schedules
    seed = 1 if args.seed is None else args.seed
    for name, value, fits, wanted in (
        ("--seed", seed, seed >= 0, "at least 0"),
        ("--schedules", count, count >= 1, "at least 1"),
        ("--duration", args.duration, args.duration is None or 1.0 <= args.duration <= 600.0, "1 to 600 s"),
    ):
        if not fits:
            raise InputError(f"{name} is {value}, but must be {wanted}.")
    pool.check(args.jobs, "")
    if args.schedule is not None:
        return [parse(args.schedule)]
    return [draw(one, args.duration, recorded=args.recorded) for one in range(seed, seed + count)]


def reproduction(args: argparse.Namespace) -> str:
    """The command that plays one of these schedules again, with a place for its seed."""
    if args.schedule is not None:
        return f"rths faults --schedule '{args.schedule}'"
    length = "" if args.duration is None else f" --duration {args.duration:g}"
    return "rths faults" + length + (" --recorded" if args.recorded else "") + " --seed {seed}"


def summary(results: Sequence[TrialResult], spent: float, again: str) -> dict[str, Any]:
    """Counts, times (s) and violations as plain values."""
    from collections import Counter

    faults = Counter(fault.kind for result in results for fault in result.schedule.faults)
    ends = Counter(end for result in results for end in set(result.ends.values()))
    return {
        "version": 1,
        "schedules": len(results),
        "virtual_time": round(sum(result.virtual_time for result in results), 3),
        "computing_time": round(spent, 3),
        "faults": dict(sorted(faults.items())),
        "ends": dict(sorted(ends.items())),
        "violations": [
            {
                "seed": result.schedule.seed,
                "invariant": violation.invariant,
                "text": violation.text,
                "again": again.format(seed=result.schedule.seed),
                "schedule": str(result.schedule),
            }
            for result in results
            for violation in result.violations
        ],
    }


def show(found: dict[str, Any], results: Sequence[TrialResult]) -> None:
    """Write the counts, the course of a single schedule, and each violation with the command that shows it again."""
    if len(results) == 1:
        sys.stdout.write(f"{results[0].schedule}\n")
        for line in results[0].course:
            sys.stdout.write(f"  {line}\n")
    virtual, spent = found["virtual_time"], found["computing_time"]
    sys.stdout.write(
        f"{found['schedules']} schedules, {sum(found['faults'].values())} faults, "
        f"{virtual:.0f} s of virtual time in {spent:.0f} s ({virtual / max(spent, 1e-9):.0f} times real time)\n"
    )
    for item in found["violations"]:
        sys.stdout.write(f"{item['invariant']}: {item['text']}\n    {item['again']}\n")
    broken = len({item["seed"] for item in found["violations"]})
    sys.stdout.write(f"violations: {len(found['violations'])} in {broken} schedules\n")
