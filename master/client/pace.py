"""The time that a tick waits for a client: a share of the interval, or virtual time stands still until it sends."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Protocol

from common.lab.laboratory import Laboratory
from common.opensees.port import ClientError
from common.plan.plan import Plan

# longest delay of a request to stop while virtual time stands still; an operator does not notice it
SLICE_S = 0.1


class Pace(Protocol):
    """The time that a tick waits for the client."""

    settles: bool  # whether the client is answered in the time after the commands of a tick
    eager: int  # ns for which its next message is looked for before the process sleeps until it comes

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """A function that returns the remaining time (s) to wait in a tick; 0 or less if it has passed."""

    def fair(self, lab: Laboratory, tick: int, since_ns: int) -> bool:
        """Whether a client that has its forces since `since_ns` has the time for an answer in this tick."""

    def over(self) -> None:
        """Called when that time has passed; raises ClientError if that ends the test at once."""


class RealTime:
    """A tick waits for the plan's share of the interval; longer silences are judged by the watchdog."""

    settles = True
    eager = 0  # with real-time priority it would keep the client from its processor

    def __init__(self, plan: Plan) -> None:
        self._share_ns = round(plan.link.wait_share * plan.test.interval * 1e9)

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """The remaining part of the plan's share of the interval, which begins at the tick's nominal time."""
        now, end = lab.clock.now, lab.tick_ns(tick) + self._share_ns
        return lambda: (end - now()) * 1e-9

    def fair(self, lab: Laboratory, tick: int, since_ns: int) -> bool:
        """Whether the client has half of the share at least; with less the tick is late, and not the client."""
        return lab.tick_ns(tick) + self._share_ns // 2 >= since_ns

    def over(self) -> None:
        """Do nothing: the laboratories hold, and the watchdog decides when to ramp."""


class AsFastAsItGoes:
    """Virtual time stands still until `who` sends or a stop is requested, at most for `seconds` of wall time."""

    settles = False
    # A client of one storey sends its next message within 50 µs, and to sleep and to be woken takes as long again. A
    # large model takes ms for a step, beside which this does not count.
    eager = 200_000 if (os.cpu_count() or 1) > 1 else 0

    def __init__(self, seconds: float, stopping: Callable[[], str], who: str = "client") -> None:
        self._seconds, self._stopping, self._who = seconds, stopping, who

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """The remaining time, in slices so that a request to stop is noticed."""
        end = time.monotonic() + self._seconds
        return lambda: 0.0 if self._stopping() else min(end - time.monotonic(), SLICE_S)

    def fair(self, lab: Laboratory, tick: int, since_ns: int) -> bool:
        """True, because time stands still."""
        return True

    def over(self) -> None:
        """End the test, because the client sends nothing."""
        if not self._stopping():
            raise ClientError(f"No displacement has come from the {self._who} for {self._seconds:g} s.")
