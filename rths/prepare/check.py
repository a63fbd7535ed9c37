"""`rths check`: a description of a plan, without running it.

It imports no class of a user's rig. A rig of this program's own, in OpenSees or in an FMU, is constructed and let go,
so that one which cannot be is refused here. A plan with a user's own kind of laboratory cannot be described without
that kind's class, which is imported unless only the list of classes is asked for.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from common.plan.plan import Plan
from common.plan.toml_file import load_tables
from common.terminal import cli
from report.text.progress import Progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `check`."""
    cli.plan_arguments(parser)
    parser.add_argument(
        "--classes",
        action="store_true",
        help="only list the classes that the plan names, and import none of them",
    )
    parser.add_argument(
        "--building",
        action="store_true",
        help="of a machine by itself, describe the test that it would have with the building of the default test",
    )
    cli.json_argument(parser, "write what the plan describes as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Describe a plan; 1 where pre-flight would refuse it."""
    plan = cli.load_plan(args)
    if args.classes:
        return listed(plan, as_json=args.json)
    found = described(plan, cli.plan_path(args.plan), building=args.building)
    if args.json:
        sys.stdout.write(json.dumps(printable(found)) + "\n")
    else:
        from report.plan.text import show

        show(printable(found))
    return 0 if found["ready"] else 1


def described(plan: Plan, file: Path, *, building: bool) -> dict[str, Any]:
    """What a plan describes: a machine by itself without the default test's `building`, unless that is asked for."""
    from report.plan import machine

    tables = load_tables(file, "plan")
    if not building and machine.by_itself(plan, tables):
        return machine.facts(plan, file, tables)
    with Progress("simulating the test"):
        from report.plan.facts import facts

        return facts(plan, file)


def listed(plan: Plan, *, as_json: bool) -> int:
    """List the classes that a plan names, without importing one; exit code 0."""
    from report.plan.classes import named
    from report.plan.text import code

    found = printable([one._asdict() for one in named(plan)])
    lines = code(found, emulated=plan.emulated)
    sys.stdout.write(json.dumps({"classes": found}) + "\n" if as_json else "\n".join(lines) + "\n")
    return 0


def printable(value: Any) -> Any:
    """Plain values whose texts are safe for a terminal: those of a plan may hold escape sequences."""
    if isinstance(value, dict):
        return {name: printable(one) for name, one in value.items()}
    if isinstance(value, list):
        return [printable(one) for one in value]
    if isinstance(value, str):
        return "".join(letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in value)
    return value
