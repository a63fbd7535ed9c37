"""A simulated, recorded test with faults at chosen ticks, and what must hold after every one of them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from common.link.transport import TICK
from common.plan import read as plans
from common.plan.plan import Plan
from common.protocol import codec
from common.protocol.messages import Message
from common.reality.reality import Reality, as_planned
from common.recording.reader import read
from common.recording.run import Run
from common.roles import MASTER, SLAVE
from tests.faults.rows import motion_after, motion_bound
from validation.faults.apply import plan_of
from validation.faults.invariants import judge, last_valid, seen
from validation.faults.lab import SESSION, Simulation, Surrounding
from validation.faults.rigs import COMPUTED
from validation.faults.schedule import Schedule
from validation.faults.wire import DROPS, INSIDER, Conditions, Letter, WireRoute

AT = 860  # the tick of a fault: the building moves, and so do all commands
DURATION = 2.4  # s of a test
MARGIN = 200_000  # ns before a tick's nominal time: what is laid then befalls the tick's own messages first
LOST = Conditions(state=DROPS)
BETWEEN = {SLAVE: (MASTER, SLAVE), MASTER: (SLAVE, MASTER)}  # by who hears: from whom, to whom


class Scene:
    """A test before it is played; faults are scheduled at its ticks."""

    def __init__(
        self,
        path: Path,
        duration: float = DURATION,
        *,
        recorded: bool = True,
        reality: Callable[[Plan], Reality] = as_planned,
        surrounding: Surrounding | None = None,
        tables: Mapping[str, Mapping[str, object]] | None = None,
    ) -> None:
        planned = plan_of(Schedule(1, duration, recorded=recorded)).tables()
        for name, values in (tables or {}).items():
            planned[name] |= values
        self.plan = plans.from_tables(planned, Path())
        self.path = path / "test.mcap"
        base = surrounding or Surrounding(seed=1)
        recording = self.path if recorded else None
        self.simulation = Simulation(self.plan, reality(self.plan), base._replace(recording=recording))
        self._laid: list[tuple[float, Callable[..., None], tuple[Any, ...]]] = []
        self.simulation.world.at(0, self._look)

    def at(self, tick: float, action: Callable[..., None], *arguments: Any) -> None:
        """Schedule an action a little before a tick."""
        self._laid.append((tick, action, arguments))

    def _look(self) -> None:
        world, master = self.simulation.world, self.simulation.loops[MASTER].lab
        if master.start_ns:
            for tick, action, arguments in self._laid:
                world.at(self.time(tick) - MARGIN, action, *arguments)
        elif not self.simulation.world.processes[MASTER].ended:
            world.at(world.time + 10_000_000, self._look)

    def time(self, tick: float) -> int:
        """World time of a tick, ns."""
        lab = self.simulation.loops[MASTER].lab
        process = self.simulation.world.processes[MASTER]
        return process.reached(lab.start_ns) + round(tick * lab.interval_ns)

    def route(self, hearer: str, channel: str = TICK) -> WireRoute:
        """The route to a laboratory from the other one."""
        there = self.simulation.wire.between(*BETWEEN[hearer])
        return next(one for one in there if one.route.channel == channel)

    def impair(
        self, tick: float, ticks: float, conditions: Conditions, *hearers: str, channel: str = TICK
    ) -> None:
        """Set link conditions on the routes to some laboratories (both where none is named) for some ticks."""
        for hearer in hearers or (SLAVE, MASTER):
            route = self.route(hearer, channel)
            self.at(tick, route.lay, (tick, conditions), conditions)
            self.at(tick + ticks, route.lift, (tick, conditions))

    def put(self, tick: float, hearer: str, letters: list[Letter], channel: str = TICK) -> None:
        """A stranger puts frames onto a route; accounts of one who has the keys are not held against the wire's."""
        if any(letter.origin == INSIDER for letter in letters):
            self.simulation.strangers.add(hearer)
        self.at(tick, self.route(hearer, channel).put, letters)

    def change(
        self, hearer: str, changed: Callable[[Any], Message | bytes | None], channel: str = TICK
    ) -> None:
        """Replace messages on their way to a laboratory by others, or by what is no message, under the right check."""
        sender, route = BETWEEN[hearer][0], self.route(hearer, channel)
        out = self.simulation.ports[sender].out
        for key, ways in out.items():
            out[key] = [
                cast("WireRoute", Relay(route, changed, self.plan)) if way is route else way for way in ways
            ]

    def play(self) -> Course:
        """Run the test; what must hold whatever went wrong is asserted."""
        self.simulation.run()
        assert judge(self.simulation) == []
        run = read(self.path)
        assert run.finished
        assert run.damage == ""
        return Course(self, self.simulation, run)


class Relay:
    """Stands on a route and may replace the frames that pass."""

    def __init__(
        self, route: WireRoute, changed: Callable[[Any], Message | bytes | None], plan: Plan
    ) -> None:
        self._route, self._changed = route, changed
        self._keys = [codec.session_key(session, plan.digest()) for session in (SESSION, 0)]

    def send(self, letter: Letter, time: int) -> None:
        """Take a frame."""
        key = next(
            one for one in self._keys if signed(letter.frame[: -codec.CHECK_SIZE], one) == letter.frame
        )
        other = self._changed(codec.decode(letter.frame, key))
        match other:
            case None:
                self._route.send(letter, time)
            case bytes():
                self._route.send(letter._replace(frame=signed(other, key), intact=False), time)
            case _:
                self._route.send(letter._replace(frame=codec.encode(other, key), intact=whole(other)), time)


def whole(message: Message) -> bool:
    """Whether the codec accepts a message."""
    return all(math.isfinite(value) for value in message if isinstance(value, float))


def signed(payload: bytes, key: codec.Key) -> bytes:
    """A payload with its check."""
    return payload + codec._check(key, payload)


class Account(NamedTuple):
    """How many messages of one direction were used, rejected or lost; the wire's counts and the receiver's."""

    sent: int
    used: int
    rejected: int
    lost: int  # by the wire
    damaged: int  # on the wire, and rejected by the codec
    late: int  # came after the receiver had closed its account
    turned_away: dict[str, int]

    def __str__(self) -> str:
        parts = [
            f"{self.sent} sent = {self.used} used + {self.rejected} rejected + {self.lost} lost"
            + (f" + {self.damaged} damaged" if self.damaged else "")
            + (f" + {self.late} after the end" if self.late else "")
        ]
        return ", ".join(
            parts + [f"{count} turned away as {reason}" for reason, count in self.turned_away.items()]
        )


class Stop(NamedTuple):
    """How both laboratories came to rest: times (s) after the last valid message, and motions (m)."""

    seconds: float  # to RAMPING, the later of both
    rest: float  # to SAFE, the later of both
    motion: float  # the larger of both


class Course:
    """A test that was played, and its recording."""

    def __init__(self, scene: Scene, simulation: Simulation, run: Run) -> None:
        self.scene, self.simulation, self.run, self.plan = scene, simulation, run, scene.plan

    # -- modes and events -------------------------------------------------------------------------

    def modes(self, role: str) -> list[str]:
        """The modes after the first tick, from the recording."""
        events = [one for one in self.run.events if one["code"] == "mode" and one["lab"] == role]
        return [one["text"].split(" → ")[1].partition(" ")[0] for one in events]

    def count(self, role: str, mode: str) -> int:
        """How often a laboratory went into a mode."""
        return self.modes(role).count(mode)

    def event(self, role: str, code: str) -> dict[str, Any]:
        """The newest event of a code in the recording."""
        found: dict[str, Any] = [one for one in self.run.events if (one["lab"], one["code"]) == (role, code)][
            -1
        ]
        return found

    def code(self, role: str) -> str:
        """Why a laboratory stopped, as the recording has it; empty for an orderly end."""
        errors = [one["code"] for one in self.run.events if one["lab"] == role and one["level"] == "error"]
        return str(errors[0]) if errors else ""

    def seconds_to(self, role: str, mode: str, since: int) -> float:
        """Time from a moment (world time, ns) to the first turn into a mode after it."""
        times = [
            one.time
            for one in self.simulation.events[role]
            if one.data["code"] == "mode" and f"→ {mode}" in one.data["text"] and one.time >= since
        ]
        return (times[0] - since) * 1e-9

    def calm(self, *, holding: bool = False) -> None:
        """Both laboratories ran to the planned end, without a hold unless that is allowed."""
        for role in (MASTER, SLAVE):
            assert self.code(role) == ""
            allowed = {"running", "holding", "ramping", "idle"} if holding else {"running", "ramping", "idle"}
            assert set(self.modes(role)) <= allowed
            assert self.simulation.loops[role].ticks == self.plan.ticks

    def stopped(self, tick: int | None = None, *, within: int = 0, codes: set[str] | None = None) -> Stop:
        """Both came to SAFE after their last valid message, that of the tick before or the wire's own account of it.

        `within` are intervals to RAMPING, the watchdog's and one more where none are given; what every row with a
        trip must show is asserted.
        """
        plan, step = self.plan, self.plan.test.interval
        longest = (within or plan.safety.ramp_after + 1) * step
        stops = []
        for role in (MASTER, SLAVE):
            since = self.since(role) if tick is None else self.scene.time(tick - 1)
            last = round((since - self.scene.time(0)) * 1e-9 // step)
            assert self.modes(role)[-2:] == ["ramping", "safe"], (role, self.modes(role))
            assert codes is None or self.code(role) in codes, self.code(role)
            motion, recorded = self.motion(role, last), motion_after(self.run, role, last)
            assert abs(motion - recorded) < 1e-12
            assert motion <= motion_bound(plan, role)
            stops.append(
                Stop(self.seconds_to(role, "ramping", since), self.seconds_to(role, "safe", since), motion)
            )
            assert stops[-1].seconds <= longest, (role, stops)
            assert role == MASTER or self.released(since) <= plan.safety.release + longest + step
        return Stop(*map(max, *stops))

    def since(self, role: str) -> int:
        """World time of the last valid message to a laboratory by the wire's ledger, ns."""
        return last_valid(self.simulation, role, seen(self.simulation, role))

    # -- motion -----------------------------------------------------------------------------------

    def commands(self, role: str) -> tuple[Any, Any]:
        """World times (ns) of what the rig was told, and its displacement commands (m)."""
        told = seen(self.simulation, role)
        return told.times, told.commands[:, 0]

    def motion(self, role: str, tick: int, ticks: int | None = None) -> float:
        """How far the rig was moved after a tick, over some ticks or to the end, by its own log, m."""
        times, commands = self.commands(role)
        first = int(np.searchsorted(times, self.scene.time(tick + 1) - MARGIN)) - 1
        end = None if ticks is None else first + ticks + 1
        return float(np.max(np.abs(commands[first:end] - commands[first]), initial=0.0))

    def released(self, since: int) -> float:
        """Time after a moment until the damper's force is zero and stays so, s."""
        told = seen(self.simulation, SLAVE)
        assert told.commands[-1, 1] == 0.0
        last = int(np.flatnonzero(told.commands[:, 1])[-1])
        return float(told.times[min(last + 1, told.times.size - 1)] - since) * 1e-9

    # -- accounts ---------------------------------------------------------------------------------

    def account(self, hearer: str) -> Account:
        """The account of what a laboratory was sent; sent = used + rejected + lost by number, or it fails."""
        route = self.scene.route(hearer)
        ledger, numbers = route.ledger, route.ledger.numbers
        prefix = "slave.feedbacks" if hearer == MASTER else "commands"
        closing = next(one.time for one in self.simulation.events[hearer] if one.data["code"] == "exchange")
        values = self.event(hearer, "exchange")["values"]
        sender = self.event(BETWEEN[hearer][0], "exchange")["values"]
        name = "feedbacks_sent" if hearer == MASTER else "slave.commands_sent"
        came: dict[int, int] = {}
        for time, number, _, origin, intact in ledger.arrivals:
            if intact and origin != "injected":
                came.setdefault(number, time)
        sent, used, rejected = len(numbers["sent"]), values[f"{prefix}.used"], values[f"{prefix}.rejected"]
        early = sum(time < closing - COMPUTED - MARGIN for time in came.values())
        known = sum(time <= closing for time in came.values())
        assert sender[name] == sent == len(set(numbers["sent"]))
        assert early <= used + rejected <= known
        lost, damaged = (
            set(numbers["lost"]) - set(came),
            set(numbers["sent"]) - set(numbers["lost"]) - set(came),
        )
        turned = Counter(
            {
                key.rpartition(".")[2]: int(value)
                for key, value in values.items()
                if key.startswith(f"{prefix}.turned_away")
            }
        )
        late = len(came) - int(used + rejected)
        found = Account(sent, int(used), int(rejected), len(lost), len(damaged), late, dict(turned))
        assert found.sent == found.used + found.rejected + found.lost + found.damaged + found.late
        return found

    def rejected(self, role: str) -> dict[str, int]:
        """Frames that the codec rejected, by reason; the recording's newest count is not above the endpoint's."""
        counts = {name: count for name, count in self.simulation.endpoints[role].rejected.items() if count}
        recorded = [
            one["values"] for one in self.run.events if (one["lab"], one["code"]) == (role, "rejected")
        ]
        assert recorded or not counts
        for name, count in (recorded[-1] if recorded else {}).items():
            assert count <= counts[name]
        return counts


def same_commands(first: Course, second: Course) -> bool:
    """Whether both rigs were told the same in every tick, to the last bit."""
    ticks = first.plan.ticks
    return all(
        seen(first.simulation, role).commands[:ticks].tobytes()
        == seen(second.simulation, role).commands[:ticks].tobytes()
        for role in (MASTER, SLAVE)
    )


def longest_silence(course: Course, role: str) -> int:
    """The longest run of ticks in which a laboratory used no newer message."""
    log = course.simulation.probes[MASTER].log.used if role == MASTER else None
    numbers = (
        [row[0] for row in log]
        if log is not None
        else [one for _, one in course.simulation.ports[SLAVE].answers]
    )[: course.plan.ticks]
    longest = run = 0
    for before, after in pairwise(numbers):
        run = run + 1 if after == before else 0
        longest = max(longest, run)
    return longest
