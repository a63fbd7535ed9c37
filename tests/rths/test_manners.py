"""Conventions of the command line: one sentence for a mistake, one JSON document for a report, exit codes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from common import errors, signals
from common.errors import EXIT_CODES, RthsError
from common.recording.writer import Recording
from docs.console import PROGRESS
from rths.__main__ import EXAMPLES, VERBS, main, parser_for
from tests.helpers import ROOT
from tests.processes import environment, finished

Call = Callable[..., int]
SILENT = ("completion",)  # verbs that report nothing: what they write is for a shell
OF_A_RECORDING = (
    "inspect",
    "replay",
    "budget",
    "diagnose",
    "identify",
    "plot",
    "export",
    "layout",
    "compare",
    "report",
    "diagnose {recording}",
    "diagnose {recording} --validate",
    "compare {recording} --predicted",
)
ENDS = {
    "plot": ["-o", "{tmp}/out"],
    "export": ["-o", "{tmp}/out.csv"],
    "layout": ["-o", "{tmp}/out.json"],
    "compare": ["default"],
}
RECORDINGS = ("missing.mcap", "folder", "empty.mcap", "text.mcap", "torn.mcap", "file/x.mcap")
OF_A_PLAN = (
    "run --virtual",
    "simulate",
    "bench column",
    "master",
    "slave",
    "record",
    "keys {tmp}/keys --plan",
    "diagnose {recording} --plan",
    "simulate default -o {tmp}/out.mcap --duration",
    "run --virtual --reality",
    "check",
    "predict --found {tmp}/found.toml",
    "predict default --found",
    "update --found {tmp}/found.toml -o {tmp}/new.toml",
    "update default -o {tmp}/new.toml --found",
    "serve --opensees 8090",
    "serve default --opensees 8090 --virtual --reality",
    "export -o {tmp}/laboratory.fmu",
    "export default -o {tmp}/laboratory.fmu --reality",
)
PLANS = ("missing.toml", "folder", "binary.toml", "open.toml", "other.toml", "file/x.toml")


def each_once(commands: Sequence[str], files: Sequence[str]) -> list[tuple[str, str]]:
    """The first command with every file, and every command with one of them: all read files in one way."""
    turns = [(command, files[place % len(files)]) for place, command in enumerate(commands)]
    return list(dict.fromkeys([*((commands[0], name) for name in files), *turns]))


MISTAKES = [
    *(f"{verb} {{tmp}}/{name} {' '.join(ENDS.get(verb, ()))}" for verb, name in each_once(OF_A_RECORDING, RECORDINGS)),
    *(f"{verb} {{tmp}}/tickless.mcap {' '.join(ENDS.get(verb, ()))}" for verb in ("replay", "budget", "compare")),
    *(f"recover {{tmp}}/{name} -o {{tmp}}/out.mcap" for name in RECORDINGS if name != "torn.mcap"),
    *(f"{words} {{tmp}}/{name}" for words, name in each_once(OF_A_PLAN, PLANS)),
    *(f"simulate default --duration {value}" for value in ("nan", "inf", "-1", "0", "ten")),
    *(f"simulate default --scale {value}" for value in ("nan", "inf")),
    *(f"simulate default --seed {value}" for value in ("-1", "1.5")),
    *(f"compare {{recording}} {{recording}} --tolerance {value}" for value in ("nan", "-1")),
    *(f"blind --{words}" for words in ("cases 0", "jobs -7", "seed -1", "duration nan", "only x")),
    *(f"faults --{words}" for words in ("schedules 0", "jobs 0", "seed -1", "duration nan", "schedule x")),
    *(f"doctor --{words}" for words in ("seconds nan", "interval 0")),
    *(f"keys {{tmp}}/keys --days {value}" for value in ("0", "-1", "nan")),
    *(f"{words} {place}" for words in ("simulate default -o", "bench column default -o", "run --virtual -o")
      for place in ("/proc/x.mcap", "{tmp}/folder", "{tmp}/file/x.mcap")),
    *(f"{words} {place}" for words in ("blind --cases 1 -o", "reproduce -o", "keys", "diagnose {recording} --html")
      for place in ("/proc/x/y", "{tmp}/file", "{tmp}/file/x") if not words.startswith("diagnose") or "x" in place),
    *(f"export {{recording}} -o {place}" for place in ("/proc/x.csv", "{tmp}/file/x.mat", "{tmp}/out.pdf")),
    *(f"import {{tmp}}/{name} --map {{tmp}}/map.toml -o {{tmp}}/out.mcap"
      for name in ("missing.csv", "folder", "text.mcap", "empty.csv", "file/x.csv")),
    *(f"init {place}" for place in ("..", "/proc/x", "{tmp}/file/x", "{tmp}/folder/a/b")),
    *(f"serve default {words}" for words in ("--opensees x", "--opensees 0", "--opensees 8090 --intervals 0",
      "--opensees 8090 --opensees 8091 --opensees 8092", "--opensees 8090 --accept-risk x",
      "--opensees 8090 --virtual -o /proc/x")),
    *(f"export {words}" for words in ("{recording} -o {tmp}/out.csv --lab slave", "default -o {tmp}/out.fmu --events",
      "default -o {tmp}/out.fmu --lab x")),
    *(f"diagnose {{recording}} {words}" for words in ("{recording}", "--validate {recording}", "--require nan",
      "--name x", "--found {tmp}/out.txt", "--found {tmp}/a.toml --json {tmp}/a.toml")),
    "compare {recording} --predicted {recording}",
    "compare {recording}",
    *(f"live --no-browser {{tmp}}/{name}" for name in ("missing.mcap", "folder")),
    "replay {recording} --plan {tmp}/missing.toml",
    "run --virtual --live-port 5",
    "predict default --found {tmp}/other.toml --draws 5",
    "update default --found {tmp}/other.toml -o {tmp}/other.toml",
    "identify {recording} --fit x",
    "bench colum default",
    "budget {recording} --budget {tmp}/other.toml",
    "completion csh",
    "slave default --connect nonsense",
]  # fmt: skip
REPORTS = {
    "inspect": "{recording}",
    "simulate": "default --duration 1",
    "bench": "column default --only static -o {tmp}/bench.mcap",
    "identify": "{recording} --part column",
    "recover": "{recording} -o {tmp}/recovered.mcap",
    "replay": "{recording}",
    "compare": "{recording} {recording}",
    "keys": "{tmp}/keys",
    "faults": "--seed 1 --duration 1",
    "layout": "{recording} -o {tmp}/layout.json",
    "export": "{recording} -o {tmp}/table.csv",
    "run": "--virtual --duration 1 -o {tmp}/run.mcap",
}


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, virtual_recording: Path) -> Call:
    """The exit code of a command line with places filled in."""

    def called(line: str) -> int:
        filled = line.replace("{tmp}", str(tmp_path)).replace("{recording}", str(virtual_recording))
        monkeypatch.setattr(sys, "argv", ["rths", *filled.split()])
        try:
            return main()
        except SystemExit as end:
            return int(end.code or 0)

    return called


@pytest.fixture
def litter(tmp_path: Path, virtual_recording: Path) -> None:
    """Files and folders that are wrong arguments for any command."""
    (tmp_path / "folder").mkdir()
    for name in ("file", "empty.mcap", "empty.csv"):
        (tmp_path / name).touch()
    (tmp_path / "text.mcap").write_text("hello\n")
    (tmp_path / "torn.mcap").write_bytes(virtual_recording.read_bytes()[:500])
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "open.toml").write_text("[test\n")
    (tmp_path / "other.toml").write_text("x = 1\n")
    (tmp_path / "map.toml").write_text(
        f"plan = '{ROOT}/rths/plans/default.toml'\nrate = 1.0\n[signals]\ndamper_stroke = {{ column = 'y' }}\n"
    )
    recording = Recording(tmp_path / "tickless.mcap", "test", 1, {"event": signals.EVENT})
    recording.add("event", 0, 0, (0.0, "recorder", "info", "begin", "recording begun", {}))
    recording.close({"outcome": "completed"})


@pytest.mark.usefixtures("litter")
@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_gives_one_sentence_and_exit_code_2(line: str, call: Call, capsys: Any) -> None:
    assert call(line) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"rths: \S.*\n", said.err), said.err


@pytest.mark.parametrize("verb", VERBS)
def test_a_wrong_option_gives_one_sentence_that_points_to_the_help(
    verb: str, call: Call, capsys: Any
) -> None:
    assert call(f"{EXAMPLES[verb].partition(' >')[0].removeprefix('rths ')} --nonsense") == 2
    assert capsys.readouterr().err == f"rths: unrecognized arguments: --nonsense; see rths {verb} --help.\n"


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb not in SILENT])
def test_every_command_that_reports_accepts_json(verb: str) -> None:
    assert "--json" in parser_for(verb).format_help()


@pytest.mark.parametrize("verb", REPORTS)
def test_json_is_one_document_and_nothing_else_on_standard_output(verb: str, call: Call, capsys: Any) -> None:
    assert call(f"{verb} {REPORTS[verb]} --json") in (0, 1)
    said = capsys.readouterr()
    assert said.out.count("\n") == 1
    assert isinstance(json.loads(said.out), dict)
    assert "\x1b" not in said.out + said.err


def test_colours_are_used_only_in_the_terminal_display_of_a_running_test() -> None:
    drawn = {
        ROOT / "rths" / "board.py",
        ROOT / "rths" / "terminal.py",
    }  # tests/rths/test_terminal.py: where there is none
    for folder in ("common", "models", "master", "slave", "recorder", "diagnosis", "rths"):
        for path in set((ROOT / folder).rglob("*.py")) - drawn:
            assert not re.search(r"\\x1b|\\033|\\e\[|\x1b", path.read_text(encoding="utf-8")), path


def test_every_exit_code_is_in_one_table() -> None:
    classes = [one for one in vars(errors).values() if isinstance(one, type) and issubclass(one, RthsError)]
    assert {one.exit_code for one in classes} <= set(EXIT_CODES)
    page = " ".join((ROOT / "docs/reference/commands.md").read_text(encoding="utf-8").split())
    assert f"Exit codes: {', '.join(f'{code} {text}' for code, text in EXIT_CODES.items())}." in page


def started(*words: str | Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "rths", *map(str, words)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.parametrize("words", [["inspect", "{recording}"], ["--help"], ["inspect", "--help"]])
def test_a_closed_pipe_on_standard_output_is_not_an_error(words: list[str], virtual_recording: Path) -> None:
    with started(*(word.replace("{recording}", str(virtual_recording)) for word in words)) as process:
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        said = process.stderr.read().splitlines()
        assert [line for line in said if not PROGRESS.fullmatch(line)] == []
    assert process.returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("line", ["faults --schedules 400", "faults --jobs 2 --schedules 400"])
def test_ctrl_c_gives_one_sentence_and_exit_code_3(line: str) -> None:
    with started(*line.split()) as process:
        assert process.stderr
        begun = process.stderr.readline()  # of progress, after two seconds
        os.killpg(process.pid, signal.SIGINT)
        rest = process.stderr.read()
    assert begun.startswith("faults: "), begun + rest
    assert rest.endswith("rths: stopped by the user.\n")
    assert "Traceback" not in rest
    assert process.returncode == 3


def test_ctrl_c_within_generated_code_gives_exit_code_3(tmp_path: Path) -> None:
    text = "import os, signal, time; os.kill(os.getpid(), signal.SIGINT); time.sleep(60)"
    program = (
        f"import sys; from common.terminal.cli import guarded; sys.exit(guarded(lambda: exec({text!r})))"
    )
    (tmp_path / "made.py").write_text(program)
    own = environment(PYTHONPATH=f"{tmp_path}{os.pathsep}{ROOT}")
    done = finished(sys.executable, "-m", "made", seconds=60.0, env=own)
    assert (done.returncode, done.stdout, done.stderr) == (3, "", "rths: stopped by the user.\n")


def test_a_missing_input_file_leaves_no_output_folder(call: Call, tmp_path: Path) -> None:
    assert call("plot {tmp}/nosuch.mcap") == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("line", ["plot .", "export . -o . --events", "recover .", f"live {'x' * 300}"])
def test_an_impossible_path_gives_one_sentence(
    line: str, call: Call, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(line) == 2
    said = capsys.readouterr().err
    assert said.startswith("rths: ")
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "code"), [("compare {recording} nosuch.mcap", 2), ("inspect {recording}", 0)]
)
def test_an_exit_code_is_kept_when_standard_output_is_closed(
    line: str, code: int, virtual_recording: Path
) -> None:
    words = line.replace("{recording}", str(virtual_recording)).split()
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(
        [sys.executable, "-m", "rths", *words],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    ) as process:
        assert process.stdout
        process.stdout.close()
        assert process.stderr
        assert "Exception" not in process.stderr.read()
    assert process.returncode == code
