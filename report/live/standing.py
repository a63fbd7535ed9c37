"""The newest known state of every laboratory, how old that is, and what stopped the test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from common.host.clock import Clock
from common.recording.holds import HELD, HOLD, RESUME, RESUMED
from common.roles import MASTER, RECORDER
from common.safety.modes import LATCHED, Mode
from recorder.loop import CONSEQUENCE

MODES = [mode.value for mode in Mode]
GRAVEST = (  # the first of these modes that any laboratory is in is the state of the test
    Mode.EMERGENCY_STOP,
    Mode.SAFE,
    Mode.RAMPING,
    Mode.HOLDING,
    Mode.RUNNING,
    Mode.ARMED,
    Mode.CONFIGURED,
    Mode.IDLE,
)


# the test in words after the master's events of a hold, while its laboratories run
PACES = {HOLD: "slowing down to a hold", HELD: "held", RESUME: "resuming", RESUMED: ""}


class StopCause(NamedTuple):
    """Why a laboratory stopped the test, and when (test time, s)."""

    lab: str
    t: float
    code: str
    text: str


class Standing:
    """Modes, ages and causes of the laboratories, from their rows and events.

    A row's age is the time since it was measured. The clock of the test and that of this process differ by an unknown
    constant. The smallest difference seen between a row's time and its arrival is taken for it, so that an age is what
    a row waited beyond the shortest wait of all.
    """

    def __init__(self, clock: Clock) -> None:
        self.modes: dict[str, str] = {}
        # Causes that arose in a laboratory itself; where there are none, those that followed another laboratory.
        self.stops: list[StopCause] = []
        self.pace = ""  # one of `PACES`, empty in real time
        self._clock = clock
        self._t: dict[str, float] = {}  # newest time of each laboratory
        self._shift = math.inf  # s

    def row(self, lab: str, t: float) -> None:
        """The newest row of a laboratory was measured at a test time."""
        self._t[lab] = max(t, self._t.get(lab, 0.0))
        if t > 0.0:
            self._shift = min(self._shift, self._clock.now() * 1e-9 - t)

    def event(self, event: Mapping[str, Any]) -> None:
        """Something has happened."""
        lab, t, values = str(event["lab"]), float(event["t"]), event["values"]
        self._t[lab] = max(t, self._t.get(lab, 0.0))
        if event["code"] == "mode" and 0 <= values.get("mode", -1) < len(MODES):
            self.modes[lab] = MODES[int(values["mode"])]
        if lab == MASTER:
            self.pace = PACES.get(event["code"], self.pace)
        if event["level"] == "error" and lab != RECORDER:
            self.stops.append(StopCause(lab, t, str(event["code"]), str(event["text"])))
            own = [stop for stop in self.stops if stop.code != CONSEQUENCE]
            self.stops = own or self.stops

    def last(self, lab: str) -> float | None:
        """Test time of a laboratory's newest row or event, s; None before the first row."""
        return self._t.get(lab) if math.isfinite(self._shift) else None

    def age(self, lab: str) -> float:
        """Seconds since then."""
        return max(self._clock.now() * 1e-9 - self._shift - self._t.get(lab, 0.0), 0.0)

    @property
    def latched(self) -> bool:
        """Whether a laboratory waits for an operator's reset."""
        return any(Mode(mode) in LATCHED for mode in self.modes.values())

    @property
    def gravest(self) -> str:
        """The mode of the laboratory that is farthest from running, empty while none is known.

        Where all run it is how the test is held, if it is.
        """
        found = [mode.value for mode in GRAVEST if mode.value in self.modes.values()]
        first = found[0] if found else ""
        return self.pace if self.pace and first == Mode.RUNNING.value else first
