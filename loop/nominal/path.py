"""A specimen's path: from the building's target to the position that the compensated transfer system achieves."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from common.plan.laboratory_tables import TableCompensator
from common.plan.plan import Plan
from common.roles import MASTER
from laboratories.column import model as column_lab
from laboratories.column.kind import COLUMN
from laboratories.kind import Kind
from laboratories.kinds import kind_of
from loop import site
from models import excitation, indicators
from models.compensators.follower import Follower
from models.excitation import Programme, join
from models.excitation.pieces import Piece, sine
from models.indicators.growth import grows
from models.registry import Array
from models.system import System

CYCLES = 12  # of the sine from which amplitude and delay follow; one at each end is faded
LEAST_SINE = 2.0  # s, length of that sine at higher frequencies, so that adaptive compensators have settled
AMPLITUDE = 1e-3  # m, of sine and pulse: so small that no limit of an actuator is reached
PULSE = 0.5  # length of the pulse in periods, with which the first zero of its spectrum is at four times the frequency
LEAST_PULSE = 8  # ticks: the shape of a shorter pulse is not resolved
# Length of the motion watched after the pulse over the actuator's own delay: a feedback loop with that delay is
# unstable at a period of two to four times the delay at the least, so more than ten periods are seen.
WATCHED = 50
LEAST_WATCHED, MOST_WATCHED = 2.0, 40.0  # s: bounds of it, for ideal actuators and against long computation
LOWEST = 0.2  # Hz: at lower frequencies the delay of a transfer system does not change
DIVERGED = 1e6  # m: a larger motion has diverged


class TransferPath(NamedTuple):
    """Amplitude and delay of a path at one frequency."""

    amplitude: float  # achieved over target, –
    delay: float  # s, negative for a lead; inf where the path is unstable
    stable: bool  # whether the transfer system comes to rest under its compensator, without the building


NO_PATH = TransferPath(1.0, 0.0, stable=True)
UNSTABLE = TransferPath(math.inf, math.inf, stable=False)


def path_at(plan: Plan, frequency: float, role: str = MASTER) -> TransferPath:
    """Amplitude and delay of the path of a role's laboratory for a sine of that frequency (Hz).

    The path consists of the compensated nominal transfer system, the interval by which a slave's force is late at the
    master, and the interval of `unit_delay`. The phase is unwrapped from frequency zero, so that the delay may be
    longer than half a period.
    """
    interval, frequency = plan.test.interval, max(frequency, LOWEST)
    waits = (role != MASTER) + kind_of(plan, role).coupling(plan.of(role)).correction.unit_delay
    programme = join([pulse(interval, frequency)], interval, still=watched(plan.of(role), frequency))
    target, achieved = follow(plan, programme, role)
    begin = programme.segments[0].end
    if achieved.size != target.size or grows(achieved[begin:]):
        return UNSTABLE
    whole = phase_delay(target, achieved, interval, frequency)
    cycles = max(CYCLES, round(LEAST_SINE * frequency))
    piece = sine(interval, frequency, amplitude=AMPLITUDE, cycles=cycles)
    found = indicators.frequency_evaluation_index(*follow(plan, join([piece], interval), role), interval)
    turns = round((whole - found.delay) * found.frequency)
    delay = found.delay + turns / found.frequency
    return TransferPath(found.amplitude, delay + interval * waits, stable=True)


def watched(plan: Plan, frequency: float) -> float:
    """Time (s) to watch after a pulse, in which a stable path comes to rest and an unstable one grows visibly."""
    actuator = plan.actuator
    own = actuator.delay + actuator.time_constant
    if actuator.model == "servo_hydraulic":
        own = actuator.servo.delay
    return min(max(LEAST_WATCHED, 4.0 / frequency, WATCHED * own), MOST_WATCHED)


def pulse(interval: float, frequency: float) -> Piece:
    """A smooth pulse whose spectrum covers all frequencies from zero to beyond the given one (Hz)."""
    count = max(LEAST_PULSE, round(PULSE / frequency / interval))
    values = AMPLITUDE * np.sin(np.pi * np.arange(count) / count) ** 2
    return Piece("pulse", values, True, {"amplitude": AMPLITUDE})


def phase_delay(target: Array, achieved: Array, interval: float, frequency: float) -> float:
    """Delay (s) at a frequency (Hz), with the phase unwrapped from frequency zero, at which it is zero.

    Target and achieved position (n,) are at rest at the end, so that their transforms are those of the whole motion.
    """
    frequencies = np.fft.rfftfreq(target.size, interval)
    part = frequencies <= 1.5 * frequency
    spectrum = np.fft.rfft(achieved)[part] * np.conj(np.fft.rfft(target)[part])
    phase = float(np.interp(frequency, frequencies[part], np.unwrap(np.angle(spectrum))))
    return -phase / (2.0 * math.pi * frequency)


def follow(plan: Plan, programme: Programme, role: str = MASTER) -> tuple[Array, Array]:
    """Target and achieved position (m) of the compensated nominal transfer system.

    The latter ends where it diverges.
    """
    kind, seen = kind_of(plan, role), plan.of(role)
    chosen = kind.compensator(seen)
    follower = Follower(
        TableCompensator(chosen.kind, dict(chosen.parameters)), programme, plan.test.interval, chosen.where
    )
    step = stepped(kind, System(seen))
    target = programme.motion[excitation.POSITION]
    achieved = np.zeros(target.size)
    for tick in range(target.size - 1):
        _, command = follower(tick, float(achieved[tick]))
        if not abs(command) <= DIVERGED:
            return target, achieved[: tick + 1]
        achieved[tick + 1] = step(command)
    return target, achieved


def stepped(kind: Kind, system: System) -> Callable[[float], float]:
    """The nominal laboratory of a kind, from command (m) to position (m) at the interval's end."""
    if kind is COLUMN:
        plan = system.plan
        move = kind.mover(column_lab.build(plan.test.interval, plan.actuator, plan.column))
        return lambda command: move(command)[0]
    played = site.build(kind, system, np.zeros((1, len(kind.channels.names))))
    drive, position = np.zeros((1, 2)), kind.channels.names.index(kind.channels.position)

    def step(command: float) -> float:
        drive[0, 0] = command
        site.play(played, drive, system.plan.test.interval, 0, 1)
        return float(played.truth[position])

    return step
