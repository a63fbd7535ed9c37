"""Output files of commands: existing files are replaced only with --force, and no incomplete file is left.

A command checks its outputs before it begins to work (`checked`). Results are written into a temporary file in the
same folder, which is renamed when it is complete (`writing`). A recording must be readable while the test runs, so its
name is taken at once (`reserved`).
"""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import TextIO

from common.errors import InputError

MODE = 0o666  # before the user's umask, as for any new file
STANDARD = {"/dev/stdout": 1, "/dev/fd/1": 1, "/proc/self/fd/1": 1, "/dev/stderr": 2}


def checked(path: Path, force: bool = False, inputs: Iterable[Path] = ()) -> Path:
    """The path itself, if a command that reads `inputs` may write a file there.

    Raises:
        InputError: a file is there and `force` is not given, it is one of the inputs, or no file can be written there.
    """
    if is_stream(path):
        return path
    for read in inputs:
        if same(path, read):
            raise InputError(f"Cannot write {path}: the command reads it; give another name for the output.")
    folder = path.parent
    if not (there(folder) and folder.is_dir()):
        raise InputError(f"There is no folder {folder} for {path.name}: create it, or give another name.")
    taken = there(path)
    if taken and path.is_dir():
        raise InputError(f"Cannot write {path}: it is a folder; give the name of a file.")
    if taken and not force:
        raise exists(path)
    if not os.access(target(path).parent, os.W_OK | os.X_OK):
        raise InputError(f"Cannot write {path}: the folder {folder} is not writable; give another place.")
    return path


def there(path: Path) -> bool:
    """Whether the name is taken, even by a broken link; raises InputError where no file can have that name."""
    try:
        path.lstat()
    except FileNotFoundError:
        return False
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}; give another name.") from None
    return True


def exists(path: Path) -> InputError:
    """The error for an output that would replace a file."""
    return InputError(f"{path} exists and is not replaced: give another name, or --force to replace it.")


def same(one: Path, other: Path) -> bool:
    """Whether two paths are one file."""
    try:
        return one.samefile(other)
    except OSError:
        return False


def is_stream(path: Path) -> bool:
    """Whether a path is a pipe, a device or the command's own standard output, which hold nothing to replace."""
    if str(path) in STANDARD:
        return True
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def aside(*paths: Path | None) -> TextIO:
    """The stream for a command's messages: standard error where one of its outputs is the standard output."""
    return sys.stderr if any(STANDARD.get(str(path)) == 1 for path in paths) else sys.stdout


def target(path: Path) -> Path:
    """The file that a path leads to through all links."""
    return Path(os.path.realpath(path))


@contextlib.contextmanager
def writing(path: Path, force: bool = False, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """A temporary file to fill within the context; at its end it is renamed to `path`, after an error it is removed.

    It has the suffix of `path`. If `path` is a stream, the file's content is written into it at the end.

    Raises:
        InputError: a file is there and `force` is not given, or none can be written.
    """
    checked(path, force, inputs)
    stream = is_stream(path)
    place = target(path)
    folder = Path(tempfile.gettempdir()) if stream else place.parent
    temporary = folder / f".rths-{os.urandom(8).hex()}{path.suffix}"
    try:
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, MODE))
        yield temporary
        if stream:
            poured(temporary, path)
        else:
            named(temporary, path, place, force)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}; give another place.") from None
    finally:
        temporary.unlink(missing_ok=True)


def named(temporary: Path, path: Path, place: Path, force: bool) -> None:
    """Rename the temporary file; raises InputError where another command has taken the name meanwhile."""
    if not force:
        claim(path)
    temporary.replace(path if not force else place)


def claim(path: Path) -> None:
    """Create an empty file to reserve its name; raises InputError where a file is there."""
    try:
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, MODE))
    except FileExistsError:
        raise exists(path) from None
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}; give another place.") from None


def poured(file: Path, path: Path) -> None:
    """Write a file's content into a stream, after all earlier output."""
    sys.stdout.flush()
    number = STANDARD.get(str(path))
    with file.open("rb") as source, open(path if number is None else os.dup(number), "wb") as sink:  # noqa: PTH123 - a descriptor
        shutil.copyfileobj(source, sink)


def write_text(path: Path, text: str, force: bool = False) -> None:
    """Write a text as a whole; raises InputError as `writing` does."""
    with writing(path, force) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def reserved(path: Path, force: bool = False) -> Iterator[Path]:
    """Reserve a file for a recording that begins later; it is removed after the context if it is still empty.

    With `force` an existing file stays as it is until the recording begins.

    Raises:
        InputError: a file is there and `force` is not given, or none can be written.
    """
    checked(path, force)
    if not (is_stream(path) or (force and there(path))):
        claim(path)
    try:
        yield path
    finally:
        with contextlib.suppress(OSError):
            if path.is_file() and not path.stat().st_size:
                path.unlink()


@contextlib.contextmanager
def free_name(folder: Path, stem: str, ending: str) -> Iterator[Path]:
    """Reserve a new file named `stem`, or `stem-2` and so on where it is taken; it is removed if it stays empty.

    Raises:
        InputError: none can be written there.
    """
    number = 1
    path = folder / f"{stem}{ending}"
    while True:
        try:
            os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, MODE))
            break
        except FileExistsError:
            number += 1
            path = folder / f"{stem}-{number}{ending}"
        except OSError as error:
            raise InputError(f"Cannot write {path}: {error.strerror}; give another place with -o.") from None
    with reserved(path, force=True):
        yield path


@contextlib.contextmanager
def folder(path: Path, force: bool = False, besides: Collection[str] = ()) -> Iterator[Path]:
    """A folder for the files of a command, created if there is none; it is removed if it was created and stays empty.

    What is called as one of `besides` may be in it.

    Raises:
        InputError: there are files in it and `force` is not given, or none can be written there.
    """
    made = not path.exists()
    try:
        path.mkdir(parents=True, exist_ok=True)
        empty = all(one.name in besides for one in path.iterdir())
    except OSError as error:
        raise InputError(
            f"Cannot write into {path}: {error.strerror}; give another folder with -o."
        ) from None
    if not (empty or force):
        raise InputError(
            f"The folder {path} is not empty and nothing in it is replaced: give another with -o, or --force."
        )
    if not os.access(path, os.W_OK | os.X_OK):
        raise InputError(f"Cannot write into {path}: Permission denied; give another folder with -o.")
    try:
        yield path
    finally:
        with contextlib.suppress(OSError):
            if made:
                path.rmdir()
