"""A user who waits for the compiler is told so, once and on standard error; any other one is not."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from models import cache
from simulation import compilation
from tests.helpers import ROOT
from tests.processes import HANG_S

KERNEL = """
import sys
from rths.first_kernel import compilation_said
from simulation import compilation
compilation.UNSAID = 0.0
with compilation_said():
    from models import force_correction
    import numpy as np
    for _ in range(2):
        force_correction.step(1.0, 0.0, np.zeros(2), 0.0)
sys.stdout.write("done")
"""
LIGHT = """
import contextlib, io, sys
from rths.__main__ import command
with contextlib.redirect_stdout(io.StringIO()):
    assert command(["completion", "bash"]) == 0
assert "numba" not in sys.modules
assert not [one for one in sys.meta_path if type(one).__module__.startswith("rths")]
"""


def python(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A program in a new process whose compiled kernels are kept in a folder."""
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, "XDG_CACHE_HOME": str(folder), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=HANG_S,
    )


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A notice in a checkout whose kernels are not compiled, and what it says."""
    monkeypatch.setattr(cache, "warm", lambda: False)
    monkeypatch.setattr(compilation, "UNSAID", 0.05)
    lines: list[str] = []
    notice = compilation.CompilationNotice()
    notice.say = lines.append
    return notice, lines


def test_compiling_is_said_once_and_not_where_the_kernel_is_on_disk(tmp_path: Path) -> None:
    first = python(KERNEL, tmp_path)
    assert first.stdout == "done", first.stderr
    assert first.stderr.splitlines() == [compilation.SENTENCE]
    assert python(KERNEL, tmp_path).stderr == ""


def test_a_command_without_kernels_loads_no_compiler_and_leaves_nothing_behind(tmp_path: Path) -> None:
    assert python(LIGHT, tmp_path).stderr == ""


def test_one_long_compilation_is_said_while_it_lasts(heard: Any) -> None:
    notice, lines = heard
    notice.on_start(None)
    notice.on_start(None)  # a kernel within it
    notice.on_end(None)
    time.sleep(0.5)
    assert lines == [compilation.SENTENCE]
    notice.on_end(None)
    notice.on_start(None)
    time.sleep(0.2)
    notice.on_end(None)
    assert lines == [compilation.SENTENCE]


def test_many_short_compilations_count_together_and_a_few_are_not_said(heard: Any) -> None:
    notice, lines = heard
    notice.on_start(None)
    notice.on_end(None)
    assert lines == []
    for _ in range(40):
        notice.on_start(None)
        time.sleep(0.01)
        notice.on_end(None)
    assert lines == [compilation.SENTENCE]


def test_a_class_of_the_users_is_compiled_without_a_word(heard: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    notice, lines = heard
    monkeypatch.setattr(cache, "warm", lambda: True)
    notice.on_start(None)
    time.sleep(0.2)
    notice.on_end(None)
    assert lines == []


def test_on_a_terminal_the_sentence_stands_over_the_line_of_progress(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "20")
    compilation.said("compiling")
    assert capsys.readouterr().err == f"\r{'compiling':<19}\n"
