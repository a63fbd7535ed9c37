"""A rig on its ramp to rest: read, step along the ramp, write, until it is at rest and has settled."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

from common.errors import EmergencyStopError, RigError
from common.lab.laboratory import Laboratory
from common.protocol.exchange import Event
from common.rig import GuardedRig
from common.roles import ramp_topic
from common.safety.ramp import Ramp
from common.signals import Channels

Command = TypeVar("Command", bound=tuple[float, ...])


class Resting(NamedTuple):
    """How far a rig is on its ramp to rest."""

    left: float  # longest remaining time, s, if no interval is missed
    text: str  # the present phase, and the longest remaining time, in words


class Descent(Generic[Command]):
    """Keeps the last two commands written, from which `begin` makes the ramp when the rig is to come to rest.

    `channels` are those of the laboratory, None for a master without a rig, whose ramp is not recorded.
    """

    def __init__(
        self,
        lab: Laboratory,
        rig: GuardedRig,
        begin: Callable[[tuple[float, ...], tuple[float, ...]], Ramp],
        zero: Command,
        channels: Channels | None,
    ) -> None:
        self._lab = lab
        self._rig = rig
        self._make = begin
        self._last = self._before = zero
        self._command: Callable[..., Command] = type(zero)
        self._recorded = channels is not None  # a laboratory without a rig has no topic for it
        self._blank = (math.nan,) * (len(channels.names) if channels else 0)
        self._ramp: Ramp | None = None
        self._begun = 0
        self._settling = 0  # intervals at rest
        self._measured: tuple[float, ...] | None = None

    def wrote(self, command: Command) -> None:
        """Take note of a command that was written to the rig."""
        self._before, self._last = self._last, command

    @property
    def resting(self) -> Resting:
        """How far the rig is on its ramp to rest."""
        safety, interval = self._lab.plan.safety, self._lab.plan.test.interval
        left = max(safety.settle - self._settling * interval, 0.0) + interval
        doing = "beginning the ramp to rest"
        if self._ramp is not None:
            doing = (
                "waiting for the transfer system to settle"
                if self._ramp.done
                else self._ramp.doing(self._measured)
            )
            left += self._ramp.left
        return Resting(left, f"{doing}, at most {left:.1f} s more")

    @property
    def last(self) -> Command:
        """The last command before the ramp."""
        return self._last

    def ease(self, tick: int) -> None:
        """One interval of the ramp: read, compute the next command, write it.

        Raises EmergencyStopError from the rig.
        """
        try:
            measured = self._rig.read()
        except EmergencyStopError:
            raise
        except RigError as error:  # without measurements the ramp ends at the hold
            self._failed(error, tick)
            measured = None
        self.step(tick, measured)

    def step(self, tick: int, measured: tuple[float, ...] | None) -> None:
        """One interval of the ramp with its measurement, None where the rig could not be read."""
        ramp = self._ramp or self._begin(tick)
        command = self._command(*ramp.step(measured))
        self._measured = measured
        over = self._written(command, tick)
        self._settling += ramp.done
        if over or self._settling > self._lab.plan.safety.settle / self._lab.plan.test.interval:
            duration = (tick + 1 - self._begun - max(self._settling - 1, 0)) * self._lab.plan.test.interval
            values = {"duration": duration, "travel": ramp.travel}
            self._lab.at_rest(tick, values | command._asdict())  # type: ignore[attr-defined]
        if self._recorded:
            self._lab.sample_ramp(ramp_topic(self._lab.name), tick, *command, *(measured or self._blank))

    def _written(self, command: Command, tick: int) -> bool:
        """Write a command; return whether the rig failed, so that it takes no more commands and rests where it is."""
        try:
            self._rig.write(command)
        except EmergencyStopError:
            raise
        except RigError as error:
            self._lab.note("ramp", str(error), level="warning", tick=tick)
            self._lab.explain(error, tick=tick)
            self._failed(error, tick)
            return True
        return False

    def _failed(self, error: RigError, tick: int) -> None:
        """Trip because the rig failed on the ramp of an orderly end; after a trip the first cause stays."""
        if self._lab.safety.cause is None:
            self._lab.fail(Event.TRIP, error, code="rig", tick=tick)

    def _begin(self, tick: int) -> Ramp:
        self._begun = tick
        self._ramp = self._make(self._last, self._before)
        return self._ramp
