"""`rths benchmark2020`: the field's public benchmark of real-time hybrid simulation, and every compensator on it."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from common.errors import InputError
from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    from common.plan.laboratory_tables import CompensatorTable

MOST_PLANTS = 1000  # fifty times the benchmark's own 20: hours of computing
PROCESSORS = len(os.sched_getaffinity(0))
USUAL = {"plants": 20, "seed": 2020, "only": None, "jobs": PROCESSORS, "dask": "", "json": False}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `benchmark2020`."""
    parser.add_argument(
        "--plants",
        type=int,
        default=USUAL["plants"],
        metavar="N",
        help="number of random transfer systems beside the nominal one (default: 20)",
    )
    parser.add_argument(
        "--seed", type=int, default=USUAL["seed"], metavar="N", help="seed of the plants (default: 2020)"
    )
    parser.add_argument(
        "--only", type=cli.words, metavar="NAME,…", help="only these settings of the compensators"
    )
    cli.workers_arguments(parser, jobs=PROCESSORS)
    cli.output_argument(
        parser,
        "FOLDER",
        "folder for page, pictures and results (default: runs/benchmark2020); with --plan the plan's file",
    )
    parser.add_argument(
        "--plan",
        type=int,
        metavar="CASE",
        help="write the plan of a case, 1 to 4, and run nothing",
    )
    parser.add_argument(
        "--compensator", metavar="NAME", help="with --plan: the setting of its compensator (default: sample)"
    )
    cli.force_argument(parser)
    cli.json_argument(parser, "write the results as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Play all tests, or write a plan; 1 where a goal is missed."""
    check(args)
    if args.plan is not None:
        return write_plan(args)
    from simulation.workers.parts import ENDING, Way
    from validation.benchmark2020.spreading import TABLE

    settings = chosen(args.only)
    going_on = (f"{TABLE}{ENDING}",)  # of a command that was interrupted
    place = outputs.folder(args.output or Path("runs/benchmark2020"), args.force, besides=going_on)
    with place as folder, Progress("benchmark") as progress:
        from validation.benchmark2020 import evidence, figures, page, text
        from validation.proof import draw_all

        found = evidence.gather(
            folder, settings, args.plants, args.seed, Way(args.jobs, args.dask), progress.tell
        )
        progress.tell("figures")
        pictures = draw_all(figures.wanted(found), found, folder)
        checks = evidence.checks(found)
        results = json.dumps(text.as_json(found, checks))
        (folder / "index.html").write_text(page.page(found, checks, pictures), encoding="utf-8")
        (folder / "results.json").write_text(results + "\n", encoding="utf-8")
    if args.json:
        sys.stdout.write(results + "\n")
    else:
        text.show(found, checks)
        sys.stdout.write(f"page: {folder / 'index.html'}\n")
    return 0 if all(item.passed for item in checks) else 1


def check(args: argparse.Namespace) -> None:
    """Raise InputError for values out of range and for options that contradict each other."""
    from simulation.workers import pool

    if args.plan is not None:
        for name, unused in USUAL.items():
            if getattr(args, name) != unused:
                raise InputError(f"--plan writes a plan and runs nothing: leave out --{name}.")
        return
    if args.compensator is not None:
        raise InputError(
            "--compensator says which plan --plan writes; give --only NAME,… to compare some settings."
        )
    for name, value, fits, wanted in (
        ("--plants", args.plants, 0 <= args.plants <= MOST_PLANTS, f"between 0 and {MOST_PLANTS}"),
        ("--seed", args.seed, args.seed >= 0, "at least 0"),
    ):
        if not fits:
            raise InputError(f"{name} is {value}, but must be {wanted}.")
    pool.check(args.jobs, args.dask)


def chosen(only: list[str] | None) -> dict[str, CompensatorTable]:
    """The settings of these names, all of them where none are asked for; raises InputError for an unknown one."""
    from validation.benchmark2020.problem import SETTINGS

    if only == []:
        raise InputError(f"--only names no setting of the compensators: give some of {', '.join(SETTINGS)}.")
    return {name: setting(name) for name in only or SETTINGS}


def setting(name: str) -> CompensatorTable:
    """A setting by its name; raises InputError where there is none."""
    from common.plan.schema import nearest
    from validation.benchmark2020.problem import SETTINGS

    if name not in SETTINGS:
        raise InputError(f"Unknown setting '{name}' of the compensators: {nearest(name, SETTINGS)}")
    return SETTINGS[name]


def write_plan(args: argparse.Namespace) -> int:
    """Write the plan of one case, which can be run, recorded and diagnosed as any other."""
    from validation.benchmark2020.problem import CASES, EL_CENTRO, planned, with_compensator

    cases = {case.number: case for case in CASES}
    if args.plan not in cases:
        raise InputError(f"--plan is {args.plan}, but must be a case of the benchmark, 1 to {len(CASES)}.")
    plan = with_compensator(planned(cases[args.plan], EL_CENTRO), setting(args.compensator or "sample"))
    path = args.output or Path(f"{plan.test.name}.toml")
    outputs.write_text(path, plan.toml(), args.force)
    outputs.aside(path).write(f"written: {path}\n")
    return 0
