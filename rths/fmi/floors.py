"""A process with a building in an FMU: `python -m rths.fmi.floors`, started by `common.foreign`, which it answers."""

from __future__ import annotations

import json
import os
import struct
import sys
from collections.abc import Iterable
from typing import Any

from common.errors import InputError, RthsError
from common.opensees.frame import COUNT
from common.piped import REASON
from rths.fmi.rig import Fmu

GROUND = "ground_acceleration"
MOTIONS = ("displacement", "velocity", "acceleration")
KEYS = ("inputs", "outputs", "start")


class Floors:
    """An FMU that is stepped from t_k to t_{k+1} with the forces on the floors and the ground acceleration at t_k.

    Its variables are `force_1` … (N) and `ground_acceleration` (m/s²), and the motion of the floors relative to the
    ground: `displacement_1` … (m), `velocity_1` … (m/s), `acceleration_1` … (m/s²). `inputs` and `outputs` in the
    options give other names, in that order. Without velocities or accelerations, differences over a step take their
    place. `start` holds start values by name.

    Raises:
        InputError: the file is no FMU that can be stepped here, or lacks a variable.
        RigError: it cannot be started.
    """

    def __init__(self, task: dict[str, Any]) -> None:
        options, self.count = task["options"], len(task["stiffness"])
        for name in options:
            if name not in KEYS:
                raise InputError(f"options in [structure] has '{name}', but an FMU takes {', '.join(KEYS)}.")
        inputs = options.get("inputs") or [*self._each("force"), GROUND]
        outputs = options.get("outputs") or [name for motion in MOTIONS for name in self._each(motion)]
        if len(inputs) != self.count + 1 or len(outputs) not in (self.count, 2 * self.count, 3 * self.count):
            raise InputError(
                f"inputs in [structure] must be {self.count} forces and the ground acceleration, and outputs "
                f"{self.count} displacements, which velocities and accelerations may follow."
            )
        self._fmu = Fmu(task["model"], task["interval"], inputs, outputs, options.get("start", {}))
        self._fmu.begin()
        self._ground, self._interval = [*task["ground"], 0.0], task["interval"]
        self._tick, self._motion = 0, self._told([0.0] * self.count, [0.0] * self.count)

    def _each(self, name: str) -> list[str]:
        return [f"{name}_{floor}" for floor in range(1, self.count + 1)]

    def _told(self, before: list[float], speed: list[float]) -> tuple[list[float], list[float], list[float]]:
        """Displacement, velocity and acceleration from the outputs, where `before` and `speed` were a step ago."""
        n, found = self.count, self._fmu.outputs()
        x, v, a = found[:n], found[n : 2 * n], found[2 * n :]
        v = v or self._rate(x, before)
        return x, v, a or self._rate(v, speed)

    def _rate(self, now: Iterable[float], before: Iterable[float]) -> list[float]:
        return [(b - a) / self._interval for a, b in zip(before, now, strict=True)]

    def step(self, forces: tuple[float, ...]) -> list[float]:
        """The motion at this step, and displacement and velocity ahead; `forces` (N) act from this step on."""
        present = self._motion
        ground = self._ground[min(self._tick, len(self._ground) - 1)]
        self._fmu.step([*forces, ground])
        self._tick += 1
        self._motion = self._told(present[0], present[1])
        return [*present[0], *present[1], *present[2], *self._motion[0], *self._motion[1]]

    def close(self) -> None:
        """Terminate the FMU, and delete its unpacked files."""
        self._fmu.end()


def main() -> int:
    """Serve until standard input ends."""
    out = os.dup(1)
    os.dup2(2, 1)
    source = sys.stdin.buffer
    try:
        floors = Floors(json.loads(source.readline()))
    except RthsError as error:
        return complained(error)
    try:
        forces, motion = struct.Struct(f"<{floors.count}d"), struct.Struct(f"<{5 * floors.count}d")
        os.write(out, COUNT.pack(floors.count))
        while data := source.read(forces.size):
            os.write(out, motion.pack(*floors.step(forces.unpack(data))))
    except RthsError as error:
        return complained(error)
    finally:
        floors.close()
    return 0


def complained(error: RthsError) -> int:
    """Write an error where the process that started this one reads it; the exit code."""
    sys.stderr.write(f"{REASON}{error}\n")
    sys.stderr.flush()
    return error.exit_code


if __name__ == "__main__":
    sys.exit(main())
