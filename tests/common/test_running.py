"""The list of tests that run on this machine, and the message for a second one."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from common.errors import InputError
from common.host import running
from common.plan.plan import Plan

PLAN = Plan()


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which running tests are announced."""
    monkeypatch.setenv(running.FOLDER, str(tmp_path))
    return running.place()


@pytest.fixture
def other() -> Iterator[int]:
    """The id of a process that lives as long as the test."""
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        yield process.pid
        process.kill()


def announce(folder: Path, process: int, test: str = "default", role: str = running.RUN) -> Path:
    """Writes the file of a test that another process runs."""
    folder.mkdir(exist_ok=True)
    path = folder / f"{test}-{process}.json"
    path.write_text(json.dumps(running.Running(test, "tcp/127.0.0.1:7447", ".", "", role)._asdict()))
    return path


def test_a_process_that_ended_and_was_not_waited_for_runs_no_test(place: Path, other: int) -> None:
    announce(place, other)
    assert [one.process for one in running.neighbours()] == [other]
    os.kill(other, signal.SIGKILL)
    os.waitid(os.P_PID, other, os.WEXITED | os.WNOWAIT)  # it has ended, and nobody has asked how
    assert running.neighbours() == []


def test_a_test_alone_is_not_refused_and_leaves_no_file(place: Path) -> None:
    with running.announced(PLAN, "tcp/127.0.0.1:1"):
        running.alone()
        assert running.only("default").endpoint == "tcp/127.0.0.1:1"
        assert next(place.iterdir()).stat().st_mode & 0o077 == 0
    assert list(place.glob("*")) == []


def test_the_second_test_is_refused_and_the_first_is_not(place: Path, other: int) -> None:
    first = announce(place, other, "tower")
    with running.announced(PLAN, ""):
        os.utime(first, (first.stat().st_mtime, first.stat().st_mtime - 0.5))
        with pytest.raises(InputError) as found:
            running.alone()
        os.utime(first, (first.stat().st_mtime, first.stat().st_mtime + 60.0))
        running.alone()
    text = str(found.value)
    assert text.startswith("The test 'tower' runs on this machine since ")
    assert f"(process {other})" in text
    assert "--beside" in text


def test_another_users_test_counts_although_its_file_is_unreadable(tmp_path: Path, other: int) -> None:
    announce(tmp_path / "rths-99999", other).chmod(0)
    assert [one.process for one in running.neighbours()] == [other]
    with pytest.raises(InputError, match="The test 'default'"):
        running.alone()


def test_a_separately_started_laboratory_counts_but_is_not_listed_as_a_test_to_stop(
    place: Path, other: int
) -> None:
    announce(place, other, role="slave")
    assert running.found() == []
    with pytest.raises(InputError, match="--beside"):
        running.alone()


def test_files_of_ended_processes_are_removed(place: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    stale = announce(place, ended.pid)
    running.alone()
    assert running.found() == []
    assert not stale.exists()


def test_a_file_whose_process_id_was_reused_is_ignored(place: Path, other: int) -> None:
    stale = announce(place, other)
    os.utime(stale, (0.0, stale.stat().st_mtime - 3600.0))
    running.alone()
    assert running.found() == []


def test_unrelated_files_are_not_taken_for_tests(place: Path) -> None:
    place.mkdir()
    (place / "a-b.json").write_text("{}")
    (place / "-.json").mkdir()
    running.alone()
    assert running.found() == []


def test_an_announcement_by_the_parent_process_is_recognized(place: Path) -> None:
    assert not running.announced_already()
    announce(place, os.getppid())
    assert running.announced_already()
    running.alone()
