"""Recorded series that passed different filters and delays of a logger, brought behind the same ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from common.recording.imported import ImportedChannel, LoggerFilter
from diagnosis.signals.earlier import earlier
from models.registry import Array


def alike(columns: Array, stated: Sequence[ImportedChannel], late: float, interval: float) -> Array:
    """Series (ticks, columns) behind the filters stated for any of them, each once, and late by `late` s.

    No filter is undone: each series passes those of the others. Before the first tick all is at rest, as in the model.
    """
    filters = list(dict.fromkeys(one.filter for one in stated if one.filter is not None))
    result = np.empty_like(columns)
    for place, channel in enumerate(stated):
        values = columns[:, place]
        if channel.filter is not None:
            values = begun(values, channel.filter, interval)
        for one in filters:
            values = values if one == channel.filter else passed(values, one, interval)
        result[:, place] = earlier(values, (channel.delay - late) / interval)
    return result


def passed(values: Array, one: LoggerFilter, interval: float) -> Array:
    """A series (ticks,), zero before its first tick, after a filter."""
    return one.filtered(np.append(0.0, values), interval)[1:]


def begun(values: Array, one: LoggerFilter, interval: float) -> Array:
    """What a filter that had seen the first value ever before gave (ticks,), as if it had seen zero."""
    first = np.full(values.size, values[0])
    return values - first + passed(first, one, interval)
