"""`rths init`: a plan to begin with, and the skeleton of a laboratory's rig beside it."""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from string import Template

from common.errors import InputError
from common.plan.schema import NAME, PATTERNS
from common.terminal import cli, outputs

FOLDER = Path(__file__).with_name("templates")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `init`."""
    parser.add_argument(
        "name",
        type=Path,
        metavar="NAME",
        help="name of the test; with a folder before it, the files go there",
    )
    cli.force_argument(parser)
    cli.json_argument(parser, "say which files were written as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Write both files, or none where one of them exists."""
    name = args.name.name.removesuffix(".toml")
    if not re.fullmatch(NAME, name):
        raise InputError(f"'{name}' is no name of a test: use {PATTERNS[NAME]}.")
    files = {
        args.name.with_name(f"{name}.toml"): filled("plan.toml", name),
        args.name.with_name(f"{name}_rig.py"): filled("rig.py", name),
    }
    for path in files:
        outputs.checked(path, args.force)
    for path, text in files.items():
        outputs.write_text(path, text, args.force)
    plan, rig = files
    if args.json:
        sys.stdout.write(json.dumps({"plan": str(plan), "rig": str(rig)}) + "\n")
        return 0
    sys.stdout.write(
        f"{plan}: a plan to begin with; `rths check {plan}` says what it describes, `rths run {plan}` runs it.\n"
        f"{rig}: the skeleton of a rig for each laboratory; name its classes in the plan when they are written.\n"
    )
    return 0


def filled(template: str, name: str) -> str:
    """A template with the test's name in it."""
    return Template((FOLDER / template).read_text(encoding="utf-8")).substitute(name=name)
