"""No command replaces a file that exists."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from rths.__main__ import VERBS, parser_for

# by verb: words before the output, its option; the words name files that are there, and the output too
WRITES = {
    "run": (("--virtual",), "-o"),
    "run in real time": ((), "-o"),
    "serve": (("two_storeys", "--opensees", "127.0.0.1:47112"), "-o"),
    "record": (("default",), "-o"),
    "simulate": (("default",), "-o"),
    "predict": (("default", "--found", "{plan}"), "-o"),
    "predict, a page": (("default", "--found", "{plan}"), "--html"),
    "update": (("default", "--found", "{plan}"), "-o"),
    "sweep": (("{plan}",), "-o"),
    "campaign": (("{plan}",), "-o"),
    "fragility": (("{plan}", "--quantity", "displacement", "--limit", "1"), "--html"),
    "bench": (("damper", "default"), "-o"),
    "report": (("{recording}",), "-o"),
    "recover": (("{recording}",), "-o"),
    "plot": (("{recording}", "tracking"), "-o"),
    "layout": ((), "-o"),
    "reproduce": ((), "-o"),
    "blind": ((), "-o"),
    "benchmark2020": ((), "-o"),
    "benchmark2020, a plan": (("--plan", "1"), "-o"),
    "catalog": (("show",), "--html"),
    "compare": (("{recording}", "{plan}"), "-o"),
    "compare, a page": (("{recording}", "{plan}"), "--html"),
    "diagnose": (("{recording}",), "--html"),
    "diagnose, JSON": (("{recording}",), "--json"),
    "import": (("{plan}", "--map", "{plan}"), "-o"),
    "export": (("{recording}",), "-o"),
}
OF_FOLDERS = ("reproduce", "blind", "benchmark2020", "campaign")
UNREPLACED = {
    "keys": "makes files in an empty folder only",
    "doctor": "names a folder and leaves nothing in it",
}


@pytest.mark.parametrize("name", WRITES)
def test_an_existing_file_is_not_replaced(
    name: str, call: Any, capsys: Any, tmp_path: Path, virtual_recording: Path
) -> None:
    verb, (words, option) = re.split("[, ]", name)[0], WRITES[name]
    output = tmp_path / "there.svg" if verb == "plot" else tmp_path / "there.csv"
    output.write_text("before")
    plan = tmp_path / "plan.toml"
    plan.write_text("")
    filled = [word.format(recording=virtual_recording, plan=plan) for word in words]
    assert call(verb, *filled, option, tmp_path if name in OF_FOLDERS else output) == 2
    said = capsys.readouterr()
    assert re.fullmatch(
        r"rths: .*(exists and is not replaced|not empty and nothing in it is).*\.\n", said.err
    )
    assert said.out == ""
    assert output.read_text() == "before"
    assert sorted(tmp_path.iterdir()) == [plan, output]


def test_every_command_that_writes_has_the_option_force() -> None:
    writing = set()
    for verb in VERBS:
        parser = parser_for(verb)
        options = {word for action in parser._actions for word in action.option_strings}
        takes = {word for action in parser._actions if action.type is Path for word in action.option_strings}
        if takes & {"-o", "--html", "--json"}:
            writing.add(verb)
            assert ("--force" in options) == (verb not in UNREPLACED), verb
    assert writing == {re.split("[, ]", name)[0] for name in WRITES} | {"doctor"}


def test_a_command_that_fails_leaves_no_file(call: Any, capsys: Any, tmp_path: Path) -> None:
    useless = tmp_path / "useless.mcap"
    useless.write_text("no recording")
    for words in (
        ("diagnose", useless, "--json", tmp_path / "a.json", "--html", tmp_path / "a.html"),
        ("report", useless, "-o", tmp_path / "b.html"),
        ("export", useless, "-o", tmp_path / "c.csv"),
        ("recover", useless, "-o", tmp_path / "d.mcap"),
        ("plot", useless, "-o", tmp_path / "pictures"),
        ("layout", useless, "-o", tmp_path / "e.json"),
    ):
        assert call(*words) == 2
        assert list(tmp_path.iterdir()) == [useless]
    capsys.readouterr()
