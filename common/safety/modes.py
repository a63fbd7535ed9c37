"""The safety state machine of a laboratory as a table: what its rig may do, and how it comes to rest.

It stands beside the protocol of a test (common/protocol/exchange.py), which says what the laboratories have agreed on.
A state that is latched is left by an operator's reset alone, and only when its cause is gone.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from common.errors import LocalProtocolError


class Mode(Enum):
    """What a laboratory's rig may do."""

    __hash__ = object.__hash__  # each member is one object; the library's own takes the name's, in Python

    IDLE = "idle"
    CONFIGURED = "configured"
    ARMED = "armed"
    RUNNING = "running"
    HOLDING = "holding"
    RAMPING = "ramping"
    SAFE = "safe"
    EMERGENCY_STOP = "emergency_stop"


class Turn(Enum):
    """What leads from one mode to another."""

    __hash__ = object.__hash__

    CONFIGURE = "configure"
    ARM = "arm"
    RUN = "run"
    HOLD = "hold"
    RESUME = "resume"
    END = "end"
    TRIP = "trip"
    EMERGENCY = "emergency"
    SECURED = "secured"
    SETTLED = "settled"
    RESET = "reset"


MEANING = {
    Turn.CONFIGURE: "the laboratories have found each other and hold the same plan",
    Turn.ARM: "the rig is ready to move",
    Turn.RUN: "the first tick",
    Turn.HOLD: "no fresh message for `hold_after` intervals",
    Turn.RESUME: "a fresh message came in time",
    Turn.END: "the test is over in order, or somebody asked for its end",
    Turn.TRIP: "a limit, the watchdog, the rig, the other laboratory or an overrun",
    Turn.EMERGENCY: "an emergency stop of this laboratory, by its rig or an operator",
    Turn.SECURED: "the rig is at rest after a trip",
    Turn.SETTLED: "the rig is at rest after an orderly end",
    Turn.RESET: "an operator's new press of reset, its cause gone",
}

_STOPPED = {Turn.END: Mode.RAMPING, Turn.TRIP: Mode.RAMPING, Turn.EMERGENCY: Mode.EMERGENCY_STOP}

TURNS: dict[Mode, dict[Turn, Mode]] = {
    Mode.IDLE: {Turn.CONFIGURE: Mode.CONFIGURED, Turn.EMERGENCY: Mode.EMERGENCY_STOP},
    Mode.CONFIGURED: {Turn.ARM: Mode.ARMED, Turn.END: Mode.IDLE, Turn.EMERGENCY: Mode.EMERGENCY_STOP},
    Mode.ARMED: {
        Turn.RUN: Mode.RUNNING,
        Turn.END: Mode.IDLE,
        Turn.TRIP: Mode.SAFE,  # nothing has moved
        Turn.EMERGENCY: Mode.EMERGENCY_STOP,
    },
    Mode.RUNNING: {Turn.HOLD: Mode.HOLDING, **_STOPPED},
    Mode.HOLDING: {Turn.RESUME: Mode.RUNNING, **_STOPPED},
    Mode.RAMPING: {
        Turn.SECURED: Mode.SAFE,
        Turn.SETTLED: Mode.IDLE,
        Turn.EMERGENCY: Mode.EMERGENCY_STOP,
    },
    Mode.SAFE: {Turn.RESET: Mode.IDLE, Turn.EMERGENCY: Mode.EMERGENCY_STOP},
    Mode.EMERGENCY_STOP: {Turn.RESET: Mode.IDLE},
}

LATCHED = frozenset({Mode.SAFE, Mode.EMERGENCY_STOP})

STILL_LATCHED = (
    "it is latched in its safe state since the test before: `rths reset` lets it go."  # refuses a test
)


class Cause(NamedTuple):
    """Why a laboratory came to a latched state: the first reason, which stays."""

    code: str
    text: str
    t: float  # test time, s
    lab: str  # where it began


class Safety:
    """One laboratory's mode; `told` hears of every change as (from, turn, to)."""

    def __init__(self, told: Callable[[Mode, Turn, Mode], None]) -> None:
        self.mode = Mode.IDLE
        self.cause: Cause | None = None
        self._told = told
        self._presses: set[int] = set()

    def allows(self, turn: Turn) -> bool:
        """Whether a turn may be taken now."""
        return turn in TURNS[self.mode]

    def take(self, turn: Turn) -> None:
        """Take a turn; raises LocalProtocolError where the table has none, or a reset that was not admitted."""
        row = TURNS[self.mode]
        if turn not in row or (turn is Turn.RESET and self.cause is not None):
            raise LocalProtocolError(f"'{turn.value}' is not a turn of the mode '{self.mode.value}'.")
        before, self.mode = self.mode, row[turn]
        self._told(before, turn, self.mode)

    def follow(self, turn: Turn) -> None:
        """Take a turn where the mode has it; elsewhere it changes nothing."""
        if self.allows(turn):
            self.take(turn)

    def trip(self, cause: Cause, turn: Turn = Turn.TRIP) -> None:
        """Latch the first cause, and leave for the safe state where something could move."""
        if self.cause is None and (self.allows(turn) or self.mode is Mode.RAMPING):
            self.cause = cause
        self.follow(turn)

    def at_rest(self) -> None:
        """The rig has come to rest at the end of its ramp."""
        self.take(Turn.SECURED if self.cause is not None else Turn.SETTLED)

    def pressed(self, press: int) -> bool:
        """Take note of an operator's press; whether it is a new one, which a repeated, held or replayed one is not."""
        new = press not in self._presses
        self._presses.add(press)
        return new

    def reset(self) -> None:
        """Leave a latched state; its cause is forgotten."""
        self.cause = None
        self.take(Turn.RESET)

    @property
    def latched(self) -> bool:
        """Whether only an operator's reset leads on."""
        return self.mode in LATCHED

    @property
    def moving(self) -> bool:
        """Whether commands go to the rig."""
        return self.mode in (Mode.RUNNING, Mode.HOLDING, Mode.RAMPING)


def mermaid() -> str:
    """The table as a state diagram in Mermaid's notation."""
    lines = ["stateDiagram-v2", "    [*] --> idle"]
    for mode, row in TURNS.items():
        lines += [f"    {mode.value} --> {to.value}: {turn.value}" for turn, to in row.items()]
    return "\n".join(lines)
