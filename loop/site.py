"""A laboratory in a simulated test: its kernel, its sensors and their readings at every tick.

The closed loop and the replay of a single laboratory use the same steps.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from laboratories import kinds
from laboratories.kind import Kind
from laboratories.sensors import noise, readings
from laboratories.sensors.readings import Readings
from models.compiled import jit
from models.registry import Array
from models.system import System


class Site(NamedTuple):
    """A laboratory with its sensors, which `read` and `play` update."""

    lab: Any  # record of its kind
    sensors: Readings
    errors: Array  # (ticks, channels): errors of the readings
    truth: Array  # (channels,): present readings of sensors without error
    measured: Array  # (ticks, channels), filled tick by tick


def build(kind: Kind, system: System, errors: Array) -> Site:
    """A laboratory of a system at rest, for as many ticks as `errors` (ticks, channels) has rows.

    Rows of the readings that have not been played yet hold anything: to set them to zero takes as long as 300 ticks.
    """
    sensors = readings.build(system.plan.test.interval, kind.channels.names, system.effects.sensors)
    return Site(
        kind.build(system), sensors, errors, np.zeros(len(kind.channels.names)), np.empty(errors.shape)
    )


def none(ticks: int) -> Site:
    """The placeholder for a missing laboratory: one channel that reads zero."""
    sensors = readings.build(1.0, ("none",), {})
    return Site(kinds.nothing(), sensors, np.zeros((ticks, 1)), np.zeros(1), np.zeros((ticks, 1)))


def of_any(played: Site) -> Site:
    """The same laboratory in the record for any kind."""
    return played._replace(lab=kinds.as_any(played.lab))


def errors(kind: Kind, system: System, ticks: int, seed: int | None = None) -> Array:
    """Noise of a laboratory's readings, (ticks, channels), under the seed of that laboratory; zero without one."""
    if seed is None:
        return np.zeros((ticks, len(kind.channels.names)))
    levels = readings.levels(kind.channels.names, kind.noise(system.plan), system.effects.sensors)
    return noise.Noise(seed, levels).rows(ticks)


@jit
def read(site: Site, tick: int, t: float) -> None:
    """Write the readings at a tick, at the time `t` (s), into its row of `measured`."""
    for channel in range(site.truth.size):
        site.measured[tick, channel] = readings.step(
            site.sensors, channel, site.truth[channel], site.errors[tick, channel], t
        )


@jit
def play(site: Site, drive: Array, interval: float, start: int, stop: int) -> None:
    """Fill the readings at the ticks from `start` to before `stop` for the commands `drive` (ticks, 2) in m and N."""
    for tick in range(start, stop):
        read(site, tick, tick * interval)
        kinds.advance(site.lab, site.truth, drive[tick, 0], drive[tick, 1])
