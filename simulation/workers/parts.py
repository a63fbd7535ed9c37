"""The rows of a table that are done, kept in files beside it until all are there.

`TABLE.parts/` describes the table and holds one file for every finished batch. A batch is written as a whole: into a
file of another name, which is synced and then renamed. So a command that is killed loses the batches under way only,
and the same command goes on with the others. Only the process that spreads the work writes here.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
from pyarrow import feather, parquet

from common.errors import InputError
from common.terminal import outputs
from common.terminal.telling import Tell, untold
from simulation.workers.batch import Batch
from simulation.workers.pool import spread

ABOUT = "about.json"
ENDING = ".parts"  # of the folder beside a table
PART = ".arrow"
NEW = ".new"
ROWS = 65536  # of a row group, so that a reader of a few columns reads a few pages


class Way(NamedTuple):
    """How work is spread: over this many processes, −1 for one per processor, or over a Dask cluster."""

    jobs: int = 1
    dask: str = ""


class Parts:
    """The batches that are there, of `count`, in the folder beside a table; `begin` and `add` write."""

    def __init__(self, folder: Path, schema: pa.Schema, count: int) -> None:
        self.folder = folder
        self.schema = schema
        self.count = count
        for path in folder.glob(f"*{NEW}"):
            path.unlink()
        self.there = {int(path.stem) for path in folder.glob(f"*{PART}")}

    def add(self, batch: Batch) -> None:
        """Keep a batch; a second one of the same number changes nothing."""
        if batch.number in self.there:
            return
        path = self.folder / f"{batch.number:07d}{PART}"
        new = path.with_suffix(NEW)
        feather.write_feather(pa.table(batch.columns, schema=self.schema), new, compression="lz4")
        synced(new)
        new.replace(path)
        synced(self.folder)
        self.there.add(batch.number)

    def table(self) -> pa.Table:
        """All rows, in the order of the batches."""
        paths = [self.folder / f"{number:07d}{PART}" for number in range(self.count)]
        return pa.concat_tables([feather.read_table(path, memory_map=False) for path in paths])


def synced(path: Path) -> None:
    """Wait until a file or a folder is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def parts(
    table: Path, about: Mapping[str, Any], schema: pa.Schema, count: int, *, force: bool = False
) -> Iterator[Parts]:
    """The parts of a table within the context; they are removed after it, unless an error ends it.

    `about` describes the table, by names; with `force` the parts of another one are removed.

    Raises:
        InputError: parts of another table are there and `force` is not given, another process is at work on them, or
            none can be written.
    """
    folder = table.with_name(f"{table.name}{ENDING}")
    try:
        with opened(folder, table, json.dumps(about, indent=1, sort_keys=True), force):
            found = Parts(folder, schema, count)
            try:
                yield found
            except BaseException:
                if not found.there:
                    shutil.rmtree(folder)
                raise
            shutil.rmtree(folder)
    except OSError as error:
        raise InputError(f"Cannot write into {folder}: {error.strerror}; give another place.") from None


@contextlib.contextmanager
def opened(folder: Path, table: Path, text: str, force: bool) -> Iterator[None]:
    """Make or find the folder, and hold it against other processes."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ABOUT).open("a+", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"Another process is at work on {table}: wait for it, or give another name."
            ) from None
        file.seek(0)
        given = file.read()
        if given and given != text:
            if not force:
                raise another(folder, given, text)
            for path in folder.iterdir():
                if path.name != ABOUT:
                    path.unlink()
        if given != text:
            file.truncate(0)
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        yield


def another(folder: Path, given: str, text: str) -> InputError:
    """The error for parts of another table, which names what differs."""
    try:
        before = json.loads(given)
    except ValueError:
        before = {}
    now = json.loads(text)
    names = [name for name in now if before.get(name) != now[name]]
    return InputError(
        f"{folder} holds rows that were computed with another {' and another '.join(names) or 'definition'}: give "
        "another name for the table, or --force to compute them anew."
    )


def complete(
    found: Parts, function: Callable[[Any], Batch], tasks: Sequence[Any], way: Way, tell: Tell = untold
) -> pa.Table:
    """Compute the batches that are not there, `function` of task k being batch k; returns the whole table.

    Raises:
        InputError, LostError: as `spread`.
    """
    missing = [task for number, task in enumerate(tasks) if number not in found.there]
    tell("batches", len(found.there), found.count)
    for batch in spread(function, missing, way.jobs, way.dask):
        found.add(batch)
        tell("batches", len(found.there), found.count)
    return found.table()


def write(path: Path, table: pa.Table, *, force: bool = False) -> None:
    """Write a table as a Parquet file, which holds no time and no name of a machine."""
    with outputs.writing(path, force) as temporary:
        parquet.write_table(table, temporary, compression="zstd", row_group_size=ROWS)
