"""`rths completion`: a script with which a shell completes commands, options, plans and recordings."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from common.errors import InputError
from common.terminal import cli

SHELLS = ("bash", "zsh", "fish")
RECORDINGS, TABLES = "*.mcap", "*.toml"
PATTERNS = {"reality": TABLES, "budget": TABLES, "map": TABLES}  # by destination, otherwise by placeholder:
PLACEHOLDERS = {"FILE": RECORDINGS, "OTHER": RECORDINGS, "OUT.mcap": RECORDINGS}
ANY_FILE = ("DATA", "OUT", "OUT.json", "MAP", "B.toml")
EVALUATED = "$zsh_eval_context[-1] == eval"
SOURCED = "$zsh_eval_context[-1] == (eval|file)"
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

    found = str(shtab.complete(whole(), shell))
    return registering(found) if shell == "zsh" else found


def registering(text: str) -> str:
    """Shtab's script for zsh, made to register where it is sourced from a file too, not by `eval` alone.

    Raises:
        InputError: this version of shtab writes another script, in which the place to change is not found.
    """
    if text.count(EVALUATED) != 1:
        raise InputError(
            "The completions for zsh need another version of shtab: install the one in requirements.lock."
        )
    return text.replace(EVALUATED, SOURCED)


def whole() -> argparse.ArgumentParser:
    """One parser of all commands, in which each argument has its completer."""
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
    """The completer of an argument's values; None where there is none, or where its choices complete it."""
    import shtab

    name = str(action.metavar)
    if name == "PLAN":
        return with_plans("plans", TABLES)
    if name in EITHER and not action.option_strings:
        return with_plans("sources", RECORDINGS, TABLES)
    if name == "FOLDER":
        return dict(shtab.DIRECTORY)
    if pattern := PATTERNS.get(action.dest) or PLACEHOLDERS.get(name):
        return files(pattern)
    return dict(shtab.FILE) if name in ANY_FILE else None


def files(*patterns: str) -> Mapping[str, Any]:
    """Completer of files with some patterns; a single one gets no brackets, which zsh would take for qualifiers."""
    import shtab

    return dict(shtab.glob(*patterns)) | {"zsh": f"_files -g '{either(patterns)}'"}


def either(patterns: Sequence[str]) -> str:
    """Patterns as a single pattern of zsh."""
    return patterns[0] if len(patterns) == 1 else f"({'|'.join(patterns)})"


def with_plans(name: str, *patterns: str) -> Mapping[str, Any]:
    """Completer of files with some patterns and of the plans that ship; `name` goes into the shells' functions."""
    found = files(*patterns)
    plans = " ".join(cli.SHIPPED)
    own = f"_rths_glob_{name}"  # _glob_ tells shtab's bash script that these are files
    groups = f"'plans:plan that ships:({plans})' 'files:file:_files -g \"{either(patterns)}\"'"
    preamble = {
        "bash": f"{found['preamble']['bash']}\n"
        f'{own}() {{\n  {found["bash"]} "$1"\n  compgen -W "{plans}" -- "$1"\n}}\n',
        "zsh": f"{own}() {{\n  _alternative {groups}\n}}\n",
        "fish": f"{found['preamble']['fish']}\n"
        f"function {own}\n  {found['fish'].strip('()')}\n  printf '%s\\n' {plans}\nend\n",
    }
    return {"bash": own, "zsh": own, "fish": f"({own})", "preamble": preamble}
