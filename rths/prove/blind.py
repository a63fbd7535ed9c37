"""`rths blind`: the diagnosis scored on cases whose effects it is not told."""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from common.errors import InputError
from common.plan import read as plans
from common.roles import title
from common.terminal import cli, outputs
from common.terminal.telling import Tell
from report.text.progress import Progress
from validation.blind.sets import SETS
from validation.blind.worker import DIAGNOSIS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from validation.blind.cases.basis import TrialBasis
    from validation.blind.cases.case import Case
    from validation.blind.predicted.next_test import FollowingTest
    from validation.blind.predicted.predict import PredictedCase
    from validation.blind.progress import CasesDone
    from validation.blind.record import RecordedCase
    from validation.blind.results.measures import Measure
    from validation.blind.results.scoring import Outcome
    from validation.blind.worker import Diagnosed


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `blind`."""
    which = parser.add_argument_group("cases")
    which.add_argument(
        "--plan", metavar="PLAN", help="the test whose laboratories are diagnosed (default: the default test)"
    )
    number = which.add_mutually_exclusive_group()
    number.add_argument("--cases", type=int, default=300, metavar="N", help="how many (default: 300)")
    number.add_argument(
        "--case",
        type=cli.whole_numbers,
        default=[],
        metavar="NUMBER,…",
        help="only the cases of the set with these numbers, as a trial prints them",
    )
    which.add_argument(
        "--set",
        choices=tuple(SETS),
        default="judge",
        help="; ".join(f"{name}: {chosen.text}" for name, chosen in SETS.items()),
    )
    which.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the set (default: 1)")
    which.add_argument(
        "--only",
        type=cli.words,
        default=[],
        metavar="KIND,…",
        help="only cases of these kinds: catalogue, formula, unknown, pair, clean, many, material",
    )
    which.add_argument(
        "--effects", type=cli.words, default=[], metavar="NAME,…", help="only cases with these effects"
    )
    which.add_argument(
        "--duration", type=float, default=30.0, metavar="S", help="length of each test (default: 30)"
    )
    cli.workers_arguments(parser)
    parser.add_argument(
        "--diagnosis",
        default=DIAGNOSIS,
        metavar="MODULE:FUNCTION",
        help="judge another diagnosis: a function from a recording's path to a diagnosis.report.records.Report, "
        "or to one by the name of each slave; with --predict it also takes `found`, the path of the reality to write",
    )
    parser.add_argument(
        "--predict",
        action="store_true",
        help="also predict the next test of each case with what was found, play it, and judge the prediction",
    )
    cli.output_argument(
        parser,
        "FOLDER",
        "folder for the page and the results (default: runs/blind)",
        default=Path("runs/blind"),
    )
    parser.add_argument("--keep", action="store_true", help="also keep recordings, plans and realities there")
    cli.force_argument(parser)
    cli.json_argument(parser, "write the results as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Draw, record, diagnose and score the cases; 1 where a goal is missed, which takes more than a few cases."""
    from simulation.workers.parts import ENDING, parts
    from simulation.workers.parts import write as write_table
    from validation.blind.cases.basis import basis
    from validation.blind.predicted.next_test import next_test
    from validation.blind.predicted.results import measures as of_predictions
    from validation.blind.predicted.results import with_stated
    from validation.blind.progress import SCHEMA, TABLE, CasesDone
    from validation.blind.progress import table as table_of
    from validation.blind.results.measures import measures
    from validation.blind.results.scoring import judge_all

    check(args)
    trial = basis(plans.load(cli.plan_path(args.plan)), args.duration)
    cases = drawn(args, trial)
    about = said_of(args, trial)
    with (
        outputs.folder(args.output, args.force, besides=(f"{TABLE}{ENDING}",)) as folder,
        parts(folder / TABLE, what(args, trial), SCHEMA, len(cases), force=True) as there,
        tempfile.TemporaryDirectory(prefix="rths-recordings-") as place,
        Progress("blind trial") as progress,
    ):
        done = CasesDone(there, cases)
        missing = record_cases(done.missing, Path(place), args.jobs, progress.tell)
        diagnose_cases(done, missing, Path(place), args, progress.tell)
        recorded, answers = done.all(Path(place))
        outcomes = judge_all(cases, recorded, answers)
        if args.keep:
            again = [case for case in cases if case.index not in missing]
            keep(
                cases,
                missing | record_cases(again, Path(place), args.jobs, progress.tell),
                Path(place),
                folder,
            )
        following = [next_test(case, args.seed, args.set, trial) for case in cases] if args.predict else []
        foretold = predict_cases(following, recorded, Path(place), args, progress.tell)
        predicted = with_stated(foretold, outcomes)
        found = write(folder, outcomes, about, predicted)
        write_table(folder / TABLE, table_of(cases, found["cases"]), force=True)
    table = [*measures(outcomes), *(of_predictions(predicted) if predicted else ())]
    if args.json:
        sys.stdout.write(json.dumps(found) + "\n")
    else:
        show(table, outcomes, predicted)
        sys.stdout.write(f"page: {folder / 'index.html'}\n")
    return 1 if any(item.passed is False for item in table) else 0


def drawn(args: argparse.Namespace, trial: TrialBasis) -> list[Case]:
    """The cases asked for."""
    from validation.blind.draw import draw, numbered

    if args.case:
        return numbered(args.case, args.seed, args.set, trial=trial)
    return draw(args.cases, args.seed, args.set, trial=trial, only=args.only, effects=args.effects)


def said_of(args: argparse.Namespace, trial: TrialBasis) -> str:
    """One or two sentences on how the cases are made."""
    from validation.blind.library import own_kernels

    plan = f"of the plan '{args.plan}', " if args.plan else ""
    count = f"Case {', '.join(map(str, args.case))}" if args.case else f"{args.cases} cases"
    text = (
        f"{count} {plan}of the set '{args.set}', seed {args.seed}, {args.duration:g} s each, "
        f"{', '.join(args.only) or 'all kinds'}; diagnosis {args.diagnosis}."
    )
    own = " and ".join(map(title, own_kernels(trial.plan)))
    if own:
        text += (
            f" The laboratory of the {own} is of a user's kind, which has no second implementation: its own kernel "
            "emulates it, with parameters inside their tolerances."
        )
    return text


def check(args: argparse.Namespace) -> None:
    """Raise InputError for values out of range and for missing parts, before any work is done."""
    from simulation.workers import pool
    from validation.blind.judge import diagnose_all

    for name, value, fits, wanted in (
        ("--cases", args.cases, args.cases >= 1, "at least 1"),
        ("--seed", args.seed, args.seed >= 0, "at least 0"),
        ("--duration", args.duration, 1.0 <= args.duration <= 600.0, "between 1 and 600 s"),
    ):
        if not fits:
            raise InputError(f"{name} is {value}, but must be {wanted}.")
    if args.case and (args.only or args.effects):
        raise InputError("--case names cases by their numbers: leave out --only and --effects.")
    pool.check(args.jobs, args.dask)
    if args.diagnosis != DIAGNOSIS:
        with tempfile.TemporaryDirectory(prefix="rths-nothing-") as folder:
            diagnose_all(Path(folder), diagnosis=args.diagnosis)


def record_cases(cases: Sequence[Case], folder: Path, jobs: int, tell: Tell) -> dict[int, RecordedCase]:
    """Recordings by the number of the case."""
    from validation.blind.record import record_all

    recorded: dict[int, RecordedCase] = {}
    tell("recorded", 0, len(cases))
    for item in record_all(cases, folder, jobs):
        recorded[item.index] = item
        tell("recorded", len(recorded), len(cases))
    return recorded


def diagnose_cases(
    cases: CasesDone,
    recorded: dict[int, RecordedCase],
    place: Path,
    args: argparse.Namespace,
    tell: Tell,
) -> None:
    """Diagnose the recordings in the folder `place`, and keep each answer as soon as it is there."""
    from validation.blind.judge import diagnose_all

    if not recorded:
        return
    by_name = {Path(one.name).stem: one for one in recorded.values()}
    count = itertools.count(1)
    tell("diagnosed", 0, len(recorded))

    def done(said: Diagnosed) -> None:
        cases.add(by_name[said.name], said)
        tell("diagnosed", next(count), len(recorded))

    diagnose_all(
        place, jobs=args.jobs, dask=args.dask, diagnosis=args.diagnosis, done=done, found=args.predict
    )


def what(args: argparse.Namespace, trial: TrialBasis) -> dict[str, Any]:
    """What the answers of a trial depend on, by names."""
    from simulation.workers.versions import versions

    names = ("cases", "case", "set", "seed", "only", "effects", "duration", "diagnosis", "predict")
    said = {name: getattr(args, name) for name in names}
    return said | {"plan": trial.plan.digest(), "version": versions()}


def predict_cases(
    following: Sequence[FollowingTest],
    recorded: dict[int, RecordedCase],
    place: Path,
    args: argparse.Namespace,
    tell: Tell,
) -> list[PredictedCase]:
    """The predictions of all next tests, judged, in the order of the cases; `place` holds the findings."""
    from validation.blind.predicted.predict import predict_all

    work = [(one, (place / recorded[one.case.index].name).with_suffix(".toml")) for one in following]
    done: list[PredictedCase] = []
    tell("predicted", 0, len(work))
    for item in predict_all(work, args.jobs, args.output if args.keep else None):
        done.append(item)
        tell("predicted", len(done), len(work))
    return sorted(done, key=lambda item: item.index)


def keep(cases: Iterable[Case], recorded: dict[int, RecordedCase], place: Path, folder: Path) -> None:
    """Copy the recordings, plans and realities of all cases into the folder, after all diagnoses."""
    import shutil

    import tomli_w

    for case in cases:
        kept = folder / f"case-{case.index:05d}"
        kept.mkdir(exist_ok=True)
        shutil.copy(place / recorded[case.index].name, kept / "recording.mcap")
        (kept / "plan.toml").write_text(tomli_w.dumps(case.plan), encoding="utf-8")
        (kept / "reality.toml").write_text(tomli_w.dumps(case.reality()), encoding="utf-8")


def write(
    folder: Path, outcomes: Sequence[Outcome], about: str, predicted: Sequence[PredictedCase]
) -> dict[str, Any]:
    """The page and the results in a folder; the results."""
    from validation.blind.predicted.results import results as of_predictions
    from validation.blind.results.measures import results
    from validation.blind.results.page import page

    found = {"version": 1, "about": about, **results(outcomes)}
    if predicted:
        found["predictions"] = of_predictions(predicted)
    (folder / "index.html").write_text(page(outcomes, about, predicted), encoding="utf-8")
    (folder / "results.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    return found


def show(table: Sequence[Measure], outcomes: Sequence[Outcome], predicted: Sequence[PredictedCase]) -> None:
    """Write the measures, the table of cases, that of predictions, and a line on each case whose answer is wrong."""
    from report.text import terminal
    from validation.blind.predicted import results
    from validation.blind.results.page import hidden, number
    from validation.blind.results.rows import HEAD, case_rows

    rows = [["measure", "value", "cases", "goal", ""]]
    rows += [[item.name, item.text, str(item.count), item.goal, item.verdict] for item in table]
    terminal.table(rows)
    sys.stdout.write("\n")
    terminal.table([list(HEAD), *(list(item.cells) for item in case_rows(outcomes))])
    if predicted:
        sys.stdout.write("\n")
        terminal.table([list(results.HEAD), *(list(results.cells(item)) for item in predicted)])
    wrong = [item for item in outcomes if not item.right]
    sys.stdout.write(f"\n{len(outcomes) - len(wrong)} of {len(outcomes)} cases right\n")
    for item in wrong:
        size = f", size {number(item.size)}" if item.truth else ""
        sys.stdout.write(f"case {item.index} ({item.kind}{size}): {hidden(item)}: {item.why}\n")
