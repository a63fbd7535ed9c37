"""Readings of a laboratory after the filters and delays of a data logger."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.recording.imported import ImportedChannel
from diagnosis.recorded.laboratory import RecordedLaboratory
from models.registry import Array
from models.system import System


def through_logger(
    readings: Array,
    lab: RecordedLaboratory,
    system: System,
    stated: Sequence[ImportedChannel],
    drive: Sequence[Array],
) -> Array:
    """What a logger records of a laboratory's readings (ticks, signals): after its filters and delays.

    With the commands that `drive` the laboratory, it is known what the readings do between ticks. A motion that
    diverges passes no logger.
    """
    if not np.isfinite(readings).all():
        return readings
    interval = system.plan.test.interval
    made = [system.effects.sensors.get(name) for name in lab.kind.channels.names]
    later = [one.logger_delay if one else 0.0 for one in made]
    places = [
        place(channel, channel.delay + more, interval) for channel, more in zip(stated, later, strict=True)
    ]
    result = readings
    if drive and any(place != 0.0 for place in places):
        between = lab.kind.between_ticks(system, np.stack(drive, axis=1), places)
        result = result + np.where([place != 0.0 for place in places], between, 0.0)
    for number, (channel, more) in enumerate(zip(stated, later, strict=True)):
        if channel.filter or channel.average or channel.high_pass or channel.delay + more:
            result[:, number] = channel.through(result[:, number], interval, more)
    return result


def place(channel: ImportedChannel, late: float, interval: float) -> float | None:
    """Where between two ticks, from 0 to 1, a channel that is `late` (s) was read; None for one behind a filter."""
    if channel.at_ticks or channel.between:
        return 0.0
    return None if channel.blunt else (-late / interval) % 1.0
