"""Reads the header of a file of columns: which column is time, which acceleration, and their units."""

from __future__ import annotations

import re
from typing import NamedTuple

from common.errors import InputError
from models.ground_motion.record import GAL, STANDARD_GRAVITY
from models.ground_motion.source import printable

UNITS = {"g": STANDARD_GRAVITY, "gal": GAL, "cm/s2": 0.01, "m/s2": 1.0, "mm/s2": 0.001}  # in m/s²
SPELLINGS = {  # of a unit without its marks: m/s^2, m_s2, m·s-2, m/s/s and m/sec2 all say the same
    "g": "g",
    "gal": "gal",
    **{
        f"{length}{second}": f"{length}/s2"
        for length in ("mm", "cm", "m")
        for second in ("s2", "ss", "sec2", "secsec")
    },
}
SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3}
TIME = re.compile(r"(time|t|seconds|sec|s)(?![a-z])(.*)")
ACCELERATION = re.compile(
    r"(ground[ _-]?acceleration|ground[ _-]?acc|acceleration|accel|acc|ag|a)(?![a-z0-9])(.*)"
)
EXAMPLE = "write a first line such as: time (s),acceleration (g)"
ACCEPTED = (
    "time, t or s, with s or ms; acceleration, accel, acc, ag, a or ground_acceleration, with m/s2, cm/s2, mm/s2, gal "
    "or g, as in 'acceleration (g)', 'acc [cm/s^2]' or 'acceleration_m_s2'"
)


class Header(NamedTuple):
    """The columns by their place, and their units."""

    time: int | None  # None where there is none
    acceleration: int
    second: float  # unit of the time, s
    unit: str  # of the acceleration, empty where none is given


def columns(cells: list[str], where: str) -> Header:
    """The meaning of one or two columns by their header; `where` is the place for errors.

    Raises:
        InputError: a name or a unit is unknown, or the two columns are of one kind.
    """
    words = [cell.strip().lower().replace("²", "2") for cell in cells]
    times = [place for place, word in enumerate(words) if TIME.fullmatch(word)]
    accelerations = [place for place, word in enumerate(words) if ACCELERATION.fullmatch(word)]
    for place in range(len(words)):
        if place not in times and place not in accelerations:
            raise InputError(
                f"Column '{printable(cells[place])}' at {where} is neither time nor acceleration: name it as one of "
                f"{ACCEPTED}."
            )
    if len(accelerations) != 1 or len(times) != len(words) - 1:
        raise InputError(
            f"The columns at {where} must be time and acceleration, or acceleration alone: {EXAMPLE}."
        )
    place = accelerations[0]
    time = times[0] if times else None
    return Header(
        time,
        place,
        1.0 if time is None else second(words[time], where),
        acceleration_unit(words[place], where),
    )


def said(word: str, pattern: re.Pattern[str]) -> tuple[str, str]:
    """The unit in a column's name, as it is written, and with letters and digits only."""
    match = pattern.fullmatch(word)
    written = match[2].strip(" _-,:/()[]{}") if match else ""
    return written, re.sub(r"[^a-z0-9]", "", written)


def second(word: str, where: str) -> float:
    """The unit of the time, s; raises InputError where it is unknown."""
    written, bare = said(word, TIME)
    if bare not in SECONDS:
        raise InputError(
            f"The time at {where} must be in seconds or ms, not in '{printable(written)}': {EXAMPLE}."
        )
    return SECONDS[bare]


def acceleration_unit(word: str, where: str) -> str:
    """The unit of the acceleration, empty where the name says none; raises InputError where it is unknown.

    `a_g` may be a ground acceleration or an acceleration in g, so that it is refused.
    """
    written, bare = said(word, ACCELERATION)
    if bare and bare not in SPELLINGS:
        raise InputError(f"Unit '{printable(written)}' at {where} is none of {', '.join(UNITS)}: {EXAMPLE}.")
    if word == "a_g":
        raise InputError(
            f"'a_g' at {where} may be a ground acceleration or an acceleration in g: write 'ag' and give unit in "
            "[ground_motion], or 'acceleration (g)'."
        )
    return SPELLINGS.get(bare, "")
