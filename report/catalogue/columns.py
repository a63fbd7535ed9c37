"""What a catalogue says of each recording: one table, from which the file, the queries and the page follow."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

Facts = dict[
    str, Any
]  # the values of a recording by the names of COLUMNS; None where a recording does not say


class Column(NamedTuple):
    """A column of the catalogue; `unit` is that of a number in SI, empty for a plain one, and None for a text."""

    name: str
    unit: str | None
    text: str


COLUMNS = (
    Column("file", None, "path from the catalogue's folder"),
    Column("test", None, "name of the test"),
    Column("started", None, "date and time (UTC) at which the recording began"),
    Column("duration", "s", "planned length of the test"),
    Column("clock", None, "real, virtual, simulation or import"),
    Column("motion", None, "ground motion"),
    Column("scale", "", "factor on the ground motion"),
    Column("outcome", None, "completed, stopped, tripped, lost, cut off, imported or simulated"),
    Column("cause", None, "why the test ended, in words"),
    Column("ticks", "", "recorded ticks of the master, or of the laboratory with most"),
    Column("missing", "", "ticks that are not recorded although later ones are"),
    Column("late", "", "late ticks"),
    Column("state", None, "whole, cut off, damaged or unreadable"),
    Column("damage", None, "where the file is damaged"),
    Column("digest", None, "digest of the plan"),
    Column("differs", None, "keys of the plan that are not at their defaults, with their values"),
    Column("diagnosis", None, "status of the diagnosis report (JSON) that names the recording"),
    Column("verdict", None, "verdict of that report"),
    Column("tags", None, "tags from the notes beside the recording"),
    Column("notes", None, "notes beside the recording"),
    Column("size", "B", "bytes of the file"),
)
NAMES = tuple(column.name for column in COLUMNS)
BY_NAME = {column.name: column for column in COLUMNS}
NOTES = ".notes.toml"  # ending of the file beside a recording that holds its notes and tags
DRIFT = "drift"  # peak that no signal holds: the largest of all storeys


class Peak(NamedTuple):
    """The largest magnitude of a signal in a recording, in the SI unit of the signal; `topic` recorded it."""

    topic: str
    name: str
    value: float
    unit: str


def notes_of(path: Path) -> Path:
    """The file with the notes on a recording."""
    return path.with_name(path.name + NOTES)
