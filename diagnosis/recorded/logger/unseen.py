"""Commands of a controller that a data logger did not record as they were."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from common.recording.imported import ImportedData
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.record import Record
from models.registry import Array
from models.system import System

# Rows in an interval, below which they pass over ticks that count. Of faster rows near the ticks the times hardly tell
# which ticks they showed, and nearly all were.
SLOWER = 0.9
# Weights of a value and of the four around it in what a cubic through these misses it by.
CUBIC = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0


class Driven(Protocol):
    """A laboratory that recorded commands drive."""

    lab: RecordedLaboratory
    role: str
    inputs: dict[str, Array]
    unsure: dict[str, Array]

    def predict(self, system: System) -> Array:
        """Readings of the laboratory, (ticks, signals)."""

    def replaced(self, **fields: Any) -> Driven:
        """The same laboratory in another test."""


def shown(record: Record, topic: str, name: str) -> NDArray[np.int64] | None:
    """The ticks at which rows that are slower than ticks showed a number of a controller; None where they are not."""
    interval = record.plan.test.interval
    channel = (record.stated or ImportedData("")).channel(topic, name)
    slow = channel.interpolated and 0.0 < channel.rate * interval < SLOWER
    return channel.seen(record.ticks, interval) if slow else None


def unseen(part: Driven, record: Record) -> Array | float:
    """Rms (signals,) of what commands may have moved that is not known of them.

    A logger with slow rows showed them at every few ticks, and one that read them as voltages added noise of its own.
    It is what the plan's laboratory makes of a draw of that noise; 0 where all commands are known.
    """
    target, seed = part.lab.signal(part.lab.kind.channels.target.name), record.plan.test.seed
    more = dict(part.inputs)
    for place, (name, values) in enumerate(part.inputs.items()):
        ticks = shown(record, part.role, name if record.has(name) else target)
        if ticks is not None:
            more[name] = values + between_shown(values, ticks, seed + place)
        if name in part.unsure:
            more[name] = more[name] + part.unsure[name]
    if all(more[name] is values for name, values in part.inputs.items()):
        return 0.0
    plan = System(part.lab.plan)
    moved = part.replaced(inputs=more).predict(plan) - part.predict(plan)
    return np.asarray(np.sqrt(np.mean(np.square(moved), axis=0)))


def between_shown(command: Array, ticks: NDArray[np.int64], seed: int) -> Array:
    """What a command (n,) may have had at ticks beside a spline through those at which it was shown, (n,).

    A controller that feeds readings back has their noise in its command, and as much of it at the ticks that were not
    shown. It is drawn as white noise of the size that neighbours tell: what a cubic through four of them misses.
    """
    ticks = ticks[ticks < command.size]
    if ticks.size < CUBIC.size:
        return np.zeros(command.size)
    missed = np.convolve(command[ticks], CUBIC, "valid")
    size = float(np.sqrt(np.mean(np.square(missed)) / np.sum(np.square(CUBIC))))
    noise = size * np.random.default_rng(seed).standard_normal(command.size)
    smooth = CubicSpline(ticks, noise[ticks])(np.clip(np.arange(command.size), ticks[0], ticks[-1]))
    return np.asarray(noise - smooth)
