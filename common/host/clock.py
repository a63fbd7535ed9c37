"""Clocks as objects: the machine's monotonic one, and a virtual twin for tests and virtual time."""

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
        """A message has come for the process that waits on this clock."""


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
    """A clock that stands still until it is told to move; of a process that is alone, so that no message comes."""

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
        """Nobody waits."""


def unix_ns() -> int:
    """The machine's wall clock, ns since 1970."""
    return time.time_ns()
