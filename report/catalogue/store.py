"""The catalogue's file: SQLite, beside the recordings."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path

from common.errors import InputError
from report.catalogue.columns import COLUMNS, NAMES, Facts, Peak

NAME = "catalog.sqlite"
TABLES = ("recordings", "peaks", "stamps")
VERSION = 1  # of the tables; a file of another version is created again


@contextlib.contextmanager
def opened(path: Path, *, create: bool = False) -> Iterator[sqlite3.Connection]:
    """The catalogue, in one transaction that an error undoes; with `create` a new one, or one that may be written.

    Raises:
        InputError: the file is missing, is not a catalogue, or cannot be written.
    """
    if not create and not path.exists():
        raise InputError(f"There is no catalogue {path}: make it with rths catalog {path.parent}.")
    try:
        with (
            contextlib.closing(
                sqlite3.connect(path if create else f"file:{path}?mode=ro", uri=not create)
            ) as base,
            base,
        ):
            base.execute("BEGIN IMMEDIATE" if create else "BEGIN")
            if base.execute("PRAGMA user_version").fetchone()[0] != VERSION:
                if not create:
                    raise InputError(
                        f"{path} is not whole or of another version: renew it with rths catalog {path.parent}."
                    )
                made(base)
            yield base
    except sqlite3.Error as error:
        if create and not os.access(path if path.exists() else path.parent, os.W_OK):
            raise InputError(
                f"Cannot write the catalogue {path}: you may not write there; name a folder of your own first, where "
                "the catalogue then lies, and this one after it."
            ) from None
        raise InputError(
            f"Cannot use the catalogue {path}: {error}; if it is damaged, delete it and make it anew."
        ) from None


def made(base: sqlite3.Connection) -> None:
    """Create the tables again."""
    types = ", ".join(f"{one.name} {'TEXT' if one.unit is None else 'REAL'}" for one in COLUMNS)
    for table in TABLES:
        base.execute(f"DROP TABLE IF EXISTS {table}")
    base.execute(f"CREATE TABLE recordings ({types}, PRIMARY KEY (file))")
    base.execute("CREATE TABLE peaks (file TEXT, topic TEXT, name TEXT, value REAL, unit TEXT)")
    base.execute("CREATE INDEX of_peaks ON peaks (name, file)")
    base.execute("CREATE TABLE stamps (file TEXT PRIMARY KEY, stamp TEXT)")
    base.execute(f"PRAGMA user_version = {VERSION}")


def escaped(text: str) -> str:
    r"""A text for LIKE with `\` as its escape."""
    return text.replace("\\", "\\\\").replace("%", "\\%").replace("_", "\\_")


def facts_of(base: sqlite3.Connection, where: str = "1", values: Sequence[object] = ()) -> list[Facts]:
    """The facts of the recordings that fit a condition, the newest first."""
    rows = base.execute(f"SELECT * FROM recordings WHERE {where} ORDER BY started DESC, file", values)  # noqa: S608 - of query
    return [dict(zip(NAMES, row, strict=True)) for row in rows]


def peaks_of(base: sqlite3.Connection, file: str) -> list[Peak]:
    """The peaks of one recording."""
    rows = base.execute("SELECT topic, name, value, unit FROM peaks WHERE file = ? ORDER BY rowid", (file,))
    return [Peak(*row) for row in rows]


def largest(base: sqlite3.Connection, name: str) -> dict[str, Peak]:
    """The largest peak of a signal's name by recording, whichever topic holds it."""
    rows = base.execute(
        "SELECT file, topic, name, max(value), unit FROM peaks WHERE name = ? GROUP BY file", (name,)
    )
    return {file: Peak(*rest) for file, *rest in rows}
