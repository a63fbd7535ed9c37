"""Virtual time: several processes in one thread, and a scheduler of the events that they wait for.

Every process is a greenlet. Where it would block it switches to the scheduler, which takes the earliest event from
a heap of (time, order, action): the same calls give the same order on every machine. World time is in ns and no
process knows it; each process has a clock of its own, with an offset and a drift. Tests in virtual time and tests
with randomly drawn faults both use it (docs/decisions/0034-one-virtual-time.md).
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from heapq import heappop, heappush
from itertools import count
from typing import Any, NamedTuple

import greenlet

PPB = 10**9  # parts per billion in one
FOREVER = 2**62  # ns, 146 years; sums of a few of them still fit into 64 bits


# time (ns), order among events of the same time, action, its arguments
Event = tuple[int, int, Callable[..., None], tuple[Any, ...]]


class Drift(NamedTuple):
    """The difference of a process's clock from the world's: `offset` ns at time 0, growing by `ppb` ns per second."""

    offset: int = 0
    ppb: int = 0


NO_DRIFT = Drift()


class World:
    """Virtual time; it ends at `limit` (ns) even if processes have not ended."""

    def __init__(self, limit: int = FOREVER) -> None:
        self.time = 0
        self.limit = limit
        self.heap: list[Event] = []
        self.processes: dict[str, Process] = {}
        self.alive = 0  # processes that have begun and not ended
        self.next_order = count().__next__
        self._hub: greenlet.greenlet | None = None
        self._pause: Callable[[], bool] | None = None

    def at(self, time: int, action: Callable[..., None], *arguments: Any) -> None:
        """Schedule an action at a time (ns), or at the present time if that has passed."""
        time = time if time > self.time else self.time  # max() takes seven times as long
        heappush(self.heap, (time, self.next_order(), action, arguments))

    def process(self, name: str, drift: Drift = NO_DRIFT) -> Process:
        """The process of that name, created if there is none; it does not run before `Process.start`."""
        return self.processes.setdefault(name, Process(self, name, drift))

    def run(self, pause: Callable[[], bool] | None = None) -> None:
        """Let time pass until every process has ended, or to the limit; an exception of a process is kept in it.

        If `pause` returns true, time stops before the next event; the next call continues from there.
        """
        self._hub, self._pause = greenlet.getcurrent(), pause
        heap = self.heap
        with _garbage_kept():
            try:
                while heap and heap[0][0] <= self.limit and self.alive:
                    if pause is not None and pause():
                        return
                    self.time, _, action, arguments = heappop(heap)
                    action(*arguments)
            except BaseException:
                self._discard()
                raise
            self._discard()

    def _discard(self) -> None:
        """End the greenlets of all processes."""
        for process in self.processes.values():
            process.discard()

    def switch_from(self, process: Process) -> None:
        """Switch away from the greenlet of a process that waits; returns when it is its turn.

        Nearly all events are turns of processes. If the next event is one, this switches to that process directly;
        the scheduler's greenlet does all other events.
        """
        heap, limit = self.heap, self.limit
        while self._pause is None and heap[0][2] is take_turn and heap[0][0] <= limit:
            self.time, _, _, (other, token) = heappop(heap)
            if other.may_go_on(token):
                if other is not process:
                    other.go_on()
                return
        assert self._hub is not None  # noqa: S101 - only a running process comes here
        self._hub.switch()


class Process:
    """A process and its clock: `now` and `sleep_until` are those of `common.host.clock.Clock`."""

    def __init__(self, world: World, name: str, drift: Drift) -> None:
        self.world = world
        self.name = name
        self._offset, self._ppb = drift
        self.stalled_until = 0
        self.killed = False
        self.ended = False
        self.reason = ""  # to stop, empty while there is none
        self.error: Exception | None = None
        self.ahead = 0  # ns that it has computed since it last waited
        self._listening = False
        self._token = 0  # number of the latest wait; turns of earlier waits are ignored
        self._thread: greenlet.greenlet | None = None
        self.go_on: Callable[[], object]  # switches to its greenlet; given by `start`
        self._woken: list[Callable[[], None]] = []

    # -- clock ------------------------------------------------------------------------------------

    @property
    def time(self) -> int:
        """World time of the process, including the time that it has spent computing, ns."""
        return self.world.time + self.ahead

    def now(self) -> int:
        """Time on its own clock, ns."""
        time = self.world.time + self.ahead
        if not self._ppb:
            return time + self._offset
        return time + self._offset + time * self._ppb // PPB

    def local(self, time: int) -> int:
        """The time on its clock at a world time, ns."""
        return time + self._offset + time * self._ppb // PPB

    def reached(self, local: int) -> int:
        """World time at which its clock shows a time, ns."""
        time = (local - self._offset) * PPB // (PPB + self._ppb)
        while self.local(time) < local:
            time += 1
        return time

    def sleep_until(self, deadline: int) -> None:
        """Sleep until its own clock shows `deadline`, ns; returns at once if that has passed."""
        until = self.reached(deadline) if self._ppb else deadline - self._offset
        if self.ahead or until > self.world.time:
            self._wait(until)

    # -- actions of the process -------------------------------------------------------------------

    def start(self, body: Callable[[], None], at: int = 0) -> None:
        """Begin at a world time (ns); an exception of `body` is kept as `error`."""

        def guarded() -> None:
            try:
                body()
            except Exception as error:  # a fault test reports it as a finding
                self.error = error
            self._end()

        self._thread = greenlet.greenlet(guarded)
        self.go_on = self._thread.switch
        self._token += 1
        self.world.alive += 1
        self.world.at(at, take_turn, self, self._token)

    @property
    def started(self) -> bool:
        """Whether `start` was called."""
        return self._thread is not None

    def _end(self) -> None:
        self.world.alive -= not self.ended
        self.ended = True

    def spend(self, duration: int) -> None:
        """Account for `duration` ns of computation."""
        self.ahead += duration

    def listen(self, timeout: int) -> None:
        """Wait for a message, at most `timeout` ns of its own clock."""
        self._listening = True
        time = self.world.time + self.ahead
        self._wait(self.reached(self.local(time) + timeout) if self._ppb else time + timeout)
        self._listening = False

    def settle(self) -> None:
        """Let world time catch up with the time spent computing, so that messages of that time are received."""
        if self.ahead:
            self._wait(self.time)

    def _wait(self, until: int) -> None:
        world, heap = self.world, self.world.heap
        if self.ahead:
            until, self.ahead = max(until, world.time + self.ahead), 0
        if until <= world.limit and (not heap or heap[0][0] > until):
            world.time = until  # there is no earlier event, so that no switch is necessary
            return
        token = self._token = self._token + 1
        heappush(heap, (until, world.next_order(), take_turn, (self, token)))  # as `at` does
        world.switch_from(self)

    def wake(self) -> None:
        """Continue at the present time, after the events that are due earlier; called when a message arrives."""
        if self._listening:
            self._listening = False
            self.world.at(self.world.time, take_turn, self, self._token)

    def may_go_on(self, token: int) -> bool:
        """Whether the wait with this number ends now; if so it is ended. That of a stalled process ends later."""
        if token != self._token or self.ended:
            return False
        if self.world.time < self.stalled_until:
            self.world.at(self.stalled_until, take_turn, self, token)
            return False
        self._token += 1
        return True

    # -- actions on the process -------------------------------------------------------------------

    @property
    def stalled(self) -> bool:
        """Whether it is stalled, and the threads of its link with it."""
        return self.world.time < self.stalled_until

    def stall(self, duration: int) -> None:
        """Do not let it run for `duration` ns from now on: its work is late, and arriving messages queue up."""
        self.stalled_until = max(self.stalled_until, self.world.time + duration)
        self.world.at(self.stalled_until, self._continue)

    def when_woken(self, action: Callable[[], None]) -> None:
        """Call `action` whenever a stall ends, before the process runs itself."""
        self._woken.append(action)

    def _continue(self) -> None:
        if not self.stalled and not self.ended:
            for action in self._woken:
                action()

    def kill(self) -> None:
        """End it immediately, as SIGKILL does."""
        self.killed = not self.ended
        self._end()

    def stop(self, reason: str) -> None:
        """Ask it to stop."""
        self.reason = reason

    def stopping(self) -> str:
        """The reason to stop, empty while there is none."""
        return self.reason

    def discard(self) -> None:
        """End its greenlet; called when the world has ended."""
        if self._thread is not None and not self._thread.dead:
            self._thread.throw(greenlet.GreenletExit)


def take_turn(process: Process, token: int) -> None:
    """Let a process continue if its wait with this number ends now."""
    if process.may_go_on(token):
        process.go_on()


@contextmanager
def _garbage_kept() -> Iterator[None]:
    """Restore the garbage collector at the end: the loops, which share this interpreter, change its settings."""
    enabled, interval = gc.isenabled(), sys.getswitchinterval()
    gc.freeze()  # so that the collections of the loops have few objects to visit
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(interval)
        if enabled:
            gc.enable()
