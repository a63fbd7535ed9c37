"""The building as a client of OpenSees or OpenFresco has it: displacements come from its elements, forces go back.

Each displacement is imposed over the plan's `intervals` of control. Over one interval the forces go back as those of a
slave do in any test: the master's own as measured at the interval's end, a slave's as measured one interval before.
Over several intervals the laboratories are at the displacement for the last of them where there are slaves, so that all
forces belong to it.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from common.errors import InputError, InterlockError
from common.lab.laboratory import Laboratory
from common.opensees.element import Measurement, Phase, RevisedError
from common.opensees.port import ClientError, Port, Ports
from common.plan.plan import Plan
from common.reporting import Report, silent
from common.roles import MASTER
from common.safety.watchdog import Watchdog, WatchdogFinding
from laboratories import kinds
from laboratories.kind import Coupling, Follows
from loop import substructure
from master.building import Answering, Building, Outputs
from models import compensators, force_correction
from models.compiled import plain

SLICE_S = 0.1  # a wish to stop waits no longer than this while virtual time stands still
SCALE = 1e-6  # relative: a client's step beside what it takes here, which rounding of its times may change
NOTHING = math.nan


class Pace(Protocol):
    """How long a tick waits for the client."""

    settles: bool  # whether the time behind a tick's commands is used to answer the client

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """Gives again and again how many seconds are left of a tick's patience; 0 or less: none."""

    def over(self) -> None:
        """The patience is over; raises ClientError where that ends the test at once."""


class RealTime:
    """A tick waits for its share of the interval; beyond it the watchdog counts."""

    settles = True

    def __init__(self, plan: Plan) -> None:
        self._share_ns = round(plan.link.wait_share * plan.test.interval * 1e9)

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """The share of the interval from the tick's nominal time on."""
        now, end = lab.clock.now, lab.tick_ns(tick) + self._share_ns
        return lambda: (end - now()) * 1e-9

    def over(self) -> None:
        """The laboratories hold, and the watchdog says when to ramp."""


class AsFastAsItGoes:
    """Time stands still until the client has spoken, for `seconds` of the wall clock, or somebody wants to stop."""

    settles = False

    def __init__(self, seconds: float, stopping: Callable[[], str]) -> None:
        self._seconds, self._stopping = seconds, stopping

    def until(self, lab: Laboratory, tick: int) -> Callable[[], float]:
        """Slices of the patience, so that a wish to stop is noticed."""
        end = time.monotonic() + self._seconds
        return lambda: 0.0 if self._stopping() else min(end - time.monotonic(), SLICE_S)

    def over(self) -> None:
        """The client has stalled."""
        if not self._stopping():
            raise ClientError(f"No displacement has come from the client for {self._seconds:g} s.")


class Follower:
    """One laboratory behind an element: what it is told of the element's displacement, and what its force is there."""

    def __init__(self, coupling: Coupling, interval: float, intervals: int) -> None:
        self.coupling = coupling
        self.sign = 1.0 if coupling.follows is Follows.DRIFT else -1.0  # OpenSees takes forces that resist
        self.target = 0.0
        self._interval, self._intervals = interval, intervals
        self._past: deque[float] = deque(
            [0.0] * 3, maxlen=3
        )  # targets before the present one, the newest first
        chosen = coupling.correction
        self._filter = force_correction.coefficients(chosen, interval)
        self._filtered = np.zeros(force_correction.CORRECTED + 1)
        self._delayed: float | None = 0.0 if chosen.unit_delay else None

    def follow(self, displacement: float) -> tuple[float, float, float, float, float]:
        """The target (m) for the interval's end, the motor's force (N), and the target's rates.

        Over one interval the rates are differences of second order backwards from the end; over several the way is a
        ramp, whose speed alone is told.
        """
        target, h = self.coupling.ratio * displacement, self._interval
        x1, x2, x3 = self._past
        velocity, acceleration, jerk = (target - self.target) / h, 0.0, 0.0
        if self._intervals == 1:
            x0, x1, x2, x3 = target, self.target, x1, x2
            velocity = (3.0 * x0 - 4.0 * x1 + x2) / (2.0 * h)
            acceleration = (2.0 * x0 - 5.0 * x1 + 4.0 * x2 - x3) / h**2
            jerk = (x0 - 3.0 * x1 + 3.0 * x2 - x3) / h**3
        self._past.appendleft(self.target)
        self.target = target
        effort = self.coupling.effort * velocity / self.coupling.ratio
        return target, effort, velocity, acceleration, jerk

    def resists(self, force: float) -> float:
        """The element's resisting force (N) of a force measured in the laboratory (N), corrected as the plan says."""
        corrected: float = force_correction.step(*self._filter, self._filtered, force)
        if self._delayed is not None:
            corrected, self._delayed = self._delayed, corrected
        return self.sign * self.coupling.scale * corrected


class ClientBuilding(Building):
    """Serves the elements of a client at `addresses`: one for all laboratories, or one for each in the plan's order.

    Raises:
        InputError: an address cannot be used, or their number fits neither.
    """

    def __init__(self, plan: Plan, addresses: Sequence[str], pace: Pace, report: Report = silent) -> None:
        interval, self._intervals = plan.test.interval, plan.structure.intervals
        couplings = couplings_of(plan)
        self._labs = [Follower(one, interval, self._intervals) for one in couplings.values()]
        self._own = self._labs[0] if MASTER in couplings else None
        self._ramp = self._intervals - int(self._intervals > 1 and bool(plan.roles))
        self._compensator = compensator(plan)
        self._interval, self._pace = interval, pace
        self._watchdog = Watchdog(plan.safety, interval)
        self._report = report
        self._early: list[str] = []  # what was said before the start, from which on times are known
        self._lab: Laboratory | None = None
        self._partners: Sequence[Answering] = ()
        self._ports = Ports(ports(addresses, list(couplings.values()), self._say))
        self._moving, self._done = False, 0  # whether a displacement is under way, and its intervals so far
        self._from = self._to = (0.0,) * len(self._labs)
        self._time = self._step_time = 0.0
        self._steps = 0
        self._handed = (NOTHING,) * len(self._labs)
        self._handed_ns, self._wait = 0, NOTHING
        self._heard, self._late, self._lateness = -1, False, 0.0
        self._outputs = Outputs(0.0, 0.0, 0.0, 0.0, [(0.0,) * 5 for _ in plan.roles], [])
        self._over = False

    # -- before the start ------------------------------------------------------------------------------

    def join(self, lab: Laboratory, partners: Sequence[Answering]) -> None:
        """Know the master's clock and the slaves."""
        self._lab, self._partners, self._report = lab, partners, lab.report

    def _say(self, text: str) -> None:
        """Warn; what is said before the start is recorded as it begins."""
        if self._lab is not None and self._lab.start_ns:
            self._lab.note("client", text, level="warning", tick=self._lab.tick)
            return
        self._early.append(text)
        event = {"t": 0.0, "lab": MASTER, "level": "warning", "code": "client", "text": text}
        self._report("event", event)

    @property
    def awaited(self) -> str:
        """OpenSees, until its first displacement has come."""
        return "" if self._ready() else f"OpenSees at {' and '.join(port.name for port in self._ports.ports)}"

    def look_after(self) -> None:
        """Answer those who ask before anything moves, where time stands still after a wait for them."""
        self._serve(0.0 if self._pace.settles or self._ready() else SLICE_S)
        while self._serve(0.0):
            pass

    # -- ticks -------------------------------------------------------------------------------------------

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """One tick: hand back what belongs to the displacement before, and take the next."""
        assert self._lab is not None  # noqa: S101 - `join` comes first
        if self._early:
            self._record_early(self._lab)
        now = self._lab.clock.now()
        self._lateness = (now - self._lab.tick_ns(tick)) * 1e-9
        self._handed, self._wait = (NOTHING,) * len(self._labs), NOTHING
        if self._moving:
            self._done += 1
            if self._done >= self._intervals:
                self._hand_back(tick, position, force, forces)
        if not self._moving:
            self._fetch(tick)
        self._late = not (self._moving or self._over)
        if not self._moving:
            self._outputs = self._outputs._replace(target=self._own.target if self._own else 0.0, held=True)
            return self._outputs
        self._heard = tick
        return self._move(position)

    def _record_early(self, lab: Laboratory) -> None:
        at = lab.unix_ns(0)
        for text in self._early:
            lab.outlet.add("event", at, at, (0.0, lab.name, "warning", "client", text, {}))
        self._early = []

    def _hand_back(self, tick: int, position: float, force: float, forces: Sequence[float]) -> None:
        """Give every client the forces that were measured at its displacement."""
        assert self._lab is not None  # noqa: S101 - `join` comes first
        given, moved = list(forces), [one.used.measured[one.position] for one in self._partners]
        if self._own:
            given, moved = [force, *given], [position, *moved]
        self._handed = tuple(lab.resists(one) for lab, one in zip(self._labs, given, strict=True))
        places = [x / lab.coupling.ratio for lab, x in zip(self._labs, moved, strict=True)]
        self._moving, first = False, 0
        self._handed_ns = self._lab.clock.now()
        for port in self._ports.ports:
            last = first + port.dofs
            if port.server.phase is Phase.MOVING:
                found = Measurement(
                    tuple(places[first:last]), self._handed[first:last], tick * self._interval
                )
                self._guarded(port.measured, found)
            first = last

    def _fetch(self, tick: int) -> None:
        """The next displacement, where it comes in the tick's time."""
        assert self._lab is not None  # noqa: S101 - `join` comes first
        left = self._pace.until(self._lab, tick)
        while not self._ready():
            if not self._serve(max(left(), 0.0)) and left() <= 0.0:
                self._pace.over()
                return
        while len(self._ports.ports) > 1 and self._serve(0.0):
            pass  # what other elements have said of the same step is there already
        if self._ended():
            self._over = True
            return
        self._impose()

    def _impose(self) -> None:
        assert self._lab is not None  # noqa: S101 - `join` comes first
        wanted: list[float] = []
        for server in self._ports.servers:
            if server.phase is Phase.WANTED:
                at = server.impose().time
                self._step_time, self._time = (at[0] - self._time, at[0]) if at else (0.0, 0.0)
            wanted += server.wanted.displacement
        self._from, self._to = self._to, tuple(wanted)
        self._moving, self._done = True, 0
        self._steps += 1
        if self._handed_ns:
            self._wait = (self._lab.clock.now() - self._handed_ns) * 1e-9
        if self._steps == 3:  # the first step may begin anywhere, and some integrators repeat its time
            self._tell_scale()

    def _tell_scale(self) -> None:
        """Say how the client's time passes here, where it is known."""
        assert self._lab is not None  # noqa: S101 - `join` comes first
        here, there = self._interval * self._intervals, self._step_time
        if there > 0.0:
            same = abs(there - here) <= SCALE * here
            text = f"A step of the client's is {1e3 * there:g} ms of its analysis, and takes {1e3 * here:g} ms here."
            level = "info" if same else "warning"
            self._lab.note("client", text, level=level, tick=self._lab.tick, values={"scale": here / there})

    def _move(self, position: float) -> Outputs:
        """What every laboratory is told for the coming interval."""
        share = (self._done + 1) / self._ramp
        here = (
            self._to
            if share >= 1.0
            else [a + (b - a) * share for a, b in zip(self._from, self._to, strict=True)]
        )
        present = self._own.target if self._own else 0.0
        told = [lab.follow(x) for lab, x in zip(self._labs, here, strict=True)]
        command = effort = 0.0
        if self._own:
            target, effort, velocity, acceleration, jerk = told.pop(0)
            rates = (velocity, acceleration, jerk)
            command = compensators.enter(self._compensator, target, *rates, present, position, self._interval)
        self._outputs = Outputs(0.0, present, command, effort, told, [])
        return self._outputs

    def written(self, tick: int) -> None:
        """Answer what the client asks while the laboratories move, so that nothing is left to say at the next tick."""
        if not (self._pace.settles and self._lab):
            return
        left = self._pace.until(self._lab, tick)
        while not any(server.full or server.ending for server in self._ports.servers):
            seconds = left()
            if seconds <= 0.0:
                return
            self._serve(seconds)

    @property
    def over(self) -> bool:
        """Whether the client has said that its analysis is over."""
        return self._over

    def look(self, tick: int) -> WatchdogFinding:
        """The watchdog's finding on the client, whose displacements come in every tick that waits for one."""
        if not self._pace.settles or self._heard < 0:
            return WatchdogFinding.FINE
        return self._watchdog.look(tick - 1, self._heard, self._heard)

    def recorded(self, outputs: Outputs) -> tuple[Sequence[float], Sequence[float]]:
        """The client's step, its displacements, the forces handed back, and how it kept time."""
        return (
            self._steps,
            self._time,
            *self._to,
            *self._handed,
            self._wait,
            self._late,
            self._lateness,
        ), ()

    def leave(self) -> None:
        """Close the connections and the ports."""
        self._ports.close()

    # -- clients -------------------------------------------------------------------------------------------

    def _ready(self) -> bool:
        """Whether the next displacements of all elements are known, or no more will come.

        OpenSees tells all elements their displacements before it asks any of them for forces. So where there are
        several, an element that asks has been told, and so have those whose displacement stays.
        """
        servers = self._ports.servers
        if len(servers) == 1:
            return servers[0].phase in (Phase.WANTED, Phase.ENDED)
        wanted = [server for server in servers if server.phase is Phase.WANTED]
        return self._ended() or (
            bool(wanted)
            and all(server.header for server in servers)
            and (len(wanted) == len(servers) or any(server.waits for server in wanted))
        )

    def _ended(self) -> bool:
        return all(server.phase is Phase.ENDED for server in self._ports.servers)

    def _serve(self, seconds: float) -> bool:
        return bool(self._guarded(self._ports.serve, seconds))

    @staticmethod
    def _guarded(work: Callable[[Any], Any], given: Any) -> Any:
        """Do something with clients; one that revises displacements ends the test."""
        try:
            return work(given)
        except RevisedError as error:
            raise InterlockError(str(error)) from None


def couplings_of(plan: Plan) -> dict[str, Coupling]:
    """The coupling of every laboratory by role, in the order of an element's degrees of freedom."""
    return {role: kind.coupling(plan.of(role)) for role, kind in kinds.kinds_of(plan).items()}


def compensator(plan: Plan) -> Any:
    """The compensator of the master's own laboratory as `compensators.enter` takes it; without one it does nothing."""
    return plain(substructure.own_compensator(plan))


def ports(addresses: Sequence[str], couplings: Sequence[Coupling], say: Callable[[str], None]) -> list[Port]:
    """A port for all laboratories, or one for each."""
    stiffness = [one.stiffness for one in couplings]
    if len(addresses) not in (1, len(stiffness)):
        raise InputError(
            f"--opensees is given {len(addresses)} times for {len(stiffness)} laboratories: give it once for one "
            "element with all of them, or once for each in the plan's order."
        )
    dealt = [stiffness] if len(addresses) == 1 else [[k] for k in stiffness]
    opened: list[Port] = []
    try:
        for text, own in zip(addresses, dealt, strict=True):
            opened.append(Port(text, own, say))
    except InputError:
        for port in opened:
            port.close()
        raise
    return opened
