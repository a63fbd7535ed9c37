"""The content of a growing recording for the views: traces, exchanges, modes and events, updated at every look."""

from __future__ import annotations

import contextlib
import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from common.errors import InputError
from common.host.clock import Clock
from common.plan.plan import Plan
from common.plan.read import parse
from common.recording.outcome import outcome
from common.recording.reader import Tail
from common.recording.run import Run, Values
from common.roles import LATENCY, MASTER, SLAVE, kind_of, latency_topic
from common.safety.modes import Mode
from report.facts.laboratories import LaboratoryFacts, laboratories
from report.live.levels import Levels
from report.live.standing import Standing
from report.live.trace import Trace, extremes, largest
from report.pictures.curves import labs_of

POINTS = 1000  # of a line: a wide screen has about as many pixel columns for a plot
POINTS_WHOLE = 5000  # of a line of a finished recording, which is sent once and may be zoomed
# Ns without new data that count as silence: the recorder writes twenty times a second.
SILENT_NS = 2_000_000_000
EVENTS = 100  # kept for new pages; a test in order has about thirty
EDGES = np.geomspace(50.0, 50_000.0, 61)  # µs, of the histogram's classes
TIMED = ("t", "round_trip", "wake_lateness")  # of the latency
DEFAULT = laboratories(Run(Path(), columns={MASTER: {}, SLAVE: {}}))


def names_of(labs: Iterable[LaboratoryFacts], kind: str) -> tuple[str, ...]:
    """The signals that the views show of a kind of topic; of slaves those of all of them."""
    if kind == LATENCY:
        return TIMED
    found = ["t"]
    for lab in labs:
        if kind_of(lab.topic) == kind:
            loops = [name for loop in lab.pictured.loops for name in (loop.motion, loop.force)]
            found += [lab.channels.target.name, lab.channels.position, *loops, *lab.pictured.also]
    return tuple(dict.fromkeys(found))


class Timing:
    """The exchange with one slave since the test's begin; `counts` are those of round trips in classes between EDGES.

    What is shorter or longer than all classes is counted in the first and the last.
    """

    def __init__(self) -> None:
        self.ticks = self.late = 0
        self.counts = np.zeros(EDGES.size - 1, dtype=np.int64)
        self.newest = self.longest = (
            math.nan
        )  # s, median round trip of the newest look, and the longest of all

    @property
    def instant(self) -> bool:
        """Whether messages take no time at all, as in virtual time."""
        return self.longest == 0.0

    def add(self, columns: Mapping[str, Values]) -> None:
        """Take in some ticks."""
        trips = columns["round_trip"][np.isfinite(columns["round_trip"])]
        self.ticks += columns["round_trip"].size
        self.late += int(np.count_nonzero(columns["deadline_missed"]))
        if trips.size:
            self.newest = float(np.median(trips))
            self.longest = float(np.fmax(self.longest, trips.max()))
            self.counts += np.histogram(np.clip(trips * 1e6, EDGES[0], EDGES[-1]), EDGES)[0]


NOTHING, NO_TIMING = Trace(1, 1), Timing()


class Feed:
    """What the views show; `window` (s) is how long its traces reach back.

    Where that is the `whole` of a finished recording, what is left of each group of ticks are its extremes. Several
    pages read it, each at its own pace; `changes` counts the looks that brought something, `happened` all events.
    """

    def __init__(
        self, tail: Tail, window: float, clock: Clock, *, since_ns: int = 0, whole: bool = False
    ) -> None:
        self.path = tail.path
        self.window = window
        self.whole = whole
        self.plan: Plan | None = None
        self.test = ""
        self.roles: tuple[str, ...] = (SLAVE,)
        self.laboratories = DEFAULT  # until the recording says others
        self.t = 0.0
        self.interval = 0.0  # s, 0 while it is not known
        self.standing = Standing(clock)
        self.levels = Levels()
        self.events: deque[dict[str, Any]] = deque(maxlen=EVENTS)
        self.changes = self.happened = 0
        self.failure = ""
        self._tail = tail
        self._clock = clock
        self._since_ns = since_ns
        self._grown_ns = clock.now()
        self._traces: dict[str, Trace] = {}
        self._timings: dict[str, Timing] = {}
        self._summary: Mapping[str, str] = {}
        self._metadata: dict[str, dict[str, str]] = {}

    # -- reading ----------------------------------------------------------------------------------

    def look(self) -> None:
        """Read what the file has got since the last look; a failure to read stands in `state`."""
        if self.failure or self._old():
            return
        try:
            run = self._tail.look()
        except InputError as error:
            self.failure = str(error)
            return
        self._show(run)
        if self.ended:
            for trace in self._traces.values():
                trace.close()

    def _show(self, run: Run) -> None:
        if run.metadata and self.plan is None and "plan" in run.metadata:
            self._plan_of(run)
        if not (run.events or any(run.has(topic) for topic in run.columns) or self._ramp(run)):
            self._summary = run.metadata.get("summary", self._summary)
            return
        self._grown_ns = self._clock.now()
        self.changes += 1
        try:
            self._take(run)
        except (LookupError, TypeError, ValueError) as error:
            self.failure = f"{self.path} does not hold what a test records ({type(error).__name__}: {error})."

    def _old(self) -> bool:
        """Whether the file is still that of a test before, or not there."""
        if not self._since_ns:
            return False
        try:
            old = self.path.stat().st_mtime_ns < self._since_ns
        except OSError:
            return True
        self._since_ns = self._since_ns if old else 0
        return old

    def _plan_of(self, run: Run) -> None:
        self._metadata = {"plan": run.metadata["plan"]}
        with contextlib.suppress(InputError):
            self.plan = parse(run.metadata["plan"].get("toml", ""), self.path.parent)
            self.interval = self.plan.test.interval

    @staticmethod
    def _ramp(run: Run) -> bool:
        return any(columns["seq"].size for columns in run.ramps.values())

    def _take(self, run: Run) -> None:
        self.test, self.roles = run.test, run.roles
        self._summary = run.metadata.get("summary", self._summary)
        if self.changes == 1:
            self.laboratories = labs_of(replace(run, metadata=self._metadata))
        for role in (MASTER, *run.roles):
            for columns in (run.columns.get(role, {}), run.ramps.get(role, {})):
                self._move(role, columns)
                if columns and columns["seq"].size:
                    self.levels.take(role, columns, run.units.get(role, {}))
        for role in run.roles:
            self._exchange(role, run.columns.get(latency_topic(role), {}))
        for event in run.events:
            self.events.append(event)
            self.happened += 1
            self.standing.event(event)

    def _move(self, role: str, columns: Mapping[str, Values]) -> None:
        """Add the motion of a laboratory at some ticks, or on its ramp to rest."""
        if not columns or not columns["seq"].size:
            return
        if not self.interval and columns["seq"][-1] > 0:
            self.interval = float(columns["t"][-1] / columns["seq"][-1])
        self.t = max(self.t, float(columns["t"][-1]))
        self.standing.row(role, float(columns["t"][-1]))
        nothing = np.full(columns["seq"].size, math.nan)
        names = names_of(self.laboratories, kind_of(role))
        self._kept(role).add(columns["seq"], {name: columns.get(name, nothing) for name in names})

    def _exchange(self, role: str, columns: Mapping[str, Values]) -> None:
        if columns and columns["seq"].size and self.interval:
            values = {"t": columns["seq"] * self.interval, **columns}
            self._timings.setdefault(role, Timing()).add(columns)
            self._kept(latency_topic(role)).add(columns["seq"], {name: values[name] for name in TIMED})

    def _kept(self, topic: str) -> Trace:
        """The trace of a topic of which something has come: of the latency the worst of each group of ticks."""
        if topic not in self._traces:
            ticks = self.window / (self.interval or Plan().test.interval)
            kind, room = kind_of(topic), POINTS_WHOLE if self.whole else POINTS
            thin = largest if kind == LATENCY else extremes if self.whole else None
            points = 2 * len(names_of(self.laboratories, kind)[1:])  # of a group, of which extremes are kept
            most = points if thin is extremes else 1
            step = max(math.ceil((ticks + 1 if self.whole else ticks) * most / room), 1)
            self._traces[topic] = Trace(step, room, thin)
        return self._traces[topic]

    # -- what is there ----------------------------------------------------------------------------

    def trace(self, topic: str) -> Trace:
        """The newest points of a topic, an empty trace while there are none."""
        return self._traces.get(topic, NOTHING)

    def timing(self, role: str) -> Timing:
        """The exchange with a slave."""
        return self._timings.get(role, NO_TIMING)

    def names(self, kind: str) -> tuple[str, ...]:
        """The signals of a kind of topic that are shown."""
        return names_of(self.laboratories, kind)

    @property
    def labs(self) -> tuple[str, ...]:
        """All laboratories."""
        return (MASTER, *self.roles)

    @property
    def beat(self) -> int:
        """A number that changes every second."""
        return self._clock.now() // 1_000_000_000

    @property
    def silent(self) -> float:
        """Seconds for which the file has not grown, 0 up to `SILENT_NS`."""
        silent = self._clock.now() - self._grown_ns
        return silent * 1e-9 if silent > SILENT_NS and not self.ended else 0.0

    @property
    def behind(self) -> bool:
        """Whether more of the file is there than was read."""
        return self._tail.behind

    @property
    def ended(self) -> bool:
        """Whether the recording is complete, so that nothing more will come."""
        return bool(self.finished or self._tail.damage or self.failure)

    @property
    def finished(self) -> bool:
        """Whether the recorder has ended the recording in order."""
        return bool(self._tail.finished)

    @property
    def state(self) -> str:
        """The state of the test in words."""
        if self.failure:
            return self.failure
        if self._tail.damage:
            return f"the recording is damaged {self._tail.damage}"
        if self._tail.finished:
            return f"ended: {outcome(self._summary)}"
        return self._progress()

    def _progress(self) -> str:
        """The progress of a recording that has not ended."""
        if not self.changes:
            return "waiting for the recording to begin"
        if self.behind:
            return "reading what was recorded so far"
        standing = self.standing.gravest.replace("_", " ") or (Mode.RUNNING.value if self.t else "starting")
        if self.silent and self.standing.latched:  # a laboratory that waits for its operator measures nothing
            return f"{standing}, t = {self.t:.2f} s; no news for {self.silent:.0f} s"
        if self.silent:
            return f"no news for {self.silent:.0f} s; the newest: {standing}, t = {self.t:.2f} s"
        return f"{standing}, t = {self.t:.2f} s"
