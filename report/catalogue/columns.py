"""What a catalogue says of each recording: one table, from which the file, the queries and the page follow."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

Facts = dict[
    str, Any
]  # the values of a recording by the names of COLUMNS; None where a recording does not say
WHOLE, CUT, DAMAGED, UNREADABLE = "whole", "cut off", "damaged", "unreadable"  # states of a recording's file


class CatalogueColumn(NamedTuple):
    """A column of the catalogue; `unit` is that of a number in SI, empty for a plain one, and None for a text."""

    name: str
    unit: str | None
    text: str


COLUMNS = (
    CatalogueColumn("file", None, "path from the catalogue's folder"),
    CatalogueColumn("test", None, "name of the test"),
    CatalogueColumn("started", None, "date and time (UTC) at which the recording began"),
    CatalogueColumn("duration", "s", "planned length of the test"),
    CatalogueColumn("clock", None, "real, virtual, simulation or import"),
    CatalogueColumn("motion", None, "ground motion"),
    CatalogueColumn("scale", "", "factor on the ground motion"),
    CatalogueColumn("outcome", None, "completed, stopped, tripped, lost, cut off, imported or simulated"),
    CatalogueColumn("cause", None, "why the test ended, in words"),
    CatalogueColumn("ticks", "", "recorded ticks of the master, or of the laboratory with most"),
    CatalogueColumn("missing", "", "ticks that are not recorded although later ones are"),
    CatalogueColumn("late", "", "late ticks"),
    CatalogueColumn("state", None, "whole, cut off, damaged or unreadable"),
    CatalogueColumn("damage", None, "where the file is damaged"),
    CatalogueColumn("digest", None, "digest of the plan"),
    CatalogueColumn("differs", None, "keys of the plan that are not at their defaults, with their values"),
    CatalogueColumn("diagnosis", None, "status of the diagnosis report (JSON) that names the recording"),
    CatalogueColumn("verdict", None, "verdict of that report"),
    CatalogueColumn("tags", None, "tags from the notes beside the recording"),
    CatalogueColumn("notes", None, "notes beside the recording"),
    CatalogueColumn("size", "B", "bytes of the file"),
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
