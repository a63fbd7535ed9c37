"""Rigs with a probe, which stores their commands with the world time and can falsify their readings."""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import Enum
from typing import Any, NamedTuple

from common.errors import RigError
from common.lab.drive import DrivenLoop
from common.lab.laboratory import Laboratory
from common.protocol.exchange import State
from common.rig import GuardedRig
from simulation.world import Process

COMPUTED = 100_000  # ns that a tick takes between reading and writing: more than the loops need, less than an interval
PRESENT = {
    State.IDLE: "IDLE",
    State.REGISTERED: "CONFIGURED",
    State.ARMED: "ARMED",
    State.SCHEDULED: "ARMED",
    State.RUNNING: "RUNNING",
}


def mode_of(lab: Laboratory) -> Enum:
    """The mode of a laboratory; its state of the protocol where it has no state machine of its own."""
    safety: Any = getattr(lab, "safety", None)
    mode: Enum = lab.exchange.state if safety is None else safety.mode
    return mode


def named(mode: Enum) -> str:
    """The name of a mode; of a state of the protocol the name of the corresponding mode."""
    return PRESENT.get(mode, "SAFE") if isinstance(mode, State) else mode.name


class Log:
    """World time (ns), command and mode at each write of a rig.

    Of the master also the numbers of the used feedbacks, and the storey drift of the tick before (m).
    """

    def __init__(self) -> None:
        self.times: list[int] = []
        self.commands: list[tuple[float, ...]] = []
        self.modes: list[Enum] = []
        self.used: list[tuple[int, ...]] = []
        self.drifts: list[float] = []


class Wrong(NamedTuple):
    """How a reading is wrong: `nan`, `frozen`, `jump`, `beyond` or `raise`."""

    kind: str
    place: int
    by: float


class Probe:
    """Observations of a rig that do not depend on loop and recording; the loop is given once it is built."""

    def __init__(self, inner: GuardedRig, process: Process) -> None:
        self.inner = inner
        self.process = process
        self.loop: DrivenLoop | None = None
        self.partners: list[Any] = []  # of the master: its side of each slave
        self.log = Log()
        self.wrong: dict[object, Wrong] = {}
        self.disarmed: list[int] = []
        self._frozen: dict[int, float] = {}

    def read(self) -> Iterable[float]:
        """Readings of the rig, falsified by the present faults."""
        self.process.spend(COMPUTED)
        readings: Iterable[float] = self.inner.read()
        return self._falsified(list(readings)) if self.wrong else readings

    def _falsified(self, values: list[float]) -> list[float]:
        for kind, given, by in self.wrong.values():
            place = given % len(values)
            match kind:
                case "nan":
                    values[place] = math.nan
                case "frozen":
                    values[place] = self._frozen.setdefault(place, values[place])
                case "jump":
                    values[place] += by
                case "beyond":
                    values[place] = by
                case _:
                    raise RigError("the simulated rig does not answer.")
        return values

    def write(self, command: tuple[float, ...]) -> None:
        """Store a command and pass it to the rig."""
        loop = self.loop
        assert loop is not None  # noqa: S101 - rigs move after their loop is built
        log = self.log
        log.times.append(self.process.time)
        log.commands.append(command)
        log.modes.append(mode_of(loop.lab))
        if self.partners:
            log.used.append(tuple([partner.used.seq for partner in self.partners]))
            log.drifts.append(loop.progress["drift"])
        self.inner.write(command)

    def disarm(self) -> None:
        """Store the time, and disarm the rig."""
        self.disarmed.append(self.process.time)
        self.inner.disarm()

    def set_wrong(self, key: object, wrong: Wrong) -> None:
        """Begin a fault of the readings."""
        self._frozen.clear()
        self.wrong[key] = wrong

    def set_right(self, key: object) -> None:
        """End a fault of the readings."""
        self.wrong.pop(key, None)


class ProbedRig:
    """The rig that a reality names; it passes everything to a probe."""

    def __init__(self, interval: float, seed: int, probe: Probe) -> None:
        self._probe = probe

    def arm(self) -> None:
        """Arm the probe's rig."""
        self._probe.inner.arm()

    def read(self) -> Iterable[float]:
        """Readings of the probe."""
        return self._probe.read()

    def write(self, command: Any) -> None:
        """Apply a command."""
        self._probe.write(command)

    def disarm(self) -> None:
        """Disarm."""
        self._probe.disarm()
