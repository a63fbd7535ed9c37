"""Invariants of every simulated test with any faults: one small function each, named by what it checks.

They use the rigs' probes, the wire's ledgers, the reported events and the recording; of the laboratories' own state
they use only the mode at each write (`rigs.mode_of`) and the cause of a stop.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.link.transport import TICK
from common.plan.plan import Plan
from common.protocol.codec import Reject
from common.recording.reader import read
from common.roles import MASTER, RECORDER
from laboratories.kinds import kind_of
from models.registry import Array
from validation.faults.lab import Simulation
from validation.faults.rigs import COMPUTED, mode_of, named
from validation.faults.wire import CABLE, WireRoute

MOTOR = 1  # place of a motor's force among the commands
MOVING = ("RUNNING", "HOLDING")
LATCHED = ("RAMPING", "SAFE", "EMERGENCY_STOP")
# ns from sending a message to its use: a delay that one frame in 20 000 exceeds, and the computation of a tick
PATH = round((CABLE.minimum + 10.0 * CABLE.mean) * 1e9) + COMPUTED
ROUNDING = 1.0 + 1e-9  # of sums of a few thousand floating-point steps


class Drive(NamedTuple):
    """A commanded quantity: largest value, largest change in an interval, largest speed; inf without a limit."""

    name: str
    most: float
    step: float
    speed: float


def drives(plan: Plan, role: str) -> tuple[Drive, ...]:
    """The commanded quantities of a role's rig, in the order of its commands; empty where it has none."""
    if role not in plan.kinds:
        return ()
    kind = kind_of(plan, role)
    limits, limited = kind.limits(plan.of(role)), kind.limited
    names = ((limited.step, limited.velocity), (limited.effort_step, ""))
    return tuple(
        Drive(name, *(limits.get(limit, math.inf) for limit in (name, *rates)))
        for name, rates in zip(kind.channels.drives, names, strict=False)
    )


class InvariantViolation(NamedTuple):
    """An invariant that does not hold, and a description of the violation."""

    invariant: str
    text: str


# -- observations ---------------------------------------------------------------------------------


class RigHistory(NamedTuple):
    """The commands of a rig: world times (ns), a row of values each, names of the modes."""

    times: Array
    commands: Array
    modes: list[str]

    def until(self, time: int) -> int:
        """Number of writes until a time."""
        return int(np.searchsorted(self.times, time, side="right"))


def seen(simulation: Simulation, role: str) -> RigHistory:
    """The commands of a role's rig."""
    log = simulation.probes[role].log
    width = len(drives(simulation.plan, role))
    names = {mode: named(mode) for mode in set(log.modes)}
    return RigHistory(
        np.array(log.times, dtype=np.int64),
        np.array(log.commands, dtype=float).reshape(len(log.times), width),
        [names[mode] for mode in log.modes],
    )


def tick_routes(simulation: Simulation, role: str) -> list[WireRoute]:
    """The routes on which a role hears the messages of the ticks."""
    return [
        direction
        for direction in simulation.wire.directions
        if direction.hearer.role == role and direction.route.channel == TICK
    ]


def fresh(simulation: Simulation, direction: WireRoute) -> list[int]:
    """Arrival times (ns) of intact messages that were newer than all before and not too old; a stranger's count too."""
    oldest = simulation.plan.safety.message_age * 1e9
    times, newest = [], -1
    for time, number, sent, _, intact in direction.ledger.arrivals:
        if intact and number > newest and time - sent <= oldest:
            newest = number
            times.append(time)
    return times + direction.ledger.strangers


def last_valid(simulation: Simulation, role: str, told: RigHistory) -> int:
    """World time of the newest message on which a laboratory that stopped early acted, or of its stop before."""
    moving = [place for place, mode in enumerate(told.modes) if mode in MOVING]
    left = int(told.times[moving[-1]]) if moving else 0
    newest = [left]
    for direction in tick_routes(simulation, role):
        times = sorted(fresh(simulation, direction))
        place = bisect_right(times, left)
        newest.append(times[place - 1] if place else int(told.times[0]))
    return min(newest)


def noticed(simulation: Simulation, told: RigHistory, valid: int) -> int:
    """The latest time at which a laboratory must notice missing messages; later where its process was stalled."""
    time = valid + round(simulation.plan.safety.ramp_after * interval(simulation))
    place = told.until(time)
    return int(told.times[place]) if place < told.times.size else time


def stopped_early(simulation: Simulation, role: str) -> bool:
    """Whether a laboratory whose rig moved ended before the test did, without being killed."""
    loop, process = simulation.loops[role], simulation.world.processes[role]
    return bool(simulation.probes[role].log.times) and not process.killed and loop.lab.error is not None


def interval(simulation: Simulation) -> float:
    """The control interval, ns."""
    return simulation.plan.test.interval * 1e9


# -- processes ------------------------------------------------------------------------------------


def no_exception(simulation: Simulation) -> Iterator[str]:
    """No process ends by an exception."""
    for name, process in simulation.world.processes.items():
        if process.error is not None:
            yield f"{name}: {type(process.error).__name__}: {process.error}"


def everybody_ends(simulation: Simulation) -> Iterator[str]:
    """Every process ends, and every rig is disarmed."""
    for name, process in simulation.world.processes.items():
        if not process.ended:
            yield f"{name} still runs at {simulation.world.time * 1e-9:.3f} s."
        elif name in simulation.plan.kinds and not process.killed and not simulation.probes[name].disarmed:
            yield f"{name} ended, and its rig was not disarmed."


# -- rigs -----------------------------------------------------------------------------------------


def commands_within_limits(simulation: Simulation) -> Iterator[str]:
    """Every command at a rig is finite and within its limit."""
    for role in simulation.probes:
        told = seen(simulation, role)
        for place, (name, most, *_) in enumerate(drives(simulation.plan, role)):
            bad = np.flatnonzero(~(np.abs(told.commands[:, place]) <= most))
            if bad.size:
                yield f"{role}: {name} {told.commands[bad[0], place]:g} at {at(told, int(bad[0]))}."


def steps_within_limits(simulation: Simulation) -> Iterator[str]:
    """No command at a rig differs from the one before by more than its limit."""
    for role in simulation.probes:
        told = seen(simulation, role)
        for place, (name, _, step, _) in enumerate(drives(simulation.plan, role)):
            most = step * ROUNDING
            changes = np.abs(np.diff(told.commands[:, place], prepend=0.0))
            bad = np.flatnonzero(~(changes <= most))
            if bad.size:
                yield f"{role}: {name} changes by {changes[bad[0]]:g} at {at(told, int(bad[0]))}."


def at(told: RigHistory, place: int) -> str:
    """The time of a write as text."""
    return f"{told.times[place] * 1e-9:.4f} s"


# -- watchdog and ramp ----------------------------------------------------------------------------


def nobody_runs_unheard(simulation: Simulation) -> Iterator[str]:
    """A laboratory that has had no fresh message for too long neither runs nor holds.

    The first message is due an interval after the first tick (the master's is the answer to that tick), and may be as
    late as a message may be old, because a link with a delay is not silent.
    """
    safety = simulation.plan.safety
    watched = safety.ramp_after * interval(simulation)
    most = watched + interval(simulation) + PATH
    first = round(interval(simulation) + max(safety.message_age * 1e9 - watched, 0.0))
    for role in simulation.probes:
        told = seen(simulation, role)
        if not told.times.size:
            continue
        moving = np.array([mode in MOVING for mode in told.modes])
        for direction in tick_routes(simulation, role):
            times = np.array([told.times[0] + first, *sorted(fresh(simulation, direction))])
            ages = told.times - times[np.searchsorted(times[1:], told.times, side="right")]
            bad = np.flatnonzero(moving & (ages > most))
            if bad.size:
                yield f"{role} runs {ages[bad[0]] * 1e-6:.2f} ms after a message at {at(told, int(bad[0]))}."
                break


def motion_is_bounded(simulation: Simulation) -> Iterator[str]:
    """After the last valid message a rig moves by no more than v·W2 + v²/(2a), then no faster than the ramp."""
    safety = simulation.plan.safety
    watched = safety.ramp_after * simulation.plan.test.interval
    for role in simulation.probes:
        speed = next((drive.speed for drive in drives(simulation.plan, role)), math.inf)
        if speed == math.inf or not stopped_early(simulation, role):
            continue
        told = seen(simulation, role)
        most = speed * watched + speed**2 / (2.0 * safety.acceleration)
        valid = last_valid(simulation, role, told)
        first = max(told.until(valid + round(interval(simulation))) - 1, 0)
        acted = noticed(simulation, told, valid)
        end = told.until(acted + round(speed / safety.acceleration * 1e9 + 2 * interval(simulation)))
        column = told.commands[:, 0]
        motion = float(np.max(np.abs(column[first:end] - column[first]), initial=0.0))
        if motion > most:
            yield f"{role} moved by {motion * 1e3:.2f} mm, {most * 1e3:.2f} mm allowed, after {valid * 1e-9:.4f} s."
        yield from _late_motion(simulation, role, told, end)


def _late_motion(simulation: Simulation, role: str, told: RigHistory, end: int) -> Iterator[str]:
    after = slice(max(end - 1, 0), None)
    spans = np.maximum(np.round(np.diff(told.times[after]) / interval(simulation)), 1.0)
    most = simulation.plan.safety.velocity * simulation.plan.test.interval * spans
    bad = np.flatnonzero(np.abs(np.diff(told.commands[after, 0])) > most * ROUNDING)
    if bad.size:
        yield f"{role} still moves faster than its ramp at {at(told, max(end - 1, 0) + int(bad[0]) + 1)}."


def damper_is_released(simulation: Simulation) -> Iterator[str]:
    """After the last valid message the damper's force is zero within the watchdog's time and the release."""
    safety = simulation.plan.safety
    allowed = round(safety.release * 1e9 + 2 * interval(simulation))
    for role in simulation.plan.roles:
        if len(drives(simulation.plan, role)) < MOTOR + 1 or not stopped_early(simulation, role):
            continue
        told = seen(simulation, role)
        valid = last_valid(simulation, role, told)
        late = told.until(noticed(simulation, told, valid) + allowed)
        if np.any(told.commands[late:, MOTOR] != 0.0) or told.commands[-1, MOTOR] != 0.0:
            yield f"{role}: damper force {told.commands[-1, MOTOR]:g} N at the end, after {valid * 1e-9:.4f} s."


def latched_stays(simulation: Simulation) -> Iterator[str]:
    """A laboratory that ramps to rest does not run again, because these tests contain no reset."""
    for role, probe in simulation.probes.items():
        modes = [named(mode) for mode in [*probe.log.modes, mode_of(simulation.loops[role].lab)]]
        first = next((place for place, mode in enumerate(modes) if mode in LATCHED), len(modes))
        left = [mode for mode in modes[first:] if mode in (*MOVING, "ARMED", "CONFIGURED")]
        if left:
            yield f"{role} was {modes[first]} and is {left[0]} afterwards."


def causes_are_named(simulation: Simulation) -> Iterator[str]:
    """Where one laboratory stops early, every one that was not killed reports a cause."""
    if not any(stopped_early(simulation, role) for role in simulation.loops):
        return
    for role, loop in simulation.loops.items():
        told = [item.data for item in simulation.events[role]]
        reasons = [item for item in told if item["level"] == "error" or item["code"] == "stop"]
        process = simulation.world.processes[role]
        if loop.lab.exchange.session and not process.killed and not any(item["text"] for item in reasons):
            yield f"{role} ended in the state '{loop.lab.exchange.state.value}' without a cause among its events."


# -- accounts -------------------------------------------------------------------------------------


def frames_add_up(simulation: Simulation) -> Iterator[str]:
    """A frame that reached a process was given to its loop, rejected, or not yet read; damaged ones were rejected."""
    for role, port in simulation.ports.items():
        if role in simulation.strangers:
            continue
        endpoint = simulation.endpoints[role]
        ledgers = [one.ledger for one in simulation.wire.directions if one.hearer is port]
        damaged = sum(counts["damaged"] for ledger in ledgers for counts in ledger.counts.values())
        rejected = sum(endpoint.rejected[reason.value] for reason in Reject)
        if damaged > rejected:
            yield f"{role} rejected {rejected} frames, {damaged} were damaged."
        delivered = sum(counts["delivered"] for ledger in ledgers for counts in ledger.counts.values())
        taken, unread = sum(port.taken.values()), endpoint.unread
        if delivered != taken + unread + rejected:
            yield f"{role} heard {delivered} frames, took {taken}, left {unread} and rejected {rejected}."


def numbers_add_up(simulation: Simulation) -> Iterator[str]:
    """Sent = used + lost + rejected + superseded, by number: the newest message that arrived in time was used."""
    for role in simulation.loops:
        if role in simulation.strangers:
            continue
        told = seen(simulation, role)
        moving = [place for place, mode in enumerate(told.modes) if mode in MOVING]
        if not moving:
            continue
        last = int(told.times[moving[-1]]) - 2 * round(interval(simulation))
        for direction in tick_routes(simulation, role):
            used = used_numbers(simulation, role, direction)
            newest, ticks = max(used, default=-1), len(moving) - 2
            left = [
                number
                for time, number, sent, _, intact in direction.ledger.arrivals
                if intact and newest < number < ticks and time < last and not_old(simulation, time - sent)
            ]
            if left:
                yield f"{role} never used number {left[0]} on {direction.name} nor a newer one."
            unknown = set(used) - set(direction.ledger.numbers["sent"]) - {-1}
            if unknown:
                yield f"{role} used number {min(unknown)} on {direction.name}, which was never sent."


def not_old(simulation: Simulation, age: int) -> bool:
    """Whether a message of this age is certainly fresh: a quarter of the bound leaves room for its way and a tick."""
    return age < 0.25 * simulation.plan.safety.message_age * 1e9


def used_numbers(simulation: Simulation, role: str, direction: WireRoute) -> list[int]:
    """Numbers of a route's messages that were used, tick by tick."""
    if role != MASTER:
        return [command for _, command in simulation.ports[role].answers]
    place = simulation.plan.roles.index(direction.route.role)
    return [row[place] for row in simulation.probes[role].log.used]


def numbers_never_go_back(simulation: Simulation) -> Iterator[str]:
    """After a message only newer ones are used."""
    for role in simulation.loops:
        for direction in tick_routes(simulation, role):
            used = np.array(used_numbers(simulation, role, direction))
            back = np.flatnonzero(np.diff(used) < 0)
            if back.size:
                yield f"{role} used number {used[back[0] + 1]} after {used[back[0]]} on {direction.name}."


# -- recording ------------------------------------------------------------------------------------


def recording_is_whole(simulation: Simulation) -> Iterator[str]:
    """The recording can be read; it is complete where the recorder was not killed."""
    if simulation.recording is None:
        return
    try:
        run = read(simulation.recording)
    except InputError as error:
        yield str(error)
        return
    if not run.finished and not simulation.world.processes[RECORDER].killed:
        yield "The recording has no end."


Invariant = Callable[[Simulation], Iterator[str]]

SAFETY: tuple[Invariant, ...] = (  # those that need the watchdog, the safe ramp and limits on rates
    steps_within_limits,
    nobody_runs_unheard,
    motion_is_bounded,
    damper_is_released,
    causes_are_named,
)
INVARIANTS: tuple[Invariant, ...] = (
    no_exception,
    everybody_ends,
    commands_within_limits,
    latched_stays,
    frames_add_up,
    numbers_add_up,
    numbers_never_go_back,
    recording_is_whole,
    *SAFETY,
)


def judge(simulation: Simulation, invariants: tuple[Invariant, ...] = INVARIANTS) -> list[InvariantViolation]:
    """The violated invariants of a run."""
    return [
        InvariantViolation(invariant.__name__, text)
        for invariant in invariants
        for text in invariant(simulation)
    ]
