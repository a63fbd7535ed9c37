"""`rths campaign`: tests and diagnoses in turn, each test the one that tells most, until the cause is certain."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from common.errors import InputError, InterlockError
from common.plan.plan import Plan
from common.roles import name_of
from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    from diagnosis.findings.report import Judged
    from simulation.campaign.actions import CampaignActions, Play
    from simulation.campaign.goal import Goal
    from simulation.campaign.steps import Step

PAGE = "index.html"
REACHED = ("certain", "gap")  # ends that are what was asked for


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `campaign`."""
    parser.add_argument(
        "goal", type=Path, metavar="GOAL", help="tests to choose from, goal and limits (TOML)"
    )
    cli.output_argument(
        parser,
        "FOLDER",
        "recordings, diagnoses, log and page; a campaign that is there goes on",
        required=True,
    )
    parser.add_argument(
        "--played", type=Path, metavar="FILE", help="the recording of the test that a person was to play"
    )
    parser.add_argument(
        "--beside", action="store_true", help="play in real time although another test runs on this machine"
    )
    cli.accept_argument(parser)
    compared = parser.add_argument_group("comparison with random tests")
    compared.add_argument(
        "--compare-random",
        type=int,
        metavar="N",
        help="instead, play the campaign in N hidden laboratories of the blind trial, with chosen tests and with "
        "random ones, and count the tests until the right cause is certain",
    )
    compared.add_argument(
        "--seed", type=int, default=1, metavar="N", help="seed of the hidden laboratories (default: 1)"
    )
    compared.add_argument(
        "--set",
        choices=("judge", "tune"),
        default="judge",
        help="set of the hidden laboratories (default: judge)",
    )
    cli.workers_arguments(parser)
    cli.force_argument(parser)
    cli.json_argument(parser, "write the result as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Go on with a campaign; 0 where its goal is reached or a person has to act, 1 where it ended otherwise."""
    check(args)
    from simulation.campaign import goal as goals

    goal = goals.load(args.goal)
    if args.compare_random is not None:
        from rths.prove import random_tests

        return random_tests.run(args, goal)
    played_by_hand(args, goal)
    play = playing(args, goal)
    folder = made(args.output)
    with Progress("campaign") as progress:
        steps = gone_on(args, goal, play, folder, progress)
        progress.tell("page")
        texts = written(goal, steps, folder)
    from simulation.campaign.steps import DecidedStep, EndedStep, plain

    last = steps[-1]
    if args.json:
        sys.stdout.write(json.dumps({"steps": list(map(plain, steps)), "folder": str(folder)}) + "\n")
    else:
        sys.stdout.writelines(f"{text}\n" for text in texts)
        sys.stdout.write(f"page: {folder / PAGE}\n")
    reached = isinstance(last, DecidedStep) or (isinstance(last, EndedStep) and last.outcome in REACHED)
    return 0 if reached else 1


def played_by_hand(args: argparse.Namespace, goal: Goal) -> None:
    """Raise InputError where a recording is given to a campaign that plays its tests itself."""
    from simulation.campaign.goal import BY_HAND

    if args.played and goal.head.mode != BY_HAND:
        raise InputError(
            f"--played is for the mode 'by hand', but the mode of {args.goal} is '{goal.head.mode}'."
        )


def check(args: argparse.Namespace) -> None:
    """Raise InputError for options that do not apply, and for a folder with files of something else."""
    if args.compare_random is not None:
        return
    if args.force:
        raise InputError(
            "--force is for --compare-random: a campaign that is there goes on; give another folder for a new one."
        )
    if args.jobs != 1 or args.dask:
        raise InputError("--jobs and --dask are for --compare-random: leave them out.")
    from simulation.campaign.log import LOG

    path = args.output
    if outputs.there(path) and not path.is_dir():
        raise outputs.exists(path)
    if path.is_dir() and any(path.iterdir()) and not (path / LOG).exists():
        raise InputError(
            f"The folder {path} is not empty and nothing in it is replaced, because it holds no campaign: give another "
            "with -o."
        )


def made(path: Path) -> Path:
    """The campaign's folder, created where it is not there."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"Cannot write into {path}: {error.strerror}; give another folder with -o."
        ) from None
    return path


def gone_on(args: argparse.Namespace, goal: Goal, play: Play, folder: Path, progress: Progress) -> list[Step]:
    """The steps of the campaign after all that can be done."""
    from simulation.campaign import actions, choice, course, log

    with log.opened(folder) as kept:
        course.check(kept.steps, goal.digest)
        actions.tidied(folder)
        work = actions.CampaignActions(goal, folder, play, keep, progress.tell)
        if args.played:
            given(args.played, kept.steps, work, folder)
        course.go_on(kept, work, choice.choosing(goal.head, gentle=goal.gentle))
        return kept.steps


def given(recording: Path, steps: Sequence[Step], work: CampaignActions, folder: Path) -> None:
    """Take the recording of the test that is next into the folder; raises InputError where none is awaited."""
    from simulation.campaign import actions
    from simulation.campaign.steps import DecidedStep

    last = steps[-1] if steps else None
    if not isinstance(last, DecidedStep):
        raise InputError(f"The campaign in {folder} awaits no test: leave out --played.")
    actions.take(recording, last, folder, work.plan(last))


def playing(args: argparse.Namespace, goal: Goal) -> Play:
    """What plays the tests in the goal's mode."""
    from rths.perform import run as runs
    from simulation.campaign import actions
    from simulation.campaign.goal import BY_HAND, VIRTUAL, plan_of

    if goal.head.mode == BY_HAND:
        return by_hand
    reality = goal.base / goal.head.reality if goal.head.reality else None
    runs.check(cli.load_reality(reality, plan_of(goal, 1, 1)))
    if goal.head.mode == VIRTUAL:
        return actions.virtually(actions.of_file(reality, goal.head.seed))
    return in_real_time(args, reality)


def by_hand(_plan: Plan, _test: int, _path: Path) -> bool:
    """A person plays the tests."""
    return False


def in_real_time(args: argparse.Namespace, reality: Path | None) -> Play:
    """Plays tests in real time, with a process for each role."""
    from simulation.campaign.actions import name

    def play(plan: Plan, test: int, path: Path) -> bool:
        from common.host.stopping import Stopper
        from common.lab.preflight import Gate
        from recorder.files import reserved
        from rths.__main__ import parser_for
        from rths.perform import run as runs

        words = [str(path.with_name(f"{name(test)}.toml")), "-o", str(path)]
        words += ["--reality", str(reality)] if reality else []
        words += ["--beside"] if args.beside else []
        words += [word for risk in args.accept_risk for word in ("--accept-risk", risk)]
        told = parser_for("run").parse_args(words)
        truth, gate = cli.load_reality(reality, plan), Gate(cli.accepted_risks(told))
        stopping = Stopper()
        try:
            with reserved(path, plan, force=True) as output:
                error = runs.in_real_time(told, plan, truth, output, stopping, gate)
        finally:
            stopping.release()
        if stopping():  # the user ends the campaign, an interlock only the test
            raise error or InterlockError(stopping())
        if error is not None and not isinstance(error, InterlockError):
            raise error
        return True

    return play


def keep(path: Path, judged: Mapping[str, Judged]) -> None:
    """Write the reports of a diagnosis as JSON and as pages, and what was found as a reality."""
    from diagnosis.findings.for_prediction.as_reality import as_reality
    from report.gap import page, wording
    from rths.examine.diagnose import write_found

    for role, (report, _) in judged.items():
        stem = f"{path.stem}-{name_of(role)}" if name_of(role) else path.stem
        said = dataclasses.replace(report, verdict=wording.verdict(report))
        outputs.write_text(path.with_name(f"{stem}.html"), page.page(said), force=True)
        outputs.write_text(
            path.with_name(f"{stem}.json"), json.dumps(said.plain(), allow_nan=False) + "\n", force=True
        )
    found = as_reality({role: one.found for role, one in judged.items()})
    write_found(path.with_name(f"{path.stem.replace('diagnosis', 'found')}.toml"), found, force=True)


def written(goal: Goal, steps: list[Step], folder: Path) -> list[str]:
    """The campaign in sentences; the same and the page are written into the folder."""
    from report.campaign import page, tables

    texts = list(tables.lines(goal, steps))
    outputs.write_text(folder / "summary.txt", "".join(f"{text}\n" for text in texts), force=True)
    outputs.write_text(folder / PAGE, page.page(goal, steps), force=True)
    return texts
