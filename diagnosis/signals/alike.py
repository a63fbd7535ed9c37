"""Recorded series that passed different filters, means and delays of a logger, brought behind the same ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.recording.imported import ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from common.recording.logger.passing import averaged
from diagnosis.signals.earlier import earlier
from models.registry import Array


def alike(columns: Array, stated: Sequence[ImportedChannel], late: float, interval: float) -> Array:
    """Series (ticks, columns) behind the filters and means stated for any of them, each once, and late by `late` s.

    None is undone: each series passes those of the others. Before the first tick all is at rest, as in the model.
    """
    filters = list(dict.fromkeys(one.filter for one in stated if one.filter is not None))
    means = list(dict.fromkeys((one.average, one.means) for one in stated if one.average))
    result = np.empty_like(columns)
    for place, channel in enumerate(stated):
        values = columns[:, place]
        values = begun(values, channel, interval)
        for one in filters:
            values = values if one == channel.filter else passed(values, one, interval)
        for one_mean in means:
            own = one_mean == (channel.average, channel.means)
            values = values if own else mean(values, *one_mean, interval)
        result[:, place] = earlier(values, (channel.delay - late) / interval)
    return result


def passed(values: Array, one: LoggerFilter, interval: float) -> Array:
    """A series (ticks,), zero before its first tick, after a filter."""
    return one.filtered(np.append(0.0, values), interval)[1:]


def mean(values: Array, length: float, times: int, interval: float) -> Array:
    """A series (ticks,), zero before its first tick, as means over the last `length` s, so many times."""
    return averaged(np.append(0.0, values), interval, length, times)[1:]


def begun(values: Array, channel: ImportedChannel, interval: float) -> Array:
    """What filter and mean of a channel gave (ticks,) that had seen the first value ever before, as if it were zero."""
    first = seen = np.full(values.size, values[0])
    seen = passed(seen, channel.filter, interval) if channel.filter is not None else seen
    seen = mean(seen, channel.average, channel.means, interval) if channel.average else seen
    return values - first + seen
