"""An emulated laboratory of any kind: its model and its sensors behind the interface of a rig."""

from __future__ import annotations

from operator import add

from laboratories.kind import Kind
from laboratories.sensors import noise, readings
from models.system import System


class EmulatedLab:
    """A kind's laboratory of a system, at rest; `seed` is that of its sensors' noise.

    Raises:
        InputError: parameters or effects of the system are not valid for the kind.
    """

    def __init__(self, kind: Kind, system: System, seed: int) -> None:
        names, sensors = kind.channels.names, system.effects.sensors
        interval = system.plan.test.interval
        self._move = kind.mover(kind.build(system))
        self._readings = readings.build(interval, names, sensors)
        self._noise = noise.Noise(seed, readings.levels(names, kind.noise(system.plan), sensors))
        self._plain = not any(name in sensors for name in names)  # a reading is value plus noise
        self._interval, self._tick = interval, 0
        self._true: tuple[float, ...] = (0.0,) * len(names)

    def arm(self) -> None:
        """Do nothing: an emulated laboratory is always ready."""

    def read(self) -> tuple[float, ...]:
        """The readings at the present tick in the order of the channels, with the sensors' noise."""
        if self._plain:
            return tuple(map(add, self._true, self._noise.row()))
        error, true, sensors = self._noise.row(), self._true, self._readings
        t = self._tick * self._interval
        self._tick += 1
        return tuple(
            readings.step(sensors, place, true[place], error[place], t) for place in range(len(true))
        )

    def write(self, command: tuple[float, ...]) -> None:
        """Advance by one interval, in which the transfer system follows its command and a motor holds its force."""
        self._true = self._move(*command)

    def disarm(self) -> None:
        """Do nothing: an emulated device stays where it is."""
