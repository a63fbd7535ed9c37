"""`rths campaign --compare-random`: chosen tests beside random ones in hidden laboratories."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

from common.errors import InputError
from common.terminal import outputs
from report.text.progress import Progress
from report.text.terminal import table

if TYPE_CHECKING:
    from simulation.campaign.goal import Goal

RESULTS = "comparison.json"
KINDS = ("catalogue", "formula", "pair", "clean")  # cases whose cause can be named


def run(args: argparse.Namespace, goal: Goal) -> int:
    """Play the campaigns; 1 where chosen tests are more than half as many as random ones."""
    from simulation.campaign.goal import VIRTUAL
    from simulation.workers import pool
    from simulation.workers.parts import ENDING, Way
    from validation.blind.cases.basis import basis
    from validation.blind.draw import draw
    from validation.campaigns import results
    from validation.campaigns.spreading import TABLE, compared

    if args.compare_random < 1:
        raise InputError(f"--compare-random is {args.compare_random}, but must be at least 1.")
    if goal.head.mode != VIRTUAL:
        raise InputError("--compare-random plays in virtual time: set mode in GOAL to 'virtual'.")
    pool.check(args.jobs, args.dask)
    if args.dask and goal.files:
        raise InputError(
            f"--dask plays where {goal.files[0]} may not be: give records that ship and kinds that are built in, or "
            "--jobs."
        )
    going_on = (f"{TABLE}{ENDING}",)  # of a command that was interrupted
    with (
        outputs.folder(args.output, args.force, besides=going_on) as folder,
        Progress("comparing") as progress,
    ):
        trial = basis(goal.plan, goal.plan.test.duration)
        cases = draw(args.compare_random, args.seed, args.set, trial=trial, only=KINDS)
        drawn = {"seed": args.seed, "set": args.set}
        found = compared(folder, goal, cases, drawn, Way(args.jobs, args.dask), progress.tell)
        said = results.plain(goal, found)
        outputs.write_text(folder / RESULTS, json.dumps(said, indent=1) + "\n", force=True)
    if args.json:
        sys.stdout.write(json.dumps(said) + "\n")
    else:
        table(results.rows(found))
        sys.stdout.writelines(f"{text}\n" for text in results.sentences(goal, found))
        sys.stdout.write(f"results: {folder / RESULTS}\n")
    ratio = said["summary"]["open"]["ratio"]
    return 0 if ratio is not None and ratio <= results.HALF else 1
