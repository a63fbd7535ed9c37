"""The completion scripts, sourced by the shells themselves."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rths.__main__ import VERBS, parser_for
from rths.completion import SHELLS, script
from tests.helpers import ROOT

SLOW = ("numba", "scipy", "matplotlib", "zenoh")
ASKED = {
    "in": ["inspect"],
    "simulate d": ["default"],
    "simulate ": ["benchmark2020", "default", "other", "paper", "plan.toml", "rc_column", "two_dampers"],
    "simulate --dur": ["--duration"],
    "inspect ": ["a.mcap", "other"],
    "inspect other/": ["other/b.mcap"],
    "bench ac": ["actuator"],
    "bench actuator pl": ["plan.toml"],
    "run --rt o": ["off", "on"],
    "run --reality ": ["other", "plan.toml"],
    "compare a": ["a.mcap"],
    "diagnose a.mcap --validate ": ["a.mcap", "other"],
    "completion ": sorted(SHELLS),
    "keys ": ["other"],
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "other").mkdir()
    for name in ("a.mcap", "plan.toml", "notes.txt", "other/b.mcap"):
        (tmp_path / name).touch()
    for shell in SHELLS:
        (tmp_path / f".{shell}").write_text(script(shell) + "\n", encoding="utf-8")
    return tmp_path


def test_bash_completes_verbs_options_choices_plans_and_files(folder: Path) -> None:
    lines = [
        "source .bash",
        "complete -p rths",
        'ask() { read -ra COMP_WORDS <<< "rths $1"; [[ $1 == *" " ]] && COMP_WORDS+=("");',
        "COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMPREPLY=();",
        '_shtab_rths rths "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}" 2> /dev/null;',
        "printf '%s\\n' \"${COMPREPLY[@]}\" | LC_ALL=C sort | tr '\\n' ' '; echo; }",
        *(f"ask {words!r}" for words in ASKED),
    ]
    done = subprocess.run(
        ["bash", "--norc", "-c", "\n".join(lines)], cwd=folder, capture_output=True, text=True, timeout=60
    )
    registered, *answers = done.stdout.splitlines()
    assert registered == "complete -o bashdefault -F _shtab_rths rths"
    assert dict(zip(ASKED, map(str.split, answers), strict=True)) == ASKED
    assert done.stderr == ""


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_take_their_script(shell: str, folder: Path) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed here")
    done = subprocess.run([shell, "-n", f".{shell}"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("shell", SHELLS)
def test_every_verb_and_option_is_in_every_script(shell: str) -> None:
    text = script(shell)
    for verb in VERBS:
        assert verb in text
        for action in parser_for(verb)._actions:
            for option in action.option_strings:
                assert option.lstrip("-") in text, (verb, option)


def test_a_script_is_written_without_the_packages_that_take_long_to_load() -> None:
    program = (
        "import sys; from rths.__main__ import main; sys.argv = ['rths', 'completion', 'bash']; assert main() == 0; "
        f"sys.stderr.write(' '.join(name for name in {SLOW} if name in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "complete -o bashdefault" in done.stdout
