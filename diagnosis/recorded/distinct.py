"""Recordings that are one measurement under two names: such a pair neither validates a finding nor adds evidence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.errors import InputError
from diagnosis.recorded.record import Record


def refuse_copies(searched: Sequence[Record], validating: Sequence[Record]) -> None:
    """Raise InputError where two records of one laboratory hold the same readings, whatever their files are called.

    The records `searched` are those in which causes are looked for, the records `validating` those that judge them.
    """
    known: list[Record] = []
    for one in (*searched, *validating):
        double = next((other for other in known if same_readings(one, other)), None)
        if double is not None and len(known) >= len(searched):
            raise InputError(
                f"{one.run.path} holds the same readings as {double.run.path} and cannot validate it: give --validate "
                "another recording."
            )
        if double is not None:
            raise InputError(
                f"{one.run.path} holds the same readings as {double.run.path}: give each recording once."
            )
        known.append(one)


def same_readings(one: Record, other: Record) -> bool:
    """Whether two records are equal on all ticks that both have, so that one is the other or its beginning.

    Readings decide, because their noise makes every measurement one of a kind, while tests share commands and time;
    other signals decide only where no reading is in both.
    """
    ticks = min(one.ticks, other.ticks)
    shared = [name for name in one.signals if one.has(name) and other.has(name)]
    readings = {name for lab in one.labs for name in lab.measured}
    names = [name for name in shared if name in readings] or shared
    equal = (np.array_equal(one.signals[name][:ticks], other.signals[name][:ticks]) for name in names)
    return bool(names) and all(equal)
