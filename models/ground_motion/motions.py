"""The records that ship, and how a record named in a plan is found and read."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from common.errors import InputError
from models.ground_motion.at2 import read_at2
from models.ground_motion.csv import read_csv
from models.ground_motion.knet import read_knet
from models.ground_motion.record import GroundMotion
from models.ground_motion.source import read_source

FOLDER = Path(__file__).parent / "records"


@dataclass(frozen=True)
class Shipped:
    """A record that ships: its file in `records/`, and the name and version that reports print."""

    file: str
    name: str
    version: str


MOTIONS = {
    "el_centro_1940_ns": Shipped(
        "el_centro_1940_ns.csv", "El Centro 1940 NS", "1,559-point version after a zero at t = 0"
    ),
    "loma_prieta_1989_corralitos_000": Shipped(
        "RSN753_LOMAP_CLS000.AT2", "Loma Prieta 1989 Corralitos 000", "PEER NGA RSN753 CLS000"
    ),
    "san_fernando_1971_pacoima_dam_164": Shipped(
        "RSN77_SFERN_PUL164.AT2", "San Fernando 1971 Pacoima Dam 164", "PEER NGA RSN77 PUL164"
    ),
}

READERS: dict[str, Callable[[Path], GroundMotion]] = {
    ".at2": read_at2,
    ".csv": read_csv,
    # K-NET, then KiK-net in the borehole (1) and at the surface (2)
    **dict.fromkeys((".ns", ".ew", ".ud", ".ns1", ".ew1", ".ud1", ".ns2", ".ew2", ".ud2"), read_knet),
}


def load(record: str, base: Path) -> GroundMotion:
    """The record that ships under this name, or the file at this path, relative to the folder `base`.

    Raises:
        InputError: there is neither, or the file cannot be read.
    """
    if record in MOTIONS:
        shipped = MOTIONS[record]
        motion = reader(FOLDER / shipped.file)(FOLDER / shipped.file)
        return replace(motion, name=shipped.name, version=shipped.version)
    path = base / record
    if not path.is_file():
        raise InputError(missing(record, path))
    return reader(path)(path)


def missing(record: str, path: Path) -> str:
    """Sentence for a record that is neither a file nor a shipped name, with the nearest of the names."""
    close = difflib.get_close_matches(record, MOTIONS, n=1)
    hint = f"; did you mean {close[0]}?" if close else "."
    return (
        f"Ground motion '{record}' is neither the file {path} nor a record that ships:"
        f" give the path of a file or one of {', '.join(MOTIONS)}{hint}"
    )


def reader(path: Path) -> Callable[[Path], GroundMotion]:
    """The reader for a file, by its suffix, or by its first lines where the suffix says nothing.

    Raises:
        InputError: neither tells the format.
    """
    suffix = path.suffix.lower()
    if suffix in READERS:
        return READERS[suffix]
    head = read_source(path).lines[:4]
    if head and head[0].startswith("Origin Time"):
        return read_knet
    if any("NPTS" in line.upper() for line in head):
        return read_at2
    if suffix == ".txt":
        return read_csv
    names = ", ".join(sorted({*READERS, ".txt"}))
    raise InputError(
        f"The format of ground motion {path} is unknown: give it the suffix of its format ({names})."
    )
