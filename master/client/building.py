"""The building of a client of OpenSees or OpenFresco: its elements send displacements and receive forces.

Each displacement is imposed over the plan's `intervals`, a number of control intervals. Over one interval the forces
are those of any test: the master's own are measured at the end of the interval, a slave's one interval before. Over
several intervals, if there are slaves, all laboratories are at the displacement for the last interval, so that all
forces belong to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from common.errors import InputError, InterlockError
from common.lab.laboratory import Laboratory
from common.opensees.element import Measurement, Phase, RevisedError
from common.opensees.port import ElementPort, Ports, address_of
from common.plan.plan import Plan
from common.reporting import Report, silent
from common.roles import MASTER
from common.safety.watchdog import Watchdog, WatchdogFinding
from laboratories.kind import Coupling
from loop import assembly
from master.building import Answering, BuildingStep, Outputs
from master.client.coupled import CoupledLaboratory, couplings_of
from master.client.pace import SLICE_S, Pace
from models import compensators
from models.compiled import bound

# relative difference of the client's step from the plan's that is rounding of the client's times
SCALE = 1e-6
TOLD = (
    10  # time steps of the client that are recorded; an analysis with variable steps would fill the recording
)
NOTHING = math.nan  # recorded where a tick has no value


class ClientBuilding(BuildingStep):
    """Serves the elements of a client at `addresses`: one for all laboratories, or one for each in the plan's order.

    Raises:
        InputError: an address cannot be used, or their number fits neither.
    """

    def __init__(self, plan: Plan, addresses: Sequence[str], pace: Pace, report: Report = silent) -> None:
        interval, self._intervals = plan.test.interval, plan.structure.intervals
        couplings = couplings_of(plan)
        self._labs = [CoupledLaboratory(one, interval, self._intervals) for one in couplings.values()]
        self._own = self._labs[0] if MASTER in couplings else None
        self._ramp = self._intervals - int(self._intervals > 1 and bool(plan.roles))
        self._compensator = compensator(plan)
        self._interval, self._pace = interval, pace
        self._watchdog, self._finding = Watchdog(plan.safety, interval), WatchdogFinding.FINE
        self._report = report
        self._early: list[str] = []  # warnings before the start, when the time of the test is not known
        self._lab: Laboratory | None = None
        self._partners: Sequence[Answering] = ()
        self._ports = Ports(ports(addresses, list(couplings.values()), self._say), pace.eager)
        self._moving, self._done = False, 0  # whether a displacement is under way, and its intervals so far
        self._from = self._to = (0.0,) * len(self._labs)
        self._time = self._step_time = 0.0
        self._scales: list[float] = []  # the client's time steps (s) that have been recorded
        self._steps = 0
        self._handed = (NOTHING,) * len(self._labs)
        self._handed_ns, self._wait = 0, NOTHING
        self._heard, self._late, self._lateness = -1, False, 0.0
        self._outputs = Outputs(0.0, 0.0, 0.0, 0.0, [(0.0,) * 5 for _ in plan.roles], [])
        self._over = False

    # -- before the start ------------------------------------------------------------------------------

    def join(self, lab: Laboratory, partners: Sequence[Answering]) -> None:
        """Receive the master's laboratory and the slaves."""
        self._lab, self._partners, self._report = lab, partners, lab.report

    def _say(self, text: str) -> None:
        """Report a warning; one before the start is recorded at the first tick."""
        if self._lab is not None and self._lab.start_ns:
            self._lab.note("client", text, level="warning", tick=self._lab.tick)
            return
        self._early.append(text)
        event = {"t": 0.0, "lab": MASTER, "level": "warning", "code": "client", "text": text}
        self._report("event", event)

    @property
    def awaited(self) -> str:
        """OpenSees with its address, until its first displacement has arrived."""
        return "" if self._ready() else f"OpenSees at {' and '.join(port.name for port in self._ports.ports)}"

    def look_after(self) -> None:
        """Answer clients before the first tick; in virtual time wait for them, because time stands still."""
        self._serve(0.0 if self._pace.settles or self._ready() else SLICE_S)
        while self._serve(0.0):
            pass

    # -- ticks -------------------------------------------------------------------------------------------

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """One tick: return the forces of a completed displacement, and take the next displacement."""
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
        waited = not (self._moving or self._over)
        self._late = waited and self._pace.fair(self._lab, tick, self._handed_ns)
        self._judge(tick, self._lab)
        if not self._moving:
            self._outputs = self._outputs._replace(target=self._own.target if self._own else 0.0, held=True)
            return self._outputs
        return self._move(position)

    def _judge(self, tick: int, lab: Laboratory) -> None:
        """Count a tick without a displacement; in the last that the plan allows the ramp to rest begins at once.

        The watchdog looks when the wait for the client is over, so that the ramp begins within `ramp_after` intervals
        of the forces that the client has not answered. In virtual time the pace alone ends the wait.
        """
        if self._moving:
            self._heard = tick
        may_have_come = self._lateness >= self._interval  # while this loop was held up
        if not self._pace.settles or self._heard < 0 or self._over or may_have_come:
            return
        self._finding = self._watchdog.look(tick, self._heard, self._heard)
        if self._finding is WatchdogFinding.RAMP:
            lab.silent(self.who, tick)

    def _record_early(self, lab: Laboratory) -> None:
        at = lab.unix_ns(0)
        for text in self._early:
            lab.outlet.add("event", (at, at, 0.0, lab.name, "warning", "client", text, {}))
        self._early = []

    def _hand_back(self, tick: int, position: float, force: float, forces: Sequence[float]) -> None:
        """Send every client the forces that were measured at its displacement."""
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
        """Wait for the next displacement within the time of the tick, and begin to impose it."""
        assert self._lab is not None  # noqa: S101 - `join` comes first
        left = self._pace.until(self._lab, tick)
        while not self._ready():
            if not self._serve(max(left(), 0.0)) and left() <= 0.0:
                self._pace.over()
                return
        while len(self._ports.ports) > 1 and self._serve(0.0):
            pass  # the messages of the other elements of the same step have arrived already
        if self._ended():
            self._over = True
            return
        self._impose()

    def _impose(self) -> None:
        assert self._lab is not None  # noqa: S101 - `join` comes first
        wanted: list[float] = []
        times: list[float] = []
        for server in self._ports.servers:
            if server.phase is Phase.WANTED:
                times += server.impose().time
            elif server.phase is Phase.MEASURED:
                server.rest()
            wanted += server.wanted.displacement
        self._from, self._to = self._to, tuple(wanted)
        self._moving, self._done = True, 0
        self._steps += 1
        if self._handed_ns:
            self._wait = (self._lab.clock.now() - self._handed_ns) * 1e-9
        if times:
            self._note_time(times[0])

    def _note_time(self, at: float) -> None:
        """Keep the client's time (s), and record its time step where it has it twice in succession and it is new.

        The first step may begin at any time, and some integrators repeat that time; an analysis under gravity before
        that of the earthquake has a step of its own.
        """
        before, self._step_time, self._time = self._step_time, at - self._time, at
        if self._steps < 3 or not _same(self._step_time, before) or self._step_time <= 0.0:
            return
        if len(self._scales) < TOLD and not any(_same(self._step_time, told) for told in self._scales):
            self._scales.append(self._step_time)
            self._tell_scale(self._step_time)

    def _tell_scale(self, there: float) -> None:
        """Record the client's time step `there` (s) beside that of the test."""
        assert self._lab is not None  # noqa: S101 - `join` comes first
        here = self._interval * self._intervals
        text = (
            f"A step of the client's is {1e3 * there:g} ms of its analysis, and takes {1e3 * here:g} ms here."
        )
        level = "info" if _same(there, here) else "warning"
        self._lab.note("client", text, level=level, tick=self._lab.tick, values={"scale": here / there})

    def _move(self, position: float) -> Outputs:
        """The targets and commands of all laboratories for the coming interval."""
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
            command = self._compensator(target, *rates, present, position, self._interval)
        self._outputs = Outputs(0.0, present, command, effort, told, [])
        return self._outputs

    def written(self, tick: int) -> None:
        """Answer the client's requests while the laboratories move, so that the next tick is not delayed by them."""
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
        """Whether the client has ended its analysis."""
        return self._over

    def look(self, tick: int) -> WatchdogFinding:
        """The watchdog's finding when the tick before had waited for the client; fine in virtual time."""
        return self._finding

    def recorded(self, outputs: Outputs) -> tuple[Sequence[float], Sequence[float]]:
        """The client's step and time, its displacements, the forces returned, and its waiting time and lateness."""
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

        OpenSees sends all elements their displacements before it requests forces from any of them. With several
        elements, a request for forces therefore means that all new displacements have been sent; those of the other
        elements have not changed.
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
        """Call `work(given)`; raises InterlockError if a client revises displacements."""
        try:
            return work(given)
        except RevisedError as error:
            raise InterlockError(str(error)) from None


def _same(one: float, other: float) -> bool:
    """Whether two time steps (s) differ by the rounding of times alone."""
    return abs(one - other) <= SCALE * abs(other)


def compensator(plan: Plan) -> Callable[..., float]:
    """The compensator of the master's own laboratory, as `compensators.enter`; without one it does nothing."""
    built = assembly.own_compensator(plan)
    return bound(compensators.enter, built, *compensators.STILL, plan.test.interval)


def check_count(addresses: Sequence[str], laboratories: int) -> None:
    """Raise InputError where elements are served at neither one address nor a different one for each laboratory."""
    if len(addresses) not in (1, laboratories):
        raise InputError(
            f"--opensees is given {len(addresses)} times for {laboratories} laboratories: give it once for one "
            "element with all of them, or once for each in the plan's order."
        )
    if len({address_of(text) for text in addresses}) < len(addresses):
        raise InputError("--opensees names an address twice, but each element needs a port of its own.")


def ports(
    addresses: Sequence[str], couplings: Sequence[Coupling], say: Callable[[str], None]
) -> list[ElementPort]:
    """One port for all laboratories, or one for each; raises InputError if the number fits neither or one is in use."""
    stiffness = [one.stiffness for one in couplings]
    check_count(addresses, len(stiffness))
    dealt = [stiffness] if len(addresses) == 1 else [[k] for k in stiffness]
    opened: list[ElementPort] = []
    try:
        for text, own in zip(addresses, dealt, strict=True):
            opened.append(ElementPort(text, own, say))
    except InputError:
        for port in opened:
            port.close()
        raise
    return opened
