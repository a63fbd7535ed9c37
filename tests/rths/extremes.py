"""A recording with the largest and smallest values of every type, which other programs may change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from common import signals
from common.recording.writer import Recording
from common.signals import FieldType, Signal

SLAVES = ("slave.roof", "slave.cellar")
EXTREMES = (0.1, -0.0, 5e-324, 1.7976931348623157e308, np.nan, np.inf, -np.inf, 2.0, 1 / 3)
TICKS = len(EXTREMES)
EVENTS: tuple[tuple[Any, ...], ...] = (
    (0.25, "slave.roof", "error", "limit", 'ä "quoted", line\nbreak', {"a.b": 0.1, "": -0.0}),
    (1.0, "master", "info", "stop", "completed", {}),
)


def value(row: Signal, tick: int) -> Any:
    """The value of a signal at a tick; a list where there are several storeys or slaves."""
    if row.name == "seq":
        return tick
    found = {
        FieldType.INDEX: tick - 1,
        FieldType.STAMP: 2**63 - 1 - tick if tick % 2 else -(2**63) + tick,
        FieldType.FLAG: tick % 2 == 0,
        FieldType.NUMBER: EXTREMES[tick],
        FieldType.STOREYS: [EXTREMES[tick], EXTREMES[-tick]],
        FieldType.TEXT: "ramping",
    }[row.kind]
    return [found, found] if row.slaves else found


def write(path: Path) -> Path:
    """Two slaves and two storeys; the cellar's last tick is missing."""
    topics = signals.default_topics(SLAVES)
    recording = Recording(path, "two", 2, topics, SLAVES)
    recording.metadata("versions", {"a": "ä\n", "": ""})
    recording.attach("ground_motion", bytes(range(256)), "application/octet-stream")
    for topic, rows in topics.items():
        for tick in range(TICKS - (topic == SLAVES[1])) if topic != "event" else ():
            stamp = 1_700_000_000_000_000_000 + tick
            recording.add(topic, stamp, stamp + 5, [value(row, tick) for row in rows])
    for stamp, event in enumerate(EVENTS):
        recording.add("event", stamp, stamp, event)
    recording.close({"outcome": "completed"})
    return path
