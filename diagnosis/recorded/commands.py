"""Commands that a recording lacks, or has as they were sent, or that a plan says to be reached at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from common.recording.imported import NOTHING_STATED, ImportedData
from common.roles import MASTER
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.signals.mask import Mask
from laboratories.kind import Follows
from laboratories.kinds import KINDS
from models.registry import Array

# Ticks and degree of the polynomials whose slope is a velocity: of 10 Hz they take 0.1 % away at 2 ms, and of steps of
# 1 µm in the displacement 0.02 mm/s are left.
SMOOTHED, DEGREE = 9, 4
LATEST = 25  # ticks by which messages are late at most, where it is looked for
# Of what a command differs by from the target of its tick, and of its rms, what it differs by at most from the target
# that was received, where the log has the target as it was sent.
NEARER, NEAR = 0.2, 1e-3

Number = TypeVar("Number", np.float64, np.bool_)
Ticks = NDArray[np.int_]


def at_targets(
    signals: dict[str, Array], present: dict[str, Mask], labs: tuple[RecordedLaboratory, ...]
) -> None:
    """Put the targets in place of the commands of transfer systems that a plan says to be ideal."""
    for lab in labs:
        channels = lab.kind.channels
        command, target = lab.signal(channels.command.name), lab.signal(channels.target.name)
        if target in signals and lab.kind.name in KINDS:
            signals[command], present[command] = wanted(
                signals[target], present[target], at_end=lab.role != MASTER
            )


def wanted(values: Array, there: Mask, *, at_end: bool) -> tuple[Array, Mask]:
    """A target as the command of an ideal transfer system, which is the target at the end of the interval.

    A target that is sent to a slave is already that of the interval's end; the master's own is recorded for the tick.
    """
    return (values, there) if at_end else (following(values), following(there))


def received(
    signals: dict[str, Array], labs: tuple[RecordedLaboratory, ...], stated: ImportedData
) -> dict[str, Ticks]:
    """Put what slaves received in the place of what a log has as it was sent; the ticks that they received, by role.

    Without a compensator a slave's command is the target that it received. Where it is the target of an earlier tick,
    the log has the master's own numbers, of which the others are on their way as long. A command that is `stated` to
    have passed a filter, which a number has not, is late by that as well, and tells nothing.
    """
    found: dict[str, Ticks] = {}
    for lab in labs:
        channels = lab.kind.channels
        command, *sent = (lab.signal(one.name) for one in (channels.command, *channels.driving))
        if lab.role == MASTER or not {command, sent[0]} <= signals.keys():
            continue
        reached, target = signals[command], signals[sent[0]]
        used = in_force(signals, lab, target.size)
        if lab.kind.compensator(lab.plan).kind != "none" or not np.ptp(target):
            continue
        if stated.channel(lab.role, channels.command.name).chain != NOTHING_STATED.chain:
            continue
        ways = [np.clip(used - late, 0, None) for late in range(LATEST + 1)]
        missed = [float(np.std(reached - target[way])) for way in ways]
        best = int(np.argmin(missed))
        if missed[best] < min(NEARER * np.std(reached - target), NEAR * np.std(reached)):
            signals |= {name: signals[name][ways[best]] for name in sent if name in signals}
            found[lab.role] = ways[best]
    return found


def completed(
    signals: dict[str, Array],
    present: dict[str, Mask],
    labs: tuple[RecordedLaboratory, ...],
    interval: float,
    known: Mapping[str, Ticks],
) -> tuple[str, ...]:
    """Add the commands of slaves that were not recorded and follow from what was, and return their names.

    Without a compensator a slave's command is the target that it received. The force of its motor follows from the
    plan's control and the building's velocity at the end of the interval, on its way as long as targets that are known
    to be, by role, or by what the numbers of the messages say. What a controller did otherwise than planned looks like
    an effect in the laboratory then.
    """
    before = set(signals)
    for lab in labs:
        if lab.role == MASTER:
            continue
        channels = lab.kind.channels
        command, target = lab.signal(channels.command.name), lab.signal(channels.target.name)
        if target in signals and command not in signals and lab.kind.compensator(lab.plan).kind == "none":
            signals[command], present[command] = signals[target], present[target]
        effort = lab.signal(channels.effort.name) if channels.effort else ""
        gain = lab.kind.coupling(lab.plan).effort
        if not effort or effort in signals or gain == 0.0 or "displacement" not in signals:
            continue
        force, there = gain * velocity(signals, lab, interval), present["displacement"]
        used = known.get(lab.role, in_force(signals, lab, there.size))
        signals[effort], present[effort] = following(force)[used], following(there)[used]
    return tuple(sorted(set(signals) - before))


def velocity(signals: dict[str, Array], lab: RecordedLaboratory, interval: float) -> Array:
    """Velocity (ticks,) of what a laboratory follows, m/s: as recorded, or the slope of the displacement."""
    if "velocity" in signals:
        return followed(signals["velocity"], lab)
    motion = followed(signals["displacement"], lab)
    if motion.size < SMOOTHED:
        return np.gradient(motion, interval)
    from scipy import signal

    return np.asarray(signal.savgol_filter(motion, SMOOTHED, DEGREE, deriv=1, delta=interval))


def followed(building: Array, lab: RecordedLaboratory) -> Array:
    """What a laboratory follows (ticks,) of the building's motion (ticks,) or (ticks, storeys): a floor or a drift."""
    coupling = lab.kind.coupling(lab.plan)
    floors = building.reshape(len(building), -1)
    floor = floors[:, coupling.place - 1]
    if coupling.follows is Follows.DRIFT and coupling.place > 1:
        return np.asarray(floor - floors[:, coupling.place - 2])
    return np.asarray(floor)


def in_force(signals: dict[str, Array], lab: RecordedLaboratory, ticks: int) -> Ticks:
    """The tick (ticks,) of whose message a slave has its commands, by the numbers of messages.

    They may begin anywhere, so that most messages are taken to come in time; all are where no numbers were recorded.
    """
    own = np.arange(ticks)
    numbers = signals.get(lab.signal("command_seq"))
    if numbers is None:
        return own
    late, often = np.unique(own - numbers.astype(int), return_counts=True)
    usual = late[np.argmax(often)]
    return np.clip(numbers.astype(int) + usual, 0, ticks - 1)


def following(values: NDArray[Number]) -> NDArray[Number]:
    """What a series (ticks,) has one tick later."""
    return np.append(values[1:], values[-1:])
