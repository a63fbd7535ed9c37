"""The orders of the panel: what its buttons say, and how carefully each is taken."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from common.lab.operation import EMERGENCY, HOLD, RESET, RESUME, START, STOP

CHECK, MACHINE, ARM = "check", "machine", "arm"  # which this machine carries out, not the laboratories


class Word(NamedTuple):
    """An order: its button's label, and whether it brings a rig nearer to motion, so that it must be a fresh wish."""

    word: str
    label: str
    says: str
    moves: bool = False
    of_test: bool = True  # whether it is for the laboratories of a running test
    planned: bool = False  # whether it is for the plan that the page showed


WORDS: Mapping[str, Word] = {
    one.word: one
    for one in (
        Word(CHECK, "Check the plan", "describes the plan and what it lacks", of_test=False),
        Word(MACHINE, "Check the machine", "measures what this machine lacks", of_test=False),
        Word(
            ARM,
            "Arm",
            "makes the rigs ready; nothing moves before Start",
            moves=True,
            of_test=False,
            planned=True,
        ),
        Word(START, "Start", "begins the armed test", moves=True, planned=True),
        Word(HOLD, "Hold", "lets the earthquake's time slow down and stand still"),
        Word(RESUME, "Resume", "lets the earthquake's time of a held test go on", moves=True),
        Word(STOP, "Stop", "brings all rigs to rest in order and ends the test"),
        Word(EMERGENCY, "Emergency stop", "disarms all rigs at once, without a ramp"),
        Word(RESET, "Reset", "lets latched laboratories go once the cause is gone", moves=True),
    )
}
