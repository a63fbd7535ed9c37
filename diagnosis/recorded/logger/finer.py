"""What a laboratory does between the ticks, as a data logger shows it behind its filters and delays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy import ndimage, signal

from common.plan.kinds import COLUMN
from common.recording.imported import NOTHING_STATED, ImportedChannel
from common.recording.logger.passing import later
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.logger.through import through_logger
from loop import replay
from models.registry import Array
from models.system import System

FINER = 8  # steps of an interval
AS_LATE = 1e-4  # s, steps of a delay between which a correction goes straight
REACH = 6  # ticks to each side over which a filter ends what is faster than the ticks


class Finer:
    """The laboratory of the plan in finer steps, and what a logger shows of it that a model at the ticks misses.

    That depends on what a fit moves in the second order only: the model at the ticks has the first.
    """

    def __init__(
        self,
        lab: RecordedLaboratory,
        channels: Sequence[ImportedChannel],
        drive: Array,
        start: float,
        anew: Array | None,
    ) -> None:
        """Of the commands `drive` (ticks, 2) from a constant one, `start`; `anew` (m, 3) is as in `replay.motion`."""
        self._lab, self._channels, self._drive = lab, channels, drive
        self._start, self._anew = start, anew
        self._interval = lab.plan.test.interval
        self._kept: dict[tuple[int, int], Array] = {}

    def missed(self, system: System) -> Array | float:
        """What a model at the ticks misses of the readings (ticks, channels) that a logger recorded of a system.

        It is zero where the logger read at the ticks.
        """
        late = {place: self.late(place, system) for place in range(len(self._channels))}
        known = {place: seconds for place, seconds in late.items() if self.apart(place, seconds)}
        if not known:
            return 0.0
        result = np.zeros((len(self._drive), len(self._channels)))
        for place, seconds in known.items():
            step, share = divmod(seconds / AS_LATE, 1.0)
            result[:, place] = self.at(place, int(step))
            if share > 0.0:
                result[:, place] += share * (self.at(place, int(step) + 1) - result[:, place])
        return result

    def late(self, place: int, system: System) -> float:
        """By how much a channel is late, s."""
        made = system.effects.sensors.get(self._lab.kind.channels.names[place])
        return self._channels[place].delay + (made.logger_delay if made else 0.0)

    def apart(self, place: int, late: float) -> bool:
        """Whether a channel that is `late` (s) shows what lies between the ticks."""
        channel = self._channels[place]
        return not channel.at_ticks and (channel.blunt or channel.between or late != 0.0)

    def at(self, place: int, step: int) -> Array:
        """The same of one channel (ticks,) that is late by so many steps of `AS_LATE`."""
        if (place, step) not in self._kept:
            late = step * AS_LATE
            channel = replace(self._channels[place], delay=late)
            self._kept[place, step] = self.shown(place, late) - self.told(place, channel)
        return self._kept[place, step]

    def shown(self, place: int, late: float) -> Array:
        """What the logger shows of a channel (ticks,) that is late by so many s."""
        channel, passed = self._channels[place], self._passed[place]
        if not channel.between:
            return later(passed, late * FINER / self._interval)[::FINER]
        where = channel.samples(len(self._drive), self._interval) - late / self._interval
        rows = ndimage.map_coordinates(passed, where[None] * FINER, order=3, mode="nearest")
        at_ticks = (np.arange(len(self._drive)) * self._interval - channel.first) * channel.rate
        return np.asarray(ndimage.map_coordinates(rows, at_ticks[None], order=3, mode="nearest"))

    def told(self, place: int, channel: ImportedChannel) -> Array:
        """What a model at the ticks tells of a channel (ticks,) of the plan's laboratory."""
        rows = [channel if other == place else NOTHING_STATED for other in range(len(self._channels))]
        at_ticks = self._fine[::FINER].copy()
        return through_logger(at_ticks, self._lab, self._system, rows, list(self._drive.T))[:, place]

    @cached_property
    def _system(self) -> System:
        """The plan's laboratory."""
        return System(self._lab.plan).unread

    @cached_property
    def _fine(self) -> Array:
        """What sensors without error read, (ticks · FINER, channels).

        The transfer system's command goes straight to that of its tick within an interval, and a motor's is held.
        """
        command, effort = self._drive.T
        shares = np.arange(1, FINER + 1) / FINER
        held = self._lab.kind.name == COLUMN and self._lab.plan.actuator.command == "held"
        before = command if held else np.append(self._start, command[:-1])
        rows = (before[:, None] + (command - before)[:, None] * shares).ravel()
        test = replace(self._lab.plan.test, interval=self._interval / FINER)
        system = replace(self._system, plan=replace(self._lab.plan, test=test))
        anew = None if self._anew is None else self._anew * np.array([FINER, 1.0, 1.0])
        drive = np.column_stack([rows, np.repeat(effort, FINER)])
        return replay.motion(self._lab.kind, system, drive, self._start, anew)

    @cached_property
    def _passed(self) -> list[Array]:
        """The same of each channel (ticks · FINER,) behind its filters, without its delay."""
        return [self.passed(place, channel) for place, channel in enumerate(self._channels)]

    def passed(self, place: int, channel: ImportedChannel) -> Array:
        """One channel in fine steps behind its filters, without its delay."""
        read = self._fine[:, place]
        if channel.smooth:
            weights = signal.firwin(2 * REACH * FINER + 1, 1.0 / FINER)
            read = np.convolve(np.pad(read, REACH * FINER, mode="edge"), weights, "valid")
        return replace(channel, delay=0.0).through(read, self._interval / FINER)
