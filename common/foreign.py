"""A building that a program beside the master computes: forces on its floors go in, their motion comes out.

The program is that of `common.opensees.frame` or, for an FMU, `rths.fmi.floors`; both speak as the former describes.
"""

from __future__ import annotations

import struct
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from common.errors import InputError, InterlockError
from common.opensees import frame, process
from common.piped import EndedError, PipedProgram
from common.plan.tables import OPENSEES

FMU_PROGRAM = "rths.fmi.floors"
PATIENCE_S = 120.0  # until a model is built: gravity loads of a large one take some ten seconds


class FloorMotion(NamedTuple):
    """The motion of the floors relative to the ground, at a step and ahead of it, for the end of the interval."""

    displacement: tuple[float, ...]  # m
    velocity: tuple[float, ...]  # m/s
    acceleration: tuple[float, ...]  # m/s²
    ahead: tuple[float, ...]  # displacement, m
    velocity_ahead: tuple[float, ...]  # m/s


class ForeignModel:
    """The program with the model `text`, as model in [structure] has it; relative paths start from `base`.

    `task` holds `options`, `interval` s, the `ground` acceleration at every step m/s², and the initial `stiffness` of
    the laboratories in every storey N/m.

    Raises:
        InputError: there is no such file, its program does not start, or the model has other than `floors` floors.
    """

    def __init__(self, text: str, base: Path, floors: int, task: Mapping[str, Any]) -> None:
        self.name = text.removeprefix(OPENSEES)
        self._program = started(text, base, task)
        self.close = self._program.close
        try:
            found = self._program.answer(frame.COUNT.size, PATIENCE_S)
        except EndedError as error:
            self.close()
            raise InputError(
                f"'{self.name}' cannot be the building ({error}){process.hint(str(error))}."
            ) from None
        count = frame.COUNT.unpack(found)[0] if found else 0
        if count != floors:
            self.close()
            has = f"has {count} floors" if found else f"is not built after {PATIENCE_S:g} s"
            raise InputError(
                f"'{self.name}' {has}, but [structure] gives {floors} masses: give one per floor."
            )
        self._floors = floors
        self._forces, self._motion = struct.Struct(f"<{floors}d"), struct.Struct(f"<{5 * floors}d")

    def advance(self, forces: Sequence[float]) -> None:
        """Hand over the forces (floors,) N of a step; raises InterlockError where the program has ended."""
        try:
            self._program.send(self._forces.pack(*forces))
        except EndedError as error:
            raise self._ended(error) from None

    def motion(self, seconds: float) -> FloorMotion | None:
        """The motion of that step, None where it has not come after some seconds; raises InterlockError likewise."""
        try:
            data = self._program.answer(self._motion.size, seconds)
        except EndedError as error:
            raise self._ended(error) from None
        if data is None:
            return None
        values, n = self._motion.unpack(data), self._floors
        return FloorMotion(*(values[i * n : (i + 1) * n] for i in range(5)))

    def _ended(self, error: EndedError) -> InterlockError:
        return InterlockError(f"The building '{self.name}' has ended: {str(error).rstrip('.')}.")


def file_of(text: str, base: Path) -> Path:
    """The file of a model; raises InputError where there is none."""
    path = base / Path(text.removeprefix(OPENSEES)).expanduser()
    if not path.is_file():
        raise InputError(f"There is no file {path}: model in [structure] starts from the folder of the plan.")
    return path.resolve()


def started(text: str, base: Path, task: Mapping[str, Any]) -> PipedProgram:
    """The program of a model, started."""
    told = {"model": str(file_of(text, base)), **task}
    if text.startswith(OPENSEES):
        return process.started(frame.__file__, told)
    return PipedProgram([sys.executable, "-m", FMU_PROGRAM], told)


def timed(model: ForeignModel, stiffness: Sequence[float], most: int, seconds: float) -> list[float]:
    """Durations (s) of up to `most` steps, within some seconds; laboratories are springs (N/m) in the storeys.

    Raises:
        InterlockError: the program ended.
    """
    found: list[float] = []
    forces = [0.0] * len(stiffness)
    end = time.monotonic() + seconds
    while len(found) < most and time.monotonic() < end:
        began = time.perf_counter()
        model.advance(forces)
        motion = model.motion(PATIENCE_S)
        found.append(time.perf_counter() - began)
        if motion is None:
            break
        forces = springs(stiffness, motion.ahead)
    return found


def springs(stiffness: Sequence[float], displacement: Sequence[float]) -> list[float]:
    """Forces (N) on the floors of springs (N/m) in the storeys at displacements (m) of the floors."""
    below = [0.0, *displacement[:-1]]
    drawn = [k * (x - under) for k, x, under in zip(stiffness, displacement, below, strict=True)]
    return [above - here for here, above in zip(drawn, [*drawn[1:], 0.0], strict=True)]
