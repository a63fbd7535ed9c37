"""The records that ship, and how a record named in a plan is found and read."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from common.errors import InputError
from models.ground_motion.at2 import read_at2
from models.ground_motion.csv import read_csv, same_interval
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

Reader = Callable[[Path], GroundMotion]

READERS: dict[str, Reader] = {
    ".at2": read_at2,
    # K-NET, then KiK-net in the borehole (1) and at the surface (2)
    **dict.fromkeys((".ns", ".ew", ".ud", ".ns1", ".ew1", ".ud1", ".ns2", ".ew2", ".ud2"), read_knet),
}
COLUMNS = (".csv", ".dat", ".tsv", ".txt")
LEAST_INTERVAL = (
    1e-6  # s: no ground motion is sampled more often, so a shorter one points to another unit of time
)


def load(record: str, base: Path, dt: float = 0.0, unit: str = "") -> GroundMotion:
    """The record that ships under this name, or the file at this path, relative to the folder `base`.

    `dt` (s) and `unit` are for files of columns that do not say theirs; 0 and empty where the plan gives none.

    Raises:
        InputError: there is neither, the file cannot be read, or it says another interval or unit.
    """
    return shipped(record, dt, unit) if record in MOTIONS else of_file(record, base / record, dt, unit)


@cache
def shipped(record: str, dt: float, unit: str) -> GroundMotion:
    """The record that ships under this name, read once by a process; see `load`."""
    found = MOTIONS[record]
    path = FOLDER / found.file
    motion = of_file(record, path, dt, unit if reader(path) else "")
    return replace(motion, name=found.name, version=found.version)


def of_file(record: str, path: Path, dt: float, unit: str) -> GroundMotion:
    """The motion in a file, which a plan calls `record`; see `load`."""
    if not path.is_file():
        raise InputError(missing(record, path))
    own = reader(path)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = own(path) if own else read_csv(path, dt, unit)
    if own and unit:
        raise InputError(
            f"{path} says its unit itself: leave out unit in [ground_motion], which is for files of columns."
        )
    if own:
        same_interval(path, motion.interval, dt)
    check(path, motion)
    return motion


def check(path: Path, motion: GroundMotion) -> None:
    """Raise InputError where a motion cannot be used in a computation."""
    if not LEAST_INTERVAL <= motion.interval < math.inf:
        raise InputError(
            f"The samples of {path} come every {motion.interval:g} s, which no record of an earthquake does: correct "
            "its times, or dt in [ground_motion]."
        )
    if not np.all(np.isfinite(motion.acceleration)):
        raise InputError(
            f"{path} holds accelerations that are too large to be computed with: correct the file."
        )


def missing(record: str, path: Path) -> str:
    """Sentence for a record that is neither a file nor a shipped name, with the nearest of the names."""
    close = difflib.get_close_matches(record, MOTIONS, n=1)
    hint = f"; did you mean {close[0]}?" if close else "."
    return (
        f"Ground motion '{record}' is neither the file {path} nor a record that ships:"
        f" give the path of a file or one of {', '.join(MOTIONS)}{hint}"
    )


def reader(path: Path) -> Reader | None:
    """The reader of a format that says interval and unit itself, by suffix or first lines; None for columns of text.

    Raises:
        InputError: neither tells the format.
    """
    suffix = path.suffix.lower()
    if suffix in READERS:
        return READERS[suffix]
    if suffix == ".csv":
        return None
    head = read_source(path).lines[:4]
    if head and head[0].startswith("Origin Time"):
        return read_knet
    if any("NPTS" in line.upper() for line in head):
        return read_at2
    if suffix in COLUMNS:
        return None
    names = ", ".join(sorted({*READERS, *COLUMNS}))
    raise InputError(
        f"The format of ground motion {path} is unknown: give it the suffix of its format ({names})."
    )
