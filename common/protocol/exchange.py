"""The protocol of a test as a table: what each laboratory may do in which state.

Sans-IO: no clock, socket or thread. The loops feed events in; what an event may not do in a state is
an error that says whose fault it is.
"""

from __future__ import annotations

from enum import Enum

from common.errors import LocalProtocolError, RemoteProtocolError


class State(Enum):
    """Where a laboratory stands in a test; `running` says whether ticks may go on."""

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
    """One laboratory's place in the protocol, its session, and the newest message of each kind of frame."""

    def __init__(self) -> None:
        self.state = State.IDLE
        self.session = 0
        self.cause = ""
        self.newest_seq = -1

    def happen(self, event: Event, *, remote: bool = False, cause: str = "") -> None:
        """Move on by an event of this side, or of the other (`remote`).

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
        """Whether a frame is newer than all before; takes note of it."""
        if seq <= self.newest_seq:
            return False
        self.newest_seq = seq
        return True

    @property
    def ended(self) -> bool:
        """Whether the test is over for this laboratory."""
        return self.state in FINAL
