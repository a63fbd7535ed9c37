"""Runs the commands of a page: `python -m docs.console docs/tutorial.md` lists where its text and their output differ.

A fenced block of the language `console` holds commands after `$ ` (continued after `> `) and what they print. `…` in
a line stands for anything within it, a line `…` for any lines. Its commands share one shell; one that fails is
followed by `$ echo $?`. An HTML comment before a block says more of it:

    <!-- file: plan.toml -->     the block is that file, relative to the folder in which the page is run
    <!-- terminal: slave -->     the block runs beside the next ones; it is awaited after the next that has no terminal

All blocks of a page run in order in one fresh folder, in which `examples` are those that ship.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parent.parent
DIRECTIVE = re.compile(r"<!-- (file|terminal): (\S+) -->\s*")
ANYTHING = "…"
MARK = "-- exit of the command"
TIMEOUT_S = 180.0
LAST_WORDS_S = 5.0  # of a block that was killed
PROGRESS = re.compile(
    r"[a-z ]+: (?:.+, )?\d+ s"
)  # of report/text/progress.py: how often depends on the machine


class Block(NamedTuple):
    """One fenced or indented block of a page; `directive` is `file`, `terminal` or empty, `name` its argument."""

    line: int  # in the page, from 1
    language: str
    text: str
    directive: str = ""
    name: str = ""


class Command(NamedTuple):
    """A command, and what the page says that it prints."""

    text: str
    expected: str


def blocks(markdown: str) -> Iterator[Block]:
    """The blocks of a page in order; raises ValueError for a directive without a block after it."""
    pending: tuple[str, str] | None = None
    for token in MarkdownIt("commonmark").parse(markdown):
        if token.type in ("fence", "code_block"):
            line = token.map[0] + 1 if token.map else 0
            yield Block(line, token.info.strip(), token.content, *(pending or ("", "")))
            pending = None
        elif token.type not in ("inline", "paragraph_close"):
            if pending:
                raise ValueError(f"The directive '{pending[0]}: {pending[1]}' stands before no block.")
            found = DIRECTIVE.fullmatch(token.content)
            pending = (found[1], found[2]) if found else None
    if pending:
        raise ValueError(f"The directive '{pending[0]}: {pending[1]}' stands before no block.")


def commands(text: str) -> list[Command]:
    """The commands of a console block; raises ValueError where it begins with output."""
    found: list[Command] = []
    for line in text.splitlines():
        if line.startswith("$ "):
            found.append(Command(line[2:], ""))
        elif not found:
            raise ValueError(f"A console block begins with '$ ', not with '{line}'.")
        elif line.startswith("> ") and not found[-1].expected:
            found[-1] = Command(f"{found[-1].text}\n{line[2:]}", "")
        else:
            found[-1] = Command(found[-1].text, f"{found[-1].expected}{line.rstrip()}\n")
    return found


def matches(expected: str, printed: str) -> bool:
    """Whether a command printed what the page shows; blanks at the ends of lines and lines of progress do not count."""
    pattern = "".join(
        r"(?:.*\n)*?" if line == ANYTHING else ".*".join(map(re.escape, line.split(ANYTHING))) + r"\n"
        for line in bare(expected)
    )
    said = (line for line in printed.splitlines() if not PROGRESS.fullmatch(line))
    return re.fullmatch(pattern, "".join(f"{line}\n" for line in bare("\n".join(said)))) is not None


def bare(text: str) -> list[str]:
    """The lines of a text without blanks at their ends and without empty ones around them."""
    return [line.rstrip() for line in text.strip("\n").splitlines()]


def start(block: Block, folder: Path) -> subprocess.Popen[str]:
    """A shell that runs a block's commands, each followed by a mark with its exit code."""
    script = "".join(
        f'{command.text}\n{{ code=$?; echo; echo "{MARK}: $code"; (exit $code); }} 2>/dev/null\n'
        for command in commands(block.text)
    )
    return subprocess.Popen(
        ["/bin/bash", "-c", script],
        cwd=folder,
        env=environment(folder),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def environment(folder: Path) -> dict[str, str]:
    """The reader's environment: the commands of this installation, a home of the page's own, caches that are warm."""
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", "RTHS"))}
    path = f"{sysconfig.get_path('scripts')}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    own = {"HOME": str(folder / ".home"), "TMPDIR": str(folder / ".tmp"), "PATH": path}
    warm = {"XDG_CACHE_HOME": cache, "MPLCONFIGDIR": f"{cache}/matplotlib"}
    return kept | own | warm | {"PYTHONPATH": str(ROOT), "COLUMNS": "100"}


def complaints(block: Block, process: subprocess.Popen[str]) -> list[str]:
    """Wait for a block, and say where what it printed is not what the page shows."""
    try:
        printed, _ = process.communicate(timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):  # a process in another session may hold the pipe
            process.communicate(timeout=LAST_WORDS_S)
        return [f"line {block.line}: not done after {TIMEOUT_S:g} s"]
    pieces = re.split(rf"\n?{MARK}: (\d+)\n", printed)
    wanted = commands(block.text)
    found = []
    for place, command in enumerate(wanted):
        output = pieces[2 * place] if 2 * place < len(pieces) else ""
        code = pieces[2 * place + 1] if 2 * place + 1 < len(pieces) else "none"
        told = place + 1 < len(wanted) and wanted[place + 1].text == "echo $?"
        if not matches(command.expected, output):
            found.append(
                f"line {block.line}: {command.text}\n--- page\n{command.expected}--- printed\n{output}"
            )
        elif code != "0" and not told:
            found.append(f"line {block.line}: {command.text}\nfailed with {code} and no `echo $?` after it")
    return found


def play(page: Path, folder: Path) -> list[str]:
    """Run a page in an empty folder: where it and its commands part, nothing where they agree."""
    for name in (".home", ".tmp"):
        (folder / name).mkdir()
    (folder / "examples").symlink_to(ROOT / "examples")
    found: list[str] = []
    beside: list[tuple[Block, subprocess.Popen[str]]] = []
    for block in blocks(page.read_text(encoding="utf-8")):
        if block.directive == "file":
            (folder / block.name).parent.mkdir(parents=True, exist_ok=True)
            (folder / block.name).write_text(block.text, encoding="utf-8")
        elif block.language == "console":
            beside.append((block, start(block, folder)))
            if not block.directive:
                found += [one for running in reversed(beside) for one in complaints(*running)]
                beside = []
    found += [one for running in beside for one in complaints(*running)]
    return found


def main() -> int:
    """Run the pages named; 1 where one of them is not what its commands print."""
    found = []
    for name in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as folder:
            found += [f"{name}, {one}\n" for one in play(Path(name), Path(folder))]
    sys.stdout.write("".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
