"""The protocol of a test as a table: which event may happen in which state, and the state that follows.

It contains no clock, socket or thread: the loops call it with events. An event that is not allowed in a state raises
an error that tells whether this process or another one caused it.
"""

from __future__ import annotations

from enum import Enum

from common.errors import LocalProtocolError, RemoteProtocolError


class State(Enum):
    """The state of a laboratory in a test; `running` tells whether it runs ticks."""

    def __init__(self, name: str) -> None:
        self.running = name in ("scheduled", "running")

    IDLE = "idle"
    REGISTERED = "registered"
    ARMED = "armed"
    SCHEDULED = "scheduled"
    RUNNING = "running"
    STOPPING = "stopping"
    DONE = "done"
    REFUSED = "refused"
    TRIPPED = "tripped"
    LOST = "lost"


class Event(Enum):
    """What can happen to a laboratory in a test."""

    REGISTER = "register"
    REFUSE = "refuse"
    ARM = "arm"
    SCHEDULE = "schedule"
    RUN = "run"
    STOP = "stop"
    FINISH = "finish"
    TRIP = "trip"
    LOSE = "lose"


_ABNORMAL = {Event.TRIP: State.TRIPPED, Event.LOSE: State.LOST}

TRANSITIONS: dict[State, dict[Event, State]] = {
    State.IDLE: {
        Event.REGISTER: State.REGISTERED,
        Event.REFUSE: State.REFUSED,
        Event.STOP: State.STOPPING,
        **_ABNORMAL,
    },
    State.REGISTERED: {
        Event.REFUSE: State.REFUSED,
        Event.ARM: State.ARMED,
        Event.STOP: State.STOPPING,
        **_ABNORMAL,
    },
    State.ARMED: {Event.SCHEDULE: State.SCHEDULED, Event.STOP: State.STOPPING, **_ABNORMAL},
    State.SCHEDULED: {Event.RUN: State.RUNNING, Event.STOP: State.STOPPING, **_ABNORMAL},
    State.RUNNING: {Event.STOP: State.STOPPING, **_ABNORMAL},
    State.STOPPING: {Event.FINISH: State.DONE, **_ABNORMAL},
    State.DONE: {},
    State.REFUSED: {},
    State.TRIPPED: {},
    State.LOST: {},
}

FINAL = frozenset(state for state, row in TRANSITIONS.items() if not row)


class Exchange:
    """One laboratory's state in the protocol, its session, the cause of its end, and the newest message number."""

    def __init__(self) -> None:
        self.state = State.IDLE
        self.session = 0
        self.cause = ""
        self.newest_seq = -1

    def happen(self, event: Event, *, remote: bool = False, cause: str = "") -> None:
        """Go to the state that follows an event of this laboratory, or of another one where `remote`.

        Raises:
            LocalProtocolError, RemoteProtocolError: the table has no such event in this state.
        """
        row = TRANSITIONS[self.state]
        if event not in row:
            error = RemoteProtocolError if remote else LocalProtocolError
            raise error(f"Event '{event.value}' is not allowed in the state '{self.state.value}'.")
        self.state = row[event]
        self.cause = self.cause or cause

    def allows(self, event: Event) -> bool:
        """Whether an event may happen now."""
        return event in TRANSITIONS[self.state]

    def belongs(self, session: int) -> bool:
        """Whether a message is of this session."""
        return self.session != 0 and session == self.session

    def fresh(self, seq: int) -> bool:
        """Whether a message number is higher than all before; if so it becomes the newest."""
        if seq <= self.newest_seq:
            return False
        self.newest_seq = seq
        return True

    @property
    def ended(self) -> bool:
        """Whether the test is over for this laboratory."""
        return self.state in FINAL
