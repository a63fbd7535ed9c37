"""`rths diagnose`: the sim-to-real gap of a recording: where it lies, which effect causes it, how far it closes."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from common.errors import InputError
from common.plan.schema import nearest
from common.roles import MASTER, name_of
from common.terminal import cli, outputs
from common.terminal.printable import all_shown
from common.terminal.telling import Tell, untold
from report.text.progress import Progress

if TYPE_CHECKING:
    from common.plan.plan import Plan
    from common.recording.run import Run
    from diagnosis.findings.for_prediction.as_reality import FoundReality
    from diagnosis.report.records import Report

LAWS = ".npz"  # ending of the file beside the reality: laws that were learned, and how sure all of it is


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `diagnose`."""
    cli.recording_argument(parser, ", whole or of one part")
    parser.add_argument(
        "more",
        type=Path,
        nargs="*",
        default=[],
        metavar="MORE",
        help="further recordings of the same laboratories: one cause must explain all of them",
    )
    parser.add_argument(
        "--plan", metavar="PLAN", help="what the laboratories should be (default: the plan in FILE)"
    )
    parser.add_argument(
        "--ideal",
        action="store_true",
        help="compare the test with the pure simulation, whose transfer systems follow their targets at once",
    )
    parser.add_argument(
        "--name", metavar="NAME", help="the slave that is diagnosed, of several (default: each)"
    )
    parser.add_argument(
        "--json", type=Path, metavar="OUT", help="write the report as JSON; - for standard output"
    )
    parser.add_argument(
        "--found",
        type=Path,
        metavar="OUT",
        help="write what was found as a reality for rths simulate, rths run --virtual and rths predict: out.toml, and "
        "beside it out.npz with laws that were learned and how sure all of it is",
    )
    parser.add_argument("--html", type=Path, metavar="OUT", help="write the report as one HTML page")
    cli.force_argument(parser)
    parser.add_argument(
        "--require",
        type=float,
        metavar="GAP",
        help="the gap that may be left in each part, such as 0.02; the report says which parts meet it",
    )
    parser.add_argument(
        "--validate",
        type=Path,
        nargs="+",
        default=[],
        metavar="OTHER",
        help="further recordings of the same laboratories, on which the shrinkage is judged",
    )


def run(args: argparse.Namespace) -> int:
    """Diagnose and report; 0 whatever the verdict is."""
    check(args)
    with Progress("diagnosing") as progress:
        from common.recording.reader import read

        recording = read(args.file)
        names = chosen(recording, args)
        found, reality = diagnosed(
            recording,
            more=args.more,
            plan=args.plan,
            validate=args.validate,
            against_ideal=args.ideal,
            tell=progress.tell,
            require=args.require,
        )
        if args.found:
            write_found(args.found, reality(), args.force)
            found = {name: dataclasses.replace(one, found=str(args.found)) for name, one in found.items()}
        reports = [found[name] for name in names]
        report = reports[0]
        if args.html:
            from report.gap import page

            progress.tell("page")
            outputs.write_text(args.html, page.page(report), args.force)
    if args.json:
        text = json.dumps(report.plain(), allow_nan=False) + "\n"
        if str(args.json) == "-":
            sys.stdout.write(text)
            return 0
        outputs.write_text(args.json, text, args.force)
    from report.gap import terminal

    texts = [terminal.summary(all_shown(one)) for one in reports]
    outputs.aside(args.html, args.json).write("\n\n".join(texts) + "\n")
    return 0


def write_found(path: Path, found: FoundReality, force: bool) -> None:
    """Write what was found as a reality; a file beside it holds the learned laws and the uncertainties."""
    import numpy as np
    import tomli_w

    from common.reality.spread import KEY

    beside = path.with_suffix(LAWS)
    laws = {f"{law.role}.{law.machine}": np.array(law.law) for law in found.learned}
    arrays: Any = laws | found.spread.arrays()
    with outputs.writing(beside, force) as place, place.open("wb") as file:
        np.savez(file, **arrays)
    rows = [{"laboratory": law.role, "machine": law.machine, "file": beside.name} for law in found.learned]
    origin = {"found": found.tables["found"] | {KEY: beside.name}}
    tables = found.tables | origin | ({"learned": rows} if rows else {})
    outputs.write_text(path, tomli_w.dumps(tables), force)


def check(args: argparse.Namespace) -> None:
    """Raise InputError where the report cannot be written, before any work is done."""
    files = [path for path in (args.html, args.json, args.found) if path and str(path) != "-"]
    if args.found:
        if args.ideal:
            raise InputError("--found writes what the laboratories of the plan are: leave out --ideal.")
        if args.found.suffix != ".toml":
            raise InputError(f"--found names {args.found}, but writes TOML: give a name that ends in .toml.")
        files.append(args.found.with_suffix(LAWS))
    inputs = [args.file, *args.more, *args.validate, *([cli.plan_path(args.plan)] if args.plan else [])]
    for path in files:
        outputs.checked(path, args.force, inputs)
    if args.require is not None and not 0.0 < args.require < math.inf:
        raise InputError(f"--require {args.require:g} cannot be used: give a gap above 0, such as 0.02.")
    if len({outputs.target(path) for path in files}) < len(files):
        raise InputError("--html, --json and --found name one file twice: give each a file of its own.")


def chosen(recording: Run, args: argparse.Namespace) -> list[str]:
    """Names of the slaves to diagnose; an empty name for a slave without one. A JSON or HTML file holds only one."""
    names = [name_of(role) for role in recording.roles or (MASTER,)]
    if args.name and args.name not in names:
        hint = nearest(args.name, names) if any(names) else "leave out --name."
        raise InputError(f"{args.file} has no slave '{args.name}': {hint}")
    if len(names) > 1 and not args.name and (args.json or args.html):
        raise InputError(
            f"--json and --html hold the report on one laboratory: choose it with --name ({', '.join(names)})."
        )
    return [args.name] if args.name else names


def diagnose_file(path: Path, *, validate: Sequence[Path] = ()) -> Report:
    """The report on a recording of a test with one slave, or without.

    Raises:
        InputError: a file cannot be read, or holds nothing to diagnose.
    """
    from common.recording.reader import read

    return next(iter(diagnose_slaves(read(path), validate=validate).values()))


def diagnose_recording(
    path: Path, validate: Sequence[Path] = (), found: Path | None = None
) -> dict[str, Report]:
    """The reports on a recording by the name of the slave, as `diagnose_slaves`; raises InputError likewise.

    What was found is written into the file `found` and the one beside it, if given.
    """
    from common.recording.reader import read

    reports, reality = diagnosed(read(path), validate=validate)
    if found:
        write_found(found, reality(), force=True)
    return reports


def diagnose_slaves(recording: Run, **options: Any) -> dict[str, Report]:
    """The reports on a recording by the name of the slave, as `diagnosed` with the same options."""
    return diagnosed(recording, **options)[0]


def under(run: Run, plan: Plan | None, first: Run) -> Plan | None:
    """The plan that a user gave, under the ground motion of a further recording that had another than the first."""
    from report.facts.laboratories import whole_plan

    own, other = whole_plan(first), whole_plan(run)
    if plan is None or own is None or other is None or own.ground_motion == other.ground_motion:
        return plan
    return dataclasses.replace(plan, ground_motion=other.ground_motion)


def diagnosed(
    recording: Run,
    *,
    more: Sequence[Path] = (),
    plan: str | None = None,
    validate: Sequence[Path] = (),
    against_ideal: bool = False,
    tell: Tell = untold,
    require: float | None = None,
) -> tuple[dict[str, Report], Callable[[], FoundReality]]:
    """The reports on a recording by the name of the slave, and a function that makes the reality that was found.

    The name is empty where the slave has none or there is none. Each report covers the master and that slave, and its
    verdict begins with the laboratory's name where slaves have names. Effects must also explain the recordings `more`
    of the same laboratories, if given. The function raises InputError where a reality file cannot say what was found.

    Raises:
        InputError: a file cannot be read, or holds nothing to diagnose.
    """
    from common.plan import read as plans
    from common.recording.reader import read
    from diagnosis.diagnose import diagnose
    from diagnosis.findings.for_prediction.as_reality import as_reality
    from diagnosis.recorded import record
    from diagnosis.recorded.distinct import refuse_copies
    from diagnosis.recorded.slips import refuse_slips
    from report.gap import wording

    believed = plans.load(cli.plan_path(plan)) if plan else None
    own, *others = (
        {
            role: record.build(run, under(run, believed, recording), against_ideal=against_ideal, role=role)
            for role in run.roles or (MASTER,)
        }
        for run in (recording, *map(read, (*more, *validate)))
    )
    for one in (one for records in (own, *others[: len(more)]) for one in records.values()):
        refuse_slips(one, one.run.path)
    searched, held = (
        {role: [other[role] for other in some if role in other] for role in own}
        for some in (others[: len(more)], others[len(more) :])
    )
    for role in own:
        refuse_copies([own[role], *searched[role]], held[role])
    result = {}
    judged = diagnose(own, held, tell, require, searched)
    for role, (report, _) in judged.items():
        name, words = name_of(role), wording.verdict(report)
        verdict = f"Laboratory {name}: {words}" if name else words
        result[name] = dataclasses.replace(report, verdict=verdict)
    return result, partial(as_reality, {role: item.found for role, item in judged.items()})
