"""The orders of the panel: what its buttons say, and how carefully each is taken."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from common.lab.operation import EMERGENCY, HOLD, ORDERS, RESET, RESUME, START, STOP

CHECK, MACHINE, ARM = "check", "machine", "arm"  # which this machine carries out, not the laboratories


class Word(NamedTuple):
    """An order: its button's label, and whether it brings a rig nearer to motion, so that it must be a fresh wish."""

    word: str
    label: str
    says: str
    moves: bool = False
    of_test: bool = True  # whether it is for the laboratories of a running test
    planned: bool = False  # whether it is for the plan that the page showed


def ordered(word: str, label: str, *, moves: bool = False, planned: bool = False) -> Word:
    """A button for an order that the laboratories of a running test carry out."""
    return Word(word, label, ORDERS[word].says, moves=moves, planned=planned)


WORDS: Mapping[str, Word] = {
    one.word: one
    for one in (
        Word(CHECK, "Check the plan", "describe the plan and what it lacks", of_test=False),
        Word(MACHINE, "Check the machine", "measure what this machine lacks", of_test=False),
        Word(
            ARM,
            "Arm",
            "make the rigs ready; nothing moves before Start",
            moves=True,
            of_test=False,
            planned=True,
        ),
        ordered(START, "Start", moves=True, planned=True),
        ordered(HOLD, "Hold"),
        ordered(RESUME, "Resume", moves=True),
        ordered(STOP, "Stop"),
        ordered(EMERGENCY, "Emergency stop"),
        ordered(RESET, "Reset", moves=True),
    )
}
