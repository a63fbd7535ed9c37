"""`rths completion`: a script with which a shell completes commands, options, plans and recordings."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import Any

from common import cli

SHELLS = ("bash", "zsh", "fish")
RECORDINGS, TABLES = "*.mcap", "*.toml"
PATTERNS = {"reality": TABLES, "budget": TABLES, "map": TABLES}  # by destination, otherwise by placeholder:
PLACEHOLDERS = {"FILE": RECORDINGS, "OTHER": RECORDINGS, "OUT.mcap": RECORDINGS}
ANY_FILE = ("DATA", "OUT", "OUT.json", "MAP", "B.toml")
EITHER = ("A", "B")  # of `compare`: a recording, or a plan


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `completion`."""
    parser.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))


def run(args: argparse.Namespace) -> int:
    """Write the script."""
    sys.stdout.write(script(args.shell) + "\n")
    return 0


def script(shell: str) -> str:
    """The script of a shell: static, so that a completion starts no program."""
    import shtab

    return str(shtab.complete(whole(), shell))


def whole() -> argparse.ArgumentParser:
    """One parser of all commands, whose arguments say what completes them."""
    from rths.__main__ import VERBS, fill

    parser = cli.Parser(prog="rths", description="Distributed real-time hybrid testing.")
    commands = parser.add_subparsers()
    for verb, text in VERBS.items():
        command = commands.add_parser(verb, help=text, description=text)
        fill(command, verb)
        for action in command._actions:
            if (found := completer(action)) is not None:
                action.complete = found  # type: ignore[attr-defined]
    return parser


def completer(action: argparse.Action) -> Mapping[str, Any] | None:
    """What completes the values of an argument; None where nothing can, or where its choices do."""
    import shtab

    name = str(action.metavar)
    if name == "PLAN":
        return with_plans("plans", TABLES)
    if name in EITHER and not action.option_strings:
        return with_plans("sources", RECORDINGS, TABLES)
    if name == "FOLDER":
        return dict(shtab.DIRECTORY)
    if pattern := PATTERNS.get(action.dest) or PLACEHOLDERS.get(name):
        return dict(shtab.glob(pattern))
    return dict(shtab.FILE) if name in ANY_FILE else None


def with_plans(name: str, *patterns: str) -> Mapping[str, Any]:
    """Files of some patterns and the plans that ship; `name` becomes part of the shells' functions."""
    import shtab

    files: dict[str, Any] = dict(shtab.glob(*patterns))
    plans = " ".join(cli.SHIPPED)
    own = f"_rths_glob_{name}"  # by _glob_ shtab's bash script knows that these are files
    groups = f"'plans:plan that ships:({plans})' 'files:file:_files -g \"({'|'.join(patterns)})\"'"
    preamble = {
        "bash": f"{files['preamble']['bash']}\n"
        f'{own}() {{\n  {files["bash"]} "$1"\n  compgen -W "{plans}" -- "$1"\n}}\n',
        "zsh": f"{own}() {{\n  _alternative {groups}\n}}\n",
        "fish": f"{files['preamble']['fish']}\n"
        f"function {own}\n  {files['fish'].strip('()')}\n  printf '%s\\n' {plans}\nend\n",
    }
    return {"bash": own, "zsh": own, "fish": f"({own})", "preamble": preamble}
