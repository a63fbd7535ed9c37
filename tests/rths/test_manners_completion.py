"""The completion scripts, sourced by the shells themselves."""

from __future__ import annotations

import contextlib
import os
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from common.errors import InputError
from common.terminal.cli import SHIPPED
from rths.__main__ import VERBS, parser_for
from rths.completion import SHELLS, script
from tests.helpers import ROOT
from tests.processes import HANG_S, finished

SLOW = ("numba", "scipy", "matplotlib", "zenoh")
ASKED = {
    "in": ["init", "inspect"],
    "simulate d": ["default"],
    "simulate ": sorted([*SHIPPED, "other", "plan.toml"]),
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
    "inspect --j": ["--json"],
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
        ["bash", "--norc", "-c", "\n".join(lines)], cwd=folder, capture_output=True, text=True, timeout=HANG_S
    )
    registered, *answers = done.stdout.splitlines()
    assert registered == "complete -o bashdefault -F _shtab_rths rths"
    assert dict(zip(ASKED, map(str.split, answers), strict=True)) == ASKED
    assert done.stderr == ""


def need(shell: str) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed here (Debian: {shell})")


# an interactive zsh that asks its own line editor, and writes down what that is given to choose from
ZSHRC = """
autoload -Uz compinit && compinit -u -D
READ
print -r -- $_comps[rths] > .answers
compadd() {
  if (( ! ${argv[(I)-[OAD]]} )); then
    local -a fitting
    builtin compadd -A fitting "$@"
    print -rn -- "${(j: :)fitting} " >> .answers
  fi
  builtin compadd "$@"
}
zle-line-init() {
  local words
  for words in ${(f)"$(<.asked)"}; do
    BUFFER="rths $words" CURSOR=$(( $#words + 5 ))
    zle list-choices
    print >> .answers
  done
  exit
}
zle -N zle-line-init
"""


@pytest.mark.slow
@pytest.mark.parametrize("way", ["source ./.zsh", "fpath=($PWD/.found $fpath) && compinit -u -D"])
def test_zsh_completes_verbs_options_choices_plans_and_files(way: str, folder: Path) -> None:
    need("zsh")
    (folder / ".asked").write_text("\n".join(ASKED) + "\n")
    (folder / ".zshrc").write_text(ZSHRC.replace("READ", way))
    (folder / ".found").mkdir()
    shutil.copy(folder / ".zsh", folder / ".found/_rths")
    said = on_a_terminal(["zsh", "-d", "-i"], folder)
    registered, *answers = (folder / ".answers").read_text().splitlines()
    assert registered.endswith("_rths"), said
    found = [sorted(set(answer.split())) for answer in answers]
    wanted = [sorted(word.removeprefix("other/") for word in words) for words in ASKED.values()]
    assert dict(zip(ASKED, found, strict=True)) == dict(zip(ASKED, wanted, strict=True)), said


def on_a_terminal(command: list[str], folder: Path) -> str:
    """What an interactive shell prints on a terminal of its own, which is closed when the shell has had its time."""
    ours, its = os.openpty()
    own = {**os.environ, "ZDOTDIR": str(folder), "HOME": str(folder), "TERM": "dumb"}
    try:
        process = subprocess.Popen(
            command, stdin=its, stdout=its, stderr=its, env=own, cwd=folder, start_new_session=True
        )
    finally:
        os.close(its)
    said, deadline = b"", time.monotonic() + HANG_S
    try:
        while process.poll() is None:
            assert time.monotonic() < deadline, said
            if select.select([ours], [], [], 0.1)[0]:
                with contextlib.suppress(OSError):  # the other end is closed
                    said += os.read(ours, 65536)
        return said.decode(errors="replace")
    finally:
        os.close(ours)
        process.kill()
        process.wait()


def test_fish_completes_verbs_options_choices_plans_and_files(folder: Path) -> None:
    need("fish")
    lines = ["source .fish", *(f"complete -C 'rths {words}'; echo ==" for words in ASKED)]
    homes = dict.fromkeys(("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"), str(folder / ".home"))
    done = finished(
        "fish", "--no-config", "-c", "\n".join(lines), seconds=60.0, cwd=folder, env={**os.environ, **homes}
    )
    answers = [
        sorted(line.partition("\t")[0].rstrip("/") for line in answer.splitlines())
        for answer in done.stdout.split("==\n")[:-1]
    ]
    assert dict(zip(ASKED, answers, strict=True)) == {words: sorted(found) for words, found in ASKED.items()}
    assert done.stderr == ""


def test_another_version_of_shtab_is_refused_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shtab.complete", lambda *_: "compdef _rths rths")
    with pytest.raises(InputError, match=r"install the one in requirements\.lock"):
        script("zsh")


@pytest.mark.parametrize("shell", SHELLS)
def test_every_command_and_option_is_in_every_completion_script(shell: str) -> None:
    text = script(shell)
    for verb in VERBS:
        assert verb in text
        for action in parser_for(verb)._actions:
            for option in action.option_strings:
                assert option.lstrip("-") in text, (verb, option)


def test_a_completion_script_is_written_without_loading_slow_packages() -> None:
    program = (
        "import sys; from rths.__main__ import main; sys.argv = ['rths', 'completion', 'bash']; assert main() == 0; "
        f"sys.stderr.write(' '.join(name for name in {SLOW} if name in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=HANG_S
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "complete -o bashdefault" in done.stdout
