"""Clocks as objects: the machine's monotonic clock, and a virtual one for tests and virtual time."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Monotonic time in integer ns."""

    def now(self) -> int:
        """The present time, ns."""

    def sleep_until(self, deadline: int) -> None:
        """Return at or after `deadline`, ns."""


class Waiter(Clock, Protocol):
    """A clock in virtual time on which a process may also wait for a message."""

    def listen(self, timeout: int) -> None:
        """Return once a message has come, at the latest after `timeout` ns."""

    def wake(self) -> None:
        """Tell the clock that a message has come for the process that waits on it."""


class MonotonicClock:
    """The machine's monotonic clock."""

    def now(self) -> int:
        """The present time, ns."""
        return time.monotonic_ns()

    def sleep_until(self, deadline: int) -> None:
        """Sleep; a deadline that has passed returns at once."""
        left = deadline - time.monotonic_ns()
        if left > 0:
            time.sleep(left * 1e-9)


class VirtualClock:
    """A clock for one process without partners: it moves only when told to, and no message ever comes."""

    def __init__(self) -> None:
        self.time = 0

    def now(self) -> int:
        """The present time, ns."""
        return self.time

    def sleep_until(self, deadline: int) -> None:
        """Move to `deadline` unless it has passed."""
        self.time = max(self.time, deadline)

    def listen(self, timeout: int) -> None:
        """Move on by `timeout` ns."""
        self.time += timeout

    def wake(self) -> None:
        """Do nothing: no process waits on this clock."""


def real(clock: Clock) -> bool:
    """Whether a clock is the machine's, so that what happens outside of this process keeps its time."""
    return isinstance(clock, MonotonicClock)


def unix_ns() -> int:
    """The machine's wall clock, ns since 1970."""
    return time.time_ns()
