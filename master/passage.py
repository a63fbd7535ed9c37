"""The numerical substructure while the earthquake's time passes slower than real time, or stands still.

The building computes the same steps for the same times as at full rate, only later. Between two of its steps the
laboratories follow the Taylor series of the motion that the building gave for the end of its last one, so that a
specimen goes through the displacements of the test and no others. The rates that they are told are those of the motion
as it passes: with the rate r of the earthquake's time, velocity r·v, acceleration r²·a + r'·v, jerk
r³·j + 3·r·r'·a + r''·v, and the motor's force r·u.

A tick rarely falls on the time of a step. The forces of a step are therefore interpolated between the tick before its
time and the one after it; until the latter the Taylor series goes on beyond the step, by less than an interval. At full
rate ticks and steps coincide, and the forces are those measured.

Source: the slow-down of predictor and corrector that continuous pseudodynamic tests use, Mosqueda, Stojadinovic and
Mahin, Implementation and accuracy of continuous hybrid simulation with geographically distributed substructures,
UCB/EERC 2005-02.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from common.earthquake_time import EarthquakeTime, Passing
from loop.substructure import (
    GROUND_ACCELERATION,
    OF_SLAVES,
    SENT_ACCELERATION,
    SENT_EFFORT,
    SENT_JERK,
    SENT_TARGET,
    SENT_VALUES,
    SENT_VELOCITY,
    STOREY_ACCELERATION,
    STOREY_DISPLACEMENT,
    STOREY_VALUES,
    STOREY_VELOCITY,
)
from master.building import Outputs, Sent
from models.registry import Array


class SteppedBuilding(NamedTuple):
    """The building by single steps, and apart from it the compensator of the master's own laboratory."""

    interval: float  # s
    compute: Callable[[int, float], None]  # a step from the force (N) of the own laboratory; fills the arrays
    compensate: Callable[..., float]
    asked: Array  # the values for the own laboratory at the end of the step
    forces: Array  # (slaves,) N that the next step uses
    output: Array


class Passage:
    """The ticks of one hold, from the `tick` of its order on until the pace is full again."""

    def __init__(self, building: SteppedBuilding, time: EarthquakeTime, tick: int) -> None:
        self._building, self._time = building, time
        self._step = tick - time.behind  # of the building, the next one
        self._present = float(building.asked[SENT_TARGET])  # target of the own laboratory at the tick, m
        self._before: tuple[float, Sequence[float]] = (float(self._step), ())
        self._slaves = range(OF_SLAVES, OF_SLAVES + SENT_VALUES * building.forces.size, SENT_VALUES)

    def __call__(self, tick: int, position: float, force: float, forces: Sequence[float]) -> Outputs:
        """Compute a tick from position (m) and force (N) of the master's laboratory and the slaves' `forces` (N)."""
        building, here, ahead = self._building, self._time.at(tick), self._time.at(tick + 1)
        felt = (force, *forces)
        if ahead.place > self._step <= here.place:
            own, *others = self._interpolated(here.place, felt)
            building.forces[:] = others
            building.compute(self._step, own)
            self._step += 1
        self._before = (here.place, felt)
        since = (ahead.place - self._step) * building.interval
        row = building.output.tolist()
        own_told = passing(building.asked.tolist(), since, ahead, building.interval)
        sent = [
            passing(row[place : place + SENT_VALUES], since, ahead, building.interval)
            for place in self._slaves
        ]
        present, self._present = self._present, own_told[SENT_TARGET]
        target, effort, *rates = own_told
        command = building.compensate(target, *rates, present, position, building.interval)
        storeys = moved(row[self._slaves.stop :], (here.place - self._step + 1.0) * building.interval)
        ground = row[GROUND_ACCELERATION]
        return Outputs(ground, present, command, effort, sent, storeys, rate=here.rate)

    def _interpolated(self, place: float, felt: Sequence[float]) -> Sequence[float]:
        """The forces at the time of the next step, from those of the tick before and of this one, at `place`."""
        there, before = self._before
        if not there < self._step < place:
            return felt
        share = (self._step - there) / (place - there)
        return [old + share * (new - old) for old, new in zip(before, felt, strict=True)]


def passing(told: Sequence[float], since: float, time: Passing, interval: float) -> Sent:
    """The values for a laboratory `since` s after the motion `told` by a step, as the earthquake's time passes."""
    x, v, a, j = (told[place] for place in (SENT_TARGET, SENT_VELOCITY, SENT_ACCELERATION, SENT_JERK))
    rate, change, bend = time.rate, time.change / interval, time.bend / interval**2
    target = x + v * since + 0.5 * a * since**2
    velocity, acceleration = v + a * since, a + j * since
    return (
        target,
        rate * told[SENT_EFFORT],
        rate * velocity,
        rate**2 * acceleration + change * velocity,
        rate**3 * j + 3.0 * rate * change * acceleration + bend * velocity,
    )


def moved(storeys: list[float], since: float) -> list[float]:
    """The values of the storeys at a step, their displacements and velocities `since` s after it."""
    n = len(storeys) // STOREY_VALUES
    for i in range(n):
        v, a = storeys[STOREY_VELOCITY * n + i], storeys[STOREY_ACCELERATION * n + i]
        storeys[STOREY_DISPLACEMENT * n + i] += v * since + 0.5 * a * since**2
        storeys[STOREY_VELOCITY * n + i] = v + a * since
    return storeys
