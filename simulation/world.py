"""Virtual time: many processes in one thread, and a scheduler of the events that they wait for.

Every process is a greenlet. Where it would block it hands over to the scheduler, which takes the earliest event from
a heap of (time, order, action): the same calls give the same order, whatever the machine does. World time is in ns
and is known to no process; each process has a clock of its own, offset and drifting. Tests in virtual time and tests
with drawn faults both run on it (docs/decisions/0034-one-virtual-time.md).
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

PPB = 10**9
FOREVER = 2**62


Event = tuple[
    int, int, Callable[..., None], tuple[Any, ...]
]  # time, who is first of the same time, what happens


class Drift(NamedTuple):
    """How a process's clock differs from the world's: at time 0 by `offset` ns, then faster by `ppb` ns per second."""

    offset: int = 0
    ppb: int = 0


NO_DRIFT = Drift()


class World:
    """Virtual time; `limit` (ns) is where it ends whatever still goes on."""

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
        """Let something happen at a time, or now where that has passed."""
        time = time if time > self.time else self.time  # max() takes seven times as long
        heappush(self.heap, (time, self.next_order(), action, arguments))

    def process(self, name: str, drift: Drift = NO_DRIFT) -> Process:
        """A process of this world that does not run yet."""
        return self.processes.setdefault(name, Process(self, name, drift))

    def run(self, pause: Callable[[], bool] | None = None) -> None:
        """Let time pass until every process has ended, or to the limit; what a process raises is kept in it.

        Where `pause` becomes true time stops before the next event, and may be let pass on by another call.
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
        """Leave nothing of any process behind."""
        for process in self.processes.values():
            process.discard()

    def hand_over(self, process: Process) -> None:
        """Leave the greenlet of a process that waits, until it is its turn.

        Nearly all events are turns. The next process takes its own from here, without the scheduler's greenlet between
        them, which does whatever else happens.
        """
        heap = self.heap
        while self._pause is None and heap[0][2] is take_turn and heap[0][0] <= self.limit:
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
        self.reason = ""  # why somebody wants it to stop
        self.error: Exception | None = None
        self.ahead = 0  # ns that it has computed since it last waited
        self._listening = False
        self._token = 0  # of the newest wait: earlier ones are over
        self._thread: greenlet.greenlet | None = None
        self._woken: list[Callable[[], None]] = []

    # -- the clock --------------------------------------------------------------------------------

    @property
    def time(self) -> int:
        """World time of what it does now, what it has computed included, ns."""
        return self.world.time + self.ahead

    def now(self) -> int:
        """Time on its own clock, ns."""
        time = self.world.time + self.ahead
        if not self._ppb:
            return time + self._offset
        return time + self._offset + time * self._ppb // PPB

    def local(self, time: int) -> int:
        """What its clock shows at a world time, ns."""
        return time + self._offset + time * self._ppb // PPB

    def reached(self, local: int) -> int:
        """World time at which its clock shows a time, ns."""
        if not self._ppb:
            return local - self._offset
        time = (local - self._offset) * PPB // (PPB + self._ppb)
        while self.local(time) < local:
            time += 1
        return time

    def sleep_until(self, deadline: int) -> None:
        """Sleep until its own clock shows `deadline`, ns; one that has passed returns at once."""
        until = self.reached(deadline)
        if self.ahead or until > self.world.time:
            self._wait(until)

    # -- what it does -----------------------------------------------------------------------------

    def start(self, body: Callable[[], None], at: int = 0) -> None:
        """Begin at a world time; an exception that leaves `body` is kept as `error`."""

        def guarded() -> None:
            try:
                body()
            except Exception as error:  # whatever the loops let through is a finding of the run
                self.error = error
            self._end()

        self._thread = greenlet.greenlet(guarded)
        self._token += 1
        self.world.alive += 1
        self.world.at(at, take_turn, self, self._token)

    @property
    def started(self) -> bool:
        """Whether it has begun or will begin."""
        return self._thread is not None

    def _end(self) -> None:
        self.world.alive -= not self.ended
        self.ended = True

    def spend(self, duration: int) -> None:
        """Compute for some ns."""
        self.ahead += duration

    def listen(self, timeout: int) -> None:
        """Wait for a message for at most `timeout` ns of its own clock."""
        self._listening = True
        time = self.world.time + self.ahead
        self._wait(self.reached(self.local(time) + timeout) if self._ppb else time + timeout)
        self._listening = False

    def settle(self) -> None:
        """Let world time catch up with the time it has spent computing, so that what came meanwhile is received."""
        if self.ahead:
            self._wait(self.time)

    def _wait(self, until: int) -> None:
        world, heap = self.world, self.world.heap
        if self.ahead:
            until, self.ahead = max(until, world.time + self.ahead), 0
        if until <= world.limit and (not heap or heap[0][0] > until):
            world.time = until  # nothing happens before: to switch would change nothing
            return
        self._token += 1
        heappush(heap, (until, world.next_order(), take_turn, (self, self._token)))  # as `at` does
        world.hand_over(self)

    def wake(self) -> None:
        """A message has come for it: it goes on at this time, after what is due before."""
        if self._listening:
            self._listening = False
            self.world.at(self.world.time, take_turn, self, self._token)

    def may_go_on(self, token: int) -> bool:
        """Whether the wait of this token is over now, and takes note of it; one that stands still goes on later."""
        if token != self._token or self.ended:
            return False
        if self.world.time < self.stalled_until:
            self.world.at(self.stalled_until, take_turn, self, token)
            return False
        self._token += 1
        return True

    def go_on(self) -> None:
        """Change to its greenlet."""
        assert self._thread is not None  # noqa: S101 - it was started
        self._thread.switch()

    # -- what happens to it -----------------------------------------------------------------------

    @property
    def stalled(self) -> bool:
        """Whether it stands still, its link's threads with it."""
        return self.world.time < self.stalled_until

    def stall(self, duration: int) -> None:
        """It does not run for some ns from now on: what should have run is late, what comes queues up."""
        self.stalled_until = max(self.stalled_until, self.world.time + duration)
        self.world.at(self.stalled_until, self._continue)

    def when_woken(self, action: Callable[[], None]) -> None:
        """Call something whenever it goes on after a stall, before it runs itself."""
        self._woken.append(action)

    def _continue(self) -> None:
        if not self.stalled and not self.ended:
            for action in self._woken:
                action()

    def kill(self) -> None:
        """End it at once, as SIGKILL would."""
        self.killed = not self.ended
        self._end()

    def stop(self, reason: str) -> None:
        """Ask it to stop."""
        self.reason = reason

    def stopping(self) -> str:
        """The reason to stop, empty while there is none."""
        return self.reason

    def discard(self) -> None:
        """Leave nothing of its greenlet behind; the world is over."""
        if self._thread is not None and not self._thread.dead:
            self._thread.throw(greenlet.GreenletExit)


def take_turn(process: Process, token: int) -> None:
    """Let a process go on where its wait of this token is over."""
    if process.may_go_on(token):
        process.go_on()


@contextmanager
def _garbage_kept() -> Iterator[None]:
    """Undo at the end that the loops freeze the garbage collector, because all of them share this interpreter."""
    enabled, interval = gc.isenabled(), sys.getswitchinterval()
    gc.freeze()  # so that the loops' own collections find little to look at
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(interval)
        if enabled:
            gc.enable()
