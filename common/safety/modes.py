"""The safety state machine of a laboratory as a table: what its rig may do, and how it comes to rest.

The protocol of a test (common/protocol/exchange.py) is a second state machine, for what the laboratories have agreed
on. Only an operator's reset leaves a latched mode, and only when its cause is gone.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from common.errors import LocalProtocolError


class Mode(Enum):
    """What a laboratory's rig may do."""

    __hash__ = object.__hash__  # faster than the library's, which hashes the name in Python

    IDLE = "idle"
    CONFIGURED = "configured"
    ARMED = "armed"
    RUNNING = "running"
    HOLDING = "holding"
    RAMPING = "ramping"
    SAFE = "safe"
    EMERGENCY_STOP = "emergency_stop"


class Turn(Enum):
    """A transition from one mode to another."""

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

# the reason with which a latched laboratory refuses a test
STILL_LATCHED = "it is latched in its safe state since the last test: `rths reset` releases it."


class Cause(NamedTuple):
    """The first reason why a laboratory came to a latched mode."""

    code: str
    text: str
    t: float  # test time, s
    lab: str  # the laboratory that found it


class Safety:
    """One laboratory's mode; `told` is called with every change as (mode before, turn, mode after)."""

    def __init__(self, told: Callable[[Mode, Turn, Mode], None]) -> None:
        self.mode = Mode.IDLE
        self.cause: Cause | None = None
        self._told = told
        self._presses: set[int] = set()

    def allows(self, turn: Turn) -> bool:
        """Whether a turn is possible in the present mode."""
        return turn in TURNS[self.mode]

    def take(self, turn: Turn) -> None:
        """Take a turn.

        Raises LocalProtocolError where the mode has no such turn, or the cause is not cleared at a reset.
        """
        row = TURNS[self.mode]
        if turn not in row or (turn is Turn.RESET and self.cause is not None):
            raise LocalProtocolError(f"'{turn.value}' is not a turn of the mode '{self.mode.value}'.")
        before, self.mode = self.mode, row[turn]
        self._told(before, turn, self.mode)

    def follow(self, turn: Turn) -> None:
        """Take a turn if the present mode allows it; otherwise change nothing."""
        if self.allows(turn):
            self.take(turn)

    def trip(self, cause: Cause, turn: Turn = Turn.TRIP) -> None:
        """Keep the first cause, and take the turn if the present mode allows it."""
        if self.cause is None and (self.allows(turn) or self.mode is Mode.RAMPING):
            self.cause = cause
        self.follow(turn)

    def at_rest(self) -> None:
        """Take note that the rig is at rest at the end of its ramp."""
        self.take(Turn.SECURED if self.cause is not None else Turn.SETTLED)

    def pressed(self, press: int) -> bool:
        """Take note of an operator's press; returns whether it is new, rather than repeated, held or replayed."""
        new = press not in self._presses
        self._presses.add(press)
        return new

    def reset(self) -> None:
        """Leave a latched mode and clear its cause."""
        self.cause = None
        self.take(Turn.RESET)

    @property
    def latched(self) -> bool:
        """Whether only an operator's reset leaves the present mode."""
        return self.mode in LATCHED

    @property
    def moving(self) -> bool:
        """Whether commands are written to the rig."""
        return self.mode in (Mode.RUNNING, Mode.HOLDING, Mode.RAMPING)


def mermaid() -> str:
    """The table as a state diagram in Mermaid's notation."""
    lines = ["stateDiagram-v2", "    [*] --> idle"]
    for mode, row in TURNS.items():
        lines += [f"    {mode.value} --> {to.value}: {turn.value}" for turn, to in row.items()]
    return "\n".join(lines)
