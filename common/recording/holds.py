"""The holds of a recorded test, from its events: the earthquake's time at each of its ticks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from common.earthquake_time import EarthquakeTime
from common.recording.run import Run
from common.roles import MASTER

# codes of the master's events: the order to hold, standstill, the order to resume, real time again
HOLD, HELD, RESUME, RESUMED = "hold", "held", "resume", "resumed"


class Hold(NamedTuple):
    """One hold, in ticks of the test."""

    begun: int  # first tick of the ramp to standstill
    ramp: int  # ticks of a ramp
    resumed: int | None  # first tick of the ramp back to real time, None where the test ended before

    @property
    def over(self) -> int | None:
        """The first tick in real time again, None where there is none."""
        return None if self.resumed is None else self.resumed + self.ramp


def holds(events: Iterable[Mapping[str, Any]], interval: float) -> tuple[Hold, ...]:
    """The holds that events of a test with this control interval (s) tell of, in their order."""
    found: list[Hold] = []
    for event in events:
        if event["lab"] != MASTER:
            continue
        tick = round(event["t"] / interval)
        if event["code"] == HOLD and (ramp := int(event["values"].get("ramp", 0))) > 0:
            found.append(Hold(tick, ramp, None))
        elif event["code"] == RESUME and found and found[-1].resumed is None:
            found[-1] = found[-1]._replace(resumed=tick)
    return tuple(found)


def added(found: Iterable[Hold], last: int) -> int:
    """Ticks by which holds have made a test longer that ended at the tick `last`, or would do so if it went on."""
    ends = [
        (hold, hold.resumed if hold.resumed is not None else max(last, hold.begun + hold.ramp))
        for hold in found
    ]
    return sum(end - hold.begun for hold, end in ends)


def before(run: Run, tick: int) -> Run:
    """The part of a recording before a tick of the test; events, metadata and attachments are whole."""
    there = {topic: numbers < tick for topic, numbers in run.sequences.items()}
    return replace(
        run,
        columns={
            topic: {name: values[there[topic]] for name, values in columns.items()}
            for topic, columns in run.columns.items()
        },
        ramps={},
        sequences={topic: numbers[there[topic]] for topic, numbers in run.sequences.items()},
        log_ns={topic: stamps[there[topic]] for topic, stamps in run.log_ns.items()},
    )


def before_hold(run: Run) -> tuple[Run, float | None]:
    """The part of a recording before its first hold, and the test time (s) of that; all of it where there is none."""
    ordered = (event["t"] for event in run.events if event["lab"] == MASTER and event["code"] == HOLD)
    first, columns = next(ordered, None), run.columns.get(MASTER, {})
    if first is None or "t" not in columns:
        return run, None
    numbers = run.sequences[MASTER]
    begun = int(np.searchsorted(columns["t"], first - 1e-9))
    return (before(run, int(numbers[begun])), first) if begun < numbers.size else (run, first)


def places(found: Iterable[Hold], ticks: int) -> list[float]:
    """The earthquake's time at each of the first `ticks` ticks of a test, in control intervals."""
    waiting = list(found)
    time = EarthquakeTime(waiting[0].ramp if waiting else 2)
    result = []
    for tick in range(ticks):
        time.settle(tick)
        if waiting and tick == waiting[0].begun:
            hold = waiting.pop(0)
            time.hold(tick)
            if hold.resumed is not None:
                time.resume(hold.resumed)
        result.append(time.at(tick).place)
    return result
