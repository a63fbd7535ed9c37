"""Recordings of tests of every shape, made of sines: they need no loop and are known in closed form."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from common.plan.plan import Plan
from common.recording.run import CLOCK
from common.recording.writer import Recording
from common.signals import LATENCY as LATENCY_ROWS
from common.signals import FieldType, Signal
from laboratories import kinds
from tests import shapes

TICKS = 1500
INTERVAL = 2e-3
SIZES = {"m": 5e-3, "m/s": 0.06, "m/s²": 0.8, "m/s³": 9.0, "N": 40.0}  # amplitudes by unit
FREQUENCY = 2.0  # Hz
LATE = 1  # ticks by which a measurement follows its target
SHAPES = ("default", "two_columns", "two_storeys", "single_site", "two_slaves", "own", "own_lost")


def plan_of(shape: str) -> Plan:
    """The plan of a shape, over the ticks of its recording."""
    return shapes.plan_of(shape, test={"name": shape, "duration": TICKS * INTERVAL})


def write(shape: str, folder: Path) -> Path:
    """A recording of a test of that shape; that of `own_lost` names a class that is nowhere."""
    plan = plan_of(shape)
    topics = kinds.topics(plan_of("own") if shape == "own_lost" else plan)
    path = folder / f"{shape}.mcap"
    recording = Recording(path, shape, plan.storeys, topics, plan.roles)
    recording.metadata("plan", {"toml": plan.toml(), "digest": plan.digest()})
    recording.describe()
    recording.metadata(CLOCK, {"kind": "real"})
    recording.metadata("ground_motion", {"record": "a sine", "scale": "0.1"})
    for topic, rows in topics.items():
        if topic in ("master", *plan.roles) or rows is LATENCY_ROWS:
            for tick in range(TICKS):
                at = plan.tick_ns(tick)
                recording.add(topic, at, at, tuple(values(rows, tick, plan.storeys)))
    recording.close({"ticks_expected": str(plan.ticks), "outcome": "completed", "cause": "completed"})
    return path


def values(rows: Iterable[Signal], tick: int, storeys: int) -> Iterable[object]:
    """The values of a tick for each row."""
    for row in rows:
        count = row.count(storeys)
        each = [value(row, tick, place) for place in range(count)]
        yield each if count > 1 else each[0]


def value(row: Signal, tick: int, place: int) -> object:
    """One number: a sine as large as usual for its unit, later and smaller the farther a signal is from its target."""
    if row.kind in (FieldType.COUNT, FieldType.INDEX):
        return tick
    if row.kind is FieldType.STAMP:
        return round(tick * INTERVAL * 1e9) + 1
    if row.kind is FieldType.FLAG:
        return False
    if row.name == "t":
        return tick * INTERVAL
    if row.unit == "s":
        return 3e-4 + 1e-5 * (tick % 7)
    size = SIZES.get(row.unit, 1.0) * (1e3 if row.name == "column_force" else 1.0) / (1.0 + place)
    late = 0 if "target" in row.name or "command" in row.name else LATE
    return float(size * np.sin(2.0 * np.pi * FREQUENCY * INTERVAL * (tick - late)) + 1e-3 * size)
