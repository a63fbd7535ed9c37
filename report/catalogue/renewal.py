"""Makes and renews the catalogue from recordings, and from the notes and diagnosis reports beside them."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from common.errors import InputError
from common.terminal.telling import Tell, untold
from report.catalogue import entry, store
from report.catalogue.columns import NAMES, notes_of
from report.catalogue.entry import CatalogueEntry
from simulation.workers.pool import spread

# Recordings from which on several processes read sooner than one: their start takes as long as reading some eighty
# recordings of 40 s, and two of them save half of the reading.
FEW = 160
# Bytes of a JSON file up to which it is read as a possible diagnosis report, which has some hundred thousand.
LARGEST_REPORT = 16 << 20


class Renewal(NamedTuple):
    """The result of a renewal of the catalogue: recordings in it, read again, removed, and incomplete."""

    recordings: int
    read: int
    gone: int
    lacking: int


def renew(folders: Sequence[Path], tell: Tell = untold) -> Renewal:
    """Make or renew the catalogue in the first folder of all recordings in the folders and below.

    A recording is read only where the file, or the notes beside it, changed since. A renewal that is interrupted leaves
    the catalogue as it was.

    Raises:
        InputError: a folder is not there, or the catalogue cannot be written.
    """
    home = folders[0].resolve()
    found = {entry.named(path, home): path for folder in folders for path in recordings(folder)}
    with store.opened(home / store.NAME, create=True) as base:
        known = dict(base.execute("SELECT file, stamp FROM stamps"))
        stamps = {name: stamp(path) for name, path in found.items()}
        anew = [name for name, value in stamps.items() if known.get(name) != value]
        gone = known.keys() - found.keys()
        forget(base, [*gone, *anew])
        for one in entries([found[name] for name in anew], home, tell):
            add(base, one, stamps[one.facts["file"]])
        judge(base, folders)
        count, lacking = base.execute("SELECT count(*), total(state != 'whole') FROM recordings").fetchone()
    return Renewal(count, len(anew), len(gone), int(lacking))


def entries(paths: Sequence[Path], home: Path, tell: Tell) -> list[CatalogueEntry]:
    """The entries of recordings in the order of their names, read by one process for each processor where many."""
    read = []
    for one in spread(partial(entry.entry, folder=home), paths, -1 if len(paths) > FEW else 1):
        read.append(one)
        tell("recordings", len(read), len(paths))
    return sorted(read, key=lambda one: str(one.facts["file"]))


def recordings(folder: Path) -> Iterator[Path]:
    """All recordings in a folder and below; raises InputError where there is no such folder."""
    if not folder.is_dir():
        raise InputError(f"There is no folder {folder}: give one that holds recordings (MCAP).")
    return (path.resolve() for path in sorted(folder.rglob("*.mcap")) if path.is_file())


def stamp(path: Path) -> str:
    """What changes when a recording or its notes change: sizes and times of the files."""
    files = (path, notes_of(path))
    return " ".join(
        f"{one.st_size}.{one.st_mtime_ns}" for one in (file.stat() for file in files if file.exists())
    )


def forget(base: sqlite3.Connection, names: Iterable[str]) -> None:
    """Remove entries."""
    for table in store.TABLES:
        base.executemany(f"DELETE FROM {table} WHERE file = ?", [(name,) for name in names])  # noqa: S608 - constants


def add(base: sqlite3.Connection, one: entry.CatalogueEntry, stamped: str) -> None:
    """Add an entry."""
    name, marks = one.facts["file"], ", ".join("?" * len(NAMES))
    base.execute(f"INSERT INTO recordings VALUES ({marks})", [one.facts[column] for column in NAMES])  # noqa: S608 - marks
    base.executemany("INSERT INTO peaks VALUES (?, ?, ?, ?, ?)", [(name, *peak) for peak in one.peaks])
    base.execute("INSERT INTO stamps VALUES (?, ?)", (name, stamped))


def judge(base: sqlite3.Connection, folders: Sequence[Path]) -> None:
    """Enter the verdicts of diagnosis reports in the folders; of several on one recording the newest counts."""
    base.execute("UPDATE recordings SET diagnosis = NULL, verdict = NULL")
    files = [path for folder in folders for path in folder.rglob("*.json")]
    for path in sorted(files, key=lambda file: file.stat().st_mtime_ns):
        found = entry.diagnosis(path) if path.stat().st_size <= LARGEST_REPORT else None
        if found:
            name, facts = found
            base.execute(
                "UPDATE recordings SET diagnosis = ?, verdict = ? WHERE file = ? OR file LIKE ? ESCAPE '\\'",
                (facts["diagnosis"], facts["verdict"], name, "%/" + store.escaped(name)),
            )
