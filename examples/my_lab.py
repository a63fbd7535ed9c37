"""A laboratory A of one's own: a servo-valve actuator on a column that rubs in its fixture.

Try it:    rths run examples/my_test.toml --virtual

A rig needs four methods. This one is emulated in plain Python; real hardware fits behind the same four.
"""

from __future__ import annotations

import math
import random

from common.errors import RigError
from common.rig import ColumnCommand, ColumnMeasurement

SUBSTEPS = 8  # of an interval: 0.25 ms at 2 ms, a thirtieth of the servo loop's 1/ω = 8 ms


class ColumnLab:
    """Second-order actuator, linear column, friction in the fixture."""

    def __init__(
        self,
        interval: float,
        seed: int,
        stiffness: float = 12.5e6,  # N/m
        friction: float = 500.0,  # N
        frequency: float = 20.0,  # Hz, of the servo loop
        force_noise: float = 100.0,  # N, rms
    ) -> None:
        self._step = interval / SUBSTEPS
        self._random = random.Random(seed)  # noqa: S311 - sensor noise, not a secret
        self._stiffness, self._friction, self._noise = stiffness, friction, force_noise
        self._omega = 2.0 * math.pi * frequency
        self._position = self._velocity = self._command = 0.0

    def arm(self) -> None:
        """Refuse to move where the set-up makes no sense; on real hardware, check the interlocks here."""
        if self._stiffness <= 0.0:
            raise RigError("the stiffness of the column must be positive")

    def read(self) -> ColumnMeasurement:
        """Deformation (m) and force (N) now."""
        friction = self._friction * math.tanh(self._velocity / 1e-3)
        force = self._stiffness * self._position + friction + self._random.gauss(0.0, self._noise)
        return ColumnMeasurement(self._position, force)

    def write(self, command: ColumnCommand) -> None:
        """Ramp to the command over the coming interval."""
        start, self._command = self._command, command.actuator_command
        for i in range(1, SUBSTEPS + 1):
            wanted = start + (self._command - start) * i / SUBSTEPS
            error = wanted - self._position
            self._velocity += self._step * (self._omega**2 * error - 1.4 * self._omega * self._velocity)
            self._position += self._step * self._velocity

    def disarm(self) -> None:
        """Stay where it is; on real hardware, ramp down and take the pressure off."""
        self._velocity = 0.0
