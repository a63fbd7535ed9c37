"""Rigs of the test '$name': the code between rths and the devices of a laboratory.

A rig is constructed before the test, armed once, then read and written once in every interval, and disarmed at the end.
All values are in SI units at the laboratory's own scale. `read` and `write` together must take less than an interval.
Name the classes in `[master.rig]` and `[slave.rig]` of $name.toml when their methods are written.
"""

from __future__ import annotations

from typing import Any

from common.errors import RigError
from common.rig import ColumnCommand, ColumnMeasurement, TableCommand, TableMeasurement


class ColumnRig:
    """Laboratory A: an actuator that deforms a specimen."""

    # True where `read` may be called any number of times before the test, to judge the sensors.
    idle_readings = False

    def __init__(self, interval: float, seed: int, **options: Any) -> None:
        """Open the device; `interval` in s, `options` as the plan's [master.rig] gives them."""
        self._interval = interval

    def arm(self) -> None:
        """Make ready to move; raise RigError with the reason where the device is not."""
        raise RigError("arm() of ColumnRig is not written yet: connect the actuator's controller")

    def read(self) -> ColumnMeasurement:
        """Deformation (m) and restoring force (N, positive against a positive deformation) of the specimen now."""
        raise RigError("read() of ColumnRig is not written yet: return the measured deformation and force")

    def write(self, command: ColumnCommand) -> None:
        """Ramp the actuator to `command.actuator_command` (m) over the coming interval."""
        raise RigError("write() of ColumnRig is not written yet: send the command to the controller")

    def disarm(self) -> None:
        """Bring the device to a safe stop; it must not raise, and may be called at any time."""


class TableRig:
    """Laboratory B: a shaking table that carries an active mass damper."""

    idle_readings = False

    def __init__(self, interval: float, seed: int, **options: Any) -> None:
        """Open the devices; `interval` in s, `options` as the plan's [slave.rig] gives them."""
        self._interval = interval

    def arm(self) -> None:
        """Make ready to move; raise RigError with the reason where a device is not."""
        raise RigError("arm() of TableRig is not written yet: connect the table and the damper's motor")

    def read(self) -> TableMeasurement:
        """Table displacement (m), its acceleration (m/s²), damper stroke (m) and force on the table (N) now."""
        raise RigError("read() of TableRig is not written yet: return the four measured values")

    def write(self, command: TableCommand) -> None:
        """Ramp the table to `command.table_command` (m); hold `command.damper_command` (N) over the interval."""
        raise RigError("write() of TableRig is not written yet: send the commands to table and motor")

    def disarm(self) -> None:
        """Bring the devices to a safe stop; it must not raise, and may be called at any time."""
