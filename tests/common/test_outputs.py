"""Output files: existing files stay, a failed command leaves none, and only one of two commands gets a name."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from common.errors import InputError
from common.terminal import outputs


def test_an_output_file_takes_its_name_when_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with outputs.writing(path) as temporary:
        assert temporary.suffix == ".csv"
        temporary.write_text("whole")
        assert not path.exists()
    assert path.read_text() == "whole"
    mask = os.umask(0)
    os.umask(mask)
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask
    assert list(tmp_path.iterdir()) == [path]


def test_after_an_error_no_partial_file_remains_and_an_existing_file_is_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with pytest.raises(ZeroDivisionError), outputs.writing(path):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    path.write_text("before")
    with pytest.raises(ZeroDivisionError), outputs.writing(path, force=True) as temporary:
        temporary.write_text(f"half {1 / 0}")
    assert path.read_text() == "before"


def test_an_existing_file_is_replaced_only_with_force(tmp_path: Path) -> None:
    path, link, astray = tmp_path / "a", tmp_path / "link", tmp_path / "astray"
    path.write_text("")  # an empty file is a file
    link.symlink_to(path)
    astray.symlink_to(tmp_path / "nowhere")
    for taken in (path, link, astray):
        with pytest.raises(InputError, match=f"{taken} exists and is not replaced"):
            outputs.checked(taken)
    outputs.write_text(link, "new", force=True)
    assert path.read_text() == "new"
    assert link.is_symlink()


def test_a_commands_input_file_is_never_its_output(tmp_path: Path) -> None:
    path, link = tmp_path / "a", tmp_path / "link"
    path.write_text("measured")
    link.hardlink_to(path)
    with pytest.raises(InputError, match="the command reads it"):
        outputs.checked(link, True, [path])


def test_an_unwritable_output_is_reported_before_any_work(tmp_path: Path) -> None:
    for path, sentence in (
        (tmp_path, "is a folder"),
        (tmp_path / "no" / "a", "There is no folder"),
        (tmp_path / (300 * "n"), "File name too long"),
        (Path("/proc/a"), "Cannot write /proc/a"),
    ):
        with pytest.raises(InputError, match=sentence), outputs.writing(path):
            pass


def test_only_one_of_two_concurrent_commands_gets_the_output_name(tmp_path: Path) -> None:
    path, both, told = tmp_path / "a", threading.Barrier(2), []

    def write(text: str) -> None:
        try:
            with outputs.writing(path) as temporary:
                temporary.write_text(text)
                both.wait()  # each has seen that the name is free
        except InputError as error:
            told.append((text, str(error)))

    threads = [threading.Thread(target=write, args=(text,)) for text in "ab"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [sentence for _, sentence in told] == [str(outputs.exists(path))]
    assert {path.read_text(), told[0][0]} == {"a", "b"}
    assert list(tmp_path.iterdir()) == [path]


def test_a_pipe_receives_the_complete_output_or_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    outputs.write_text(Path("/dev/stdout"), "to the pipe")
    with pytest.raises(ZeroDivisionError), outputs.writing(Path("/dev/stdout")) as temporary:
        temporary.write_text(f"half {1 / 0}")
    outputs.write_text(Path("/dev/null"), "away")
    assert capfd.readouterr().out == "to the pipe"
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    outputs.write_text(pipe, "through")
    reader.join()
    assert read == ["through"]


def test_a_recording_has_its_name_from_the_beginning(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with outputs.reserved(path), pytest.raises(InputError, match="exists"), outputs.reserved(path):
        pass
    assert not path.exists()  # nothing was recorded
    with outputs.reserved(path):
        path.write_text("recorded")
    with pytest.raises(ZeroDivisionError), outputs.reserved(path, force=True):
        raise ZeroDivisionError
    assert path.read_text() == "recorded"


def test_an_output_folder_must_be_new_or_empty(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "new"
    with pytest.raises(ZeroDivisionError), outputs.folder(folder):
        raise ZeroDivisionError
    assert not folder.exists()
    with outputs.folder(folder):
        (folder / "a").touch()
    with pytest.raises(InputError, match="not empty"), outputs.folder(folder):
        pass
    with outputs.folder(folder, force=True):
        pass
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="Cannot write into"), outputs.folder(tmp_path / "file"):
        pass
